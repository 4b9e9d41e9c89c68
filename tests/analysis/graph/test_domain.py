"""The ROS domain of a run: asked for, of the environment, or a free one."""

import socket
from contextlib import suppress

import pytest

from auv_analysis.cli import main, scenario_runs
from auv_analysis.graph.domain import (
    LARGEST,
    RANGE,
    VARIABLE,
    chosen_domain,
    joined_domain,
    own_domain,
    place_of,
)
from auv_dynamics.files.errors import InputError

WRONG = ['-1', '102', '99999999999999999999', 'abc', '1.5', '0x1', ' ', '1e1']


@pytest.fixture(autouse=True)
def no_domain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)


@pytest.mark.parametrize('domain', [0, 1, 42, LARGEST])
def test_option_is_taken(domain: int) -> None:
    assert chosen_domain(domain) == (domain, False)


@pytest.mark.parametrize('domain', [0, 1, 42, LARGEST])
def test_environment_is_taken(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, str(domain))
    assert chosen_domain(None) == (domain, False)


def test_option_comes_before_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, 'abc')
    assert chosen_domain(7) == (7, False)


def test_empty_environment_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, '')
    domain, picked = chosen_domain(None)
    assert picked
    assert 1 <= domain <= LARGEST


def test_who_joins_a_graph_is_on_the_domain_of_every_ros_program(monkeypatch) -> None:
    assert joined_domain(None) == 0
    monkeypatch.setenv(VARIABLE, '7')
    assert (joined_domain(None), joined_domain(3)) == (7, 3)


def test_a_graph_that_other_machines_hear_is_not_called_local(monkeypatch) -> None:
    monkeypatch.setenv(RANGE, 'SUBNET')
    assert place_of(7) == f'{VARIABLE}=7, {RANGE}=SUBNET'


@pytest.mark.parametrize('participant', [0, 1, 4])
def test_picked_domain_is_one_whose_ports_are_free(participant, monkeypatch) -> None:
    monkeypatch.setattr('random.shuffle', lambda candidates: None)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken, suppress(OSError):
        taken.bind(
            ('127.0.0.1', 7400 + 250 + 10 + 2 * participant)
        )  # of domain 1, DDSI-RTPS 9.6.1.1
        assert chosen_domain(None)[0] > 1


@pytest.mark.parametrize('domain', [-1, LARGEST + 1])
def test_option_out_of_range_is_refused(domain: int) -> None:
    with pytest.raises(InputError, match=f'--domain-id: expected .* 0 to 101, found {domain}'):
        chosen_domain(domain)


@pytest.mark.parametrize('value', WRONG)
def test_wrong_environment_is_refused(value: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, value)
    with pytest.raises(InputError, match=f'{VARIABLE}: expected a whole number from 0 to 101'):
        chosen_domain(None)


@pytest.mark.parametrize('where', ['--domain-id', VARIABLE])
@pytest.mark.parametrize('value', WRONG)
def test_run_refuses_a_wrong_domain_in_one_line(where, value, monkeypatch, capsys) -> None:
    monkeypatch.setattr(
        scenario_runs, 'results_folder', lambda *_, **__: pytest.fail('work has begun')
    )
    arguments = ['run', 'case1']
    if where == VARIABLE:
        monkeypatch.setenv(VARIABLE, value)
    else:
        arguments += [f'{where}={value}']
    with pytest.raises(SystemExit) as end:
        main.main(arguments)
    lines = capsys.readouterr().err.splitlines()
    assert (end.value.code, len(lines)) == (2, 1), lines
    assert f'{where}: expected a whole number from 0 to 101, found ' in lines[0]


def test_domain_of_another_run_is_refused_and_never_picked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    with own_domain(None) as (domain, picked):
        assert picked
        with (
            pytest.raises(
                InputError, match=f'{VARIABLE}={domain}: expected a domain that no other'
            ),
            own_domain(domain),
        ):
            pass
        with own_domain(None) as (another, _):
            assert another != domain
    with own_domain(domain) as again:
        assert again == (domain, False)
