"""Signals that wait for the end of something do then what they would have done."""

import signal

import pytest

from auv_dynamics.files.errors import ENDING, on_signals, undisturbed


@pytest.fixture
def handlers():
    before = {number: signal.getsignal(number) for number in ENDING}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize('number', ENDING)
@pytest.mark.usefixtures('handlers')
def test_a_signal_that_has_waited_does_what_it_would_have_done(number) -> None:
    done = []
    signal.signal(number, signal.default_int_handler)

    @undisturbed()
    def work() -> None:
        signal.raise_signal(number)
        done.append('worked')

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == ['worked']
    with on_signals(lambda: done.append('told')):
        with undisturbed():
            signal.raise_signal(number)
            signal.raise_signal(number)
            done.append('waited')
        assert done[1:] == ['waited', 'told'], 'once, and afterwards'
    seen = []
    for one in ENDING:
        signal.signal(one, lambda number, _: seen.append(number))
    with undisturbed():
        signal.raise_signal(number)
        signal.raise_signal(ENDING[number == ENDING[0]])
    assert seen == [number], 'the first that came'
    signal.signal(number, signal.SIG_IGN)
    with undisturbed():
        signal.raise_signal(number)
    assert signal.getsignal(number) == signal.SIG_IGN
    heard: list[int] = []
    with on_signals(lambda: heard.append(number)):
        signal.raise_signal(number)
        signal.raise_signal(ENDING[number == ENDING[0]])
    assert heard == [number] * (1 + (number != signal.SIGHUP)), 'which `nohup` lets be ignored'
