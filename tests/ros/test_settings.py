"""Settings of nodes: the defaults of the contract, as whoever knows parameters is told them."""

from typing import Any

import pytest

from auv_dynamics.ros.settings import GraphSettings, PlantSettings, read_settings

GRAPH = {
    'lockstep': False, 'odom_frame': 'odom_ned', 'base_frame': 'base_link_fsd',
    'expected_subscribers': None,
}  # fmt: skip
PLANT = {
    'vehicle': '', 'step': 0.01, 'duration': 0.0, 'start_paused': False, 'publish_clock': True,
    'recorder_window': 0, 'integrator': 'ode5', 'seed': 0, 'initial.eta': [0.0] * 6,
    'initial.nu': [0.0] * 6, 'start_after': None, 'wrench_timeout': 0.5,
}  # fmt: skip


class Told:
    """Remembers what it is asked for, and knows a vehicle alone."""

    def __init__(self) -> None:
        self.defaults: dict[str, Any] = {}
        self.accepted: dict[str, dict[str, Any]] = {}

    def __call__(self, name: str, kind: Any, default: Any, text: str, **accepted: Any) -> Any:
        self.defaults[name], self.accepted[name] = default, accepted
        return 'rexrov' if name == 'vehicle' else default


@pytest.mark.parametrize(('kind', 'defaults'), [(GraphSettings, GRAPH), (PlantSettings, PLANT)])
def test_the_defaults_are_those_of_the_contract(kind, defaults) -> None:
    told = Told()
    read_settings(kind, told, 'node')
    assert {name: x for name, x in told.defaults.items() if name in defaults} == defaults
    assert {x for name, x in told.defaults.items() if name not in defaults} <= {None}


def test_a_default_may_depend_on_the_circumstances() -> None:
    told = Told()
    assert read_settings(PlantSettings, told, 'node', wrench_timeout=30.0).wrench_timeout == 30.0
    assert {**told.defaults, **PLANT} == {**told.defaults, 'wrench_timeout': 0.5}


def test_the_integrator_is_one_of_the_three() -> None:
    told = Told()
    read_settings(PlantSettings, told, 'node')
    assert told.accepted['integrator'] == {'one_of': ['ode5', 'rk4', 'euler']}
