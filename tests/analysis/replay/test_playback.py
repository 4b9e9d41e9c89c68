"""Bag time against the steady clock: exact over hours, whatever the rate, paused or not."""

from types import SimpleNamespace

import pytest

from auv_analysis.cli.replay import DOWN, RIGHT, UP, _obey, _play, _state
from auv_analysis.nodes.replay_node import HELD, Playback

SECOND = 10**9
NOW = 50_000.0  # s, what a steady clock may say


def test_due_times_do_not_drift() -> None:
    playback = Playback(rate=4.0)
    assert playback.wait(NOW, 7 * SECOND) == 0.0
    for k in range(0, 10**6, 997):
        ns = 7 * SECOND + k * SECOND // 100
        assert playback.wait(NOW + 0.25 * k / 100 - 1.0, ns) == pytest.approx(1.0, abs=1e-9)


def test_a_gap_is_jumped_over_and_the_time_goes_on_behind_it() -> None:
    playback = Playback(rate=2.0, skips_gaps=True)
    playback.wait(NOW, 0)
    playback.played(0)
    assert playback.wait(NOW + 1.0, 60 * SECOND) == 29.0, 'a minute is none'
    assert playback.wait(NOW + 1.0, 10**9 * SECOND) == 0.0
    playback.played(10**9 * SECOND)
    assert playback.wait(NOW + 1.5, (10**9 + 3) * SECOND) == 1.0


@pytest.mark.parametrize('ns', [0, SECOND, 10**6 * SECOND])
def test_as_fast_as_possible_never_waits(ns: int) -> None:
    playback = Playback(rate=0.0)
    playback.wait(NOW, 0)
    assert playback.wait(NOW, ns) == 0.0


def test_a_pause_holds_the_place_between_two_messages() -> None:
    playback = Playback(rate=2.0)
    playback.wait(NOW, 0)
    playback.played(0)
    playback.pause(NOW + 0.3, SECOND)  # 0.6 s of the bag
    assert playback.wait(NOW + 9.0, SECOND) == HELD
    playback.run(NOW + 100.0)
    assert playback.wait(NOW + 100.0, SECOND) == pytest.approx(0.2)


def test_what_was_held_up_is_not_owed_after_a_pause() -> None:
    """Subscribers had no room for ten seconds: the place in the bag is that of the next message."""
    playback = Playback(rate=1.0)
    playback.wait(NOW, 0)
    playback.played(0)
    playback.pause(NOW + 10.0, SECOND)
    playback.run(NOW + 20.0)
    assert playback.wait(NOW + 20.0, SECOND) == pytest.approx(0.0)
    assert playback.wait(NOW + 20.0, 2 * SECOND) == pytest.approx(1.0)


def test_steps_while_paused_and_goes_on_from_there() -> None:
    playback = Playback(rate=1.0, paused=True)
    assert playback.wait(NOW, 5 * SECOND) == HELD
    playback.step(5 * SECOND)
    assert playback.wait(NOW, 5 * SECOND) == 0.0
    assert playback.wait(NOW, 6 * SECOND) == HELD
    playback.played(5 * SECOND)
    playback.run(NOW + 3.0)
    assert playback.wait(NOW + 3.0, 6 * SECOND) == pytest.approx(1.0)


def test_a_step_before_the_first_look() -> None:
    playback = Playback(rate=1.0, paused=True)
    playback.step(SECOND)
    assert playback.wait(NOW, SECOND) == 0.0


@pytest.mark.parametrize('paused', [False, True])
def test_another_rate_holds_from_now_on(paused: bool) -> None:
    playback = Playback(rate=1.0)
    playback.wait(NOW, 0)
    playback.played(0)
    if paused:
        playback.pause(NOW + 0.5, SECOND)
    playback.change_rate(NOW + 0.5, SECOND, 0.1)
    if paused:
        playback.run(NOW + 0.5)
    assert playback.wait(NOW + 0.5, SECOND) == pytest.approx(5.0)


def test_keys_change_the_rate() -> None:
    rates: list[float] = []
    playback = Playback(rate=3.0)
    player = SimpleNamespace(playback=playback, change_rate=rates.append)
    for keys in (UP, DOWN, UP + DOWN, DOWN + DOWN):
        _obey(player, keys)
    assert rates == [6.0, 1.5, 0.75]
    playback.rate = 0.0  # as fast as it goes has no double
    _obey(player, UP)
    assert len(rates) == 3


def test_from_full_speed_to_a_rate() -> None:
    playback = Playback(rate=0.0)
    playback.wait(NOW, 0)
    playback.played(40 * SECOND)
    playback.change_rate(NOW + 0.1, 41 * SECOND, 1.0)
    assert playback.wait(NOW + 0.1, 41 * SECOND) == pytest.approx(1.0)


def test_a_loop_begins_where_it_is() -> None:
    playback = Playback(rate=1.0)
    playback.wait(NOW, 0)
    playback.played(30 * SECOND)
    playback.restart()
    assert playback.wait(NOW + 31.0, 0) == 0.0
    assert playback.wait(NOW + 31.0, SECOND) == pytest.approx(1.0)


def test_however_high_the_rate_a_pause_holds_before_the_next_message():
    playback = Playback(rate=1e300)
    playback.wait(1.0, 0)
    playback.pause(1e10, 5 * SECOND)
    playback.run(2e10)
    assert playback.wait(2e10, 5 * SECOND) == 0.0


def test_keys_pause_go_on_and_step_and_the_bar_says_so() -> None:
    said = []
    keys = {key: lambda key=key: said.append(key) for key in ('run', 'pause', 'step')}
    player = SimpleNamespace(playback=Playback(rate=2.0), loops=1, **keys)
    assert _state(player, '') == 'playing, x 2, loop 2'
    _obey(player, b' ' + RIGHT)
    player.playback.paused = True
    _obey(player, b' ')
    _obey(player, RIGHT + RIGHT)
    assert said == ['pause', 'run', 'step', 'step']
    assert _state(player, '') == 'paused, x 2, loop 2'
    assert _state(player, 'somebody') == 'waiting, x 2, loop 2'


def test_what_a_replay_waits_for_is_said_once(capsys) -> None:
    missing = 'odom: expected 1 subscribers, found 0'
    playback = SimpleNamespace(rate=1.0, paused=False)
    player = SimpleNamespace(now_ns=0, playback=playback, loops=0, waits_for=lambda: missing)
    plan = SimpleNamespace(begin=0, end=10)
    node = SimpleNamespace(player=player, plan=plan, playing=False, exit_code=None)
    looks = iter((None, None, 0))

    def spin(_: float) -> None:
        node.exit_code = next(looks)

    keyboard = SimpleNamespace(there=False, ended=False, wait=lambda _: b'')
    _play(SimpleNamespace(node=node, spin=spin), keyboard)
    assert capsys.readouterr().err.count(f'waits: {missing}\n') == 1
