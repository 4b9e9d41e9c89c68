"""In-process simulation of a scenario by the one kernel."""

from typing import Any, Literal

import numpy as np

from auv_analysis.closed_loop import Grid, Log, fill_continuous, fill_held
from auv_analysis.run import Run
from auv_analysis.scenario import Scenario
from auv_dynamics.actuators import memory
from auv_dynamics.files import LARGEST, InputError
from auv_dynamics.integrator import TABLEAUS, stage_times
from auv_dynamics.jit import plain
from auv_dynamics.kinematics import unwrapped
from auv_dynamics.plant import SIZE, eta_of, initial_state
from auv_dynamics.sensors import WIDTH
from auv_gvc_controller.model import control_model
from auv_gvc_controller.sampled import anti_windup, is_compiled, user_law

Hold = Literal['continuous', 'zoh']
HOLDS = ('continuous', 'zoh')


class DivergedError(ArithmeticError):
    """The closed loop left the finite numbers."""


def simulate(scenario: Scenario, controller: str, hold: Hold = 'continuous') -> Run:
    """Run one controller of a scenario.

    Parameters
    ----------
    scenario : of `load_scenario`
    controller : name of one of its controllers
    hold : 'continuous' puts the law inside every stage of the integrator, as the paper does;
        'zoh' samples it at every step and holds the wrench, as the nodes do

    Returns
    -------
    run : Run of n + 1 samples, n = duration / step

    Raises
    ------
    InputError : no controller of that name; actuators or sensors with hold 'continuous'
    ValueError : no such hold
    DivergedError : a value stopped being finite; the text says when

    """
    if hold not in HOLDS:
        raise ValueError(f'hold: expected {" or ".join(HOLDS)}, found {hold!r}')
    gains = scenario.gains(controller)
    check_hold(scenario, hold)
    grid, log = _grid(scenario), _log(scenario.steps, type(gains).STATES)
    _run_kernel(scenario, controller, hold, gains, grid, log)
    t = grid.t[:, 0].copy()
    _check_finite(log, t, scenario, controller)
    sensing, acting = 'sensors' in scenario.data, 'actuators' in scenario.data
    return Run(
        t=t,
        eta=unwrapped_eta(log.x),
        nu=log.x[:, 7:],
        nu_d=grid.reference[:, 0, :6],
        nu_d_dot=grid.reference[:, 0, 6:],
        tau=log.tau,
        disturbance=log.F,
        disturbance_estimate=log.f,
        vehicle=scenario.vehicle,
        scenario=scenario.name,
        controller=controller,
        law=scenario.controller(controller)['law'],
        gains=scenario.gain_values(controller),
        step=scenario.step,
        source='simulate',
        hold=hold,
        measured=log.measured[:, 7:] if sensing else None,
        applied=log.applied if acting else None,
        law_state=log.state,
        kinds=scenario.kinds,
    )


def check_hold(scenario: Scenario, hold: Hold) -> None:
    """Raise InputError where the scenario has something that acts on samples only."""
    for key in ('actuators', 'sensors'):
        if hold == 'continuous' and key in scenario.data:
            expected = "hold 'zoh' (--hold zoh): they act on samples"
            raise InputError(scenario.path, key, expected, "hold 'continuous'")


def _grid(scenario: Scenario) -> Grid:
    t = stage_times(TABLEAUS[scenario.data['integrator']], scenario.step, 0, scenario.steps + 1)
    setpoint, noise = scenario.setpoint, scenario.noise()
    reference = np.concatenate([setpoint.value(t), setpoint.derivative(t)], axis=-1)
    rows = np.zeros((0, WIDTH)) if noise is None else noise.rows(len(t))
    return Grid(t, reference, *scenario.uncertainty.tables(t), rows, scenario.step)


def _log(n: int, states: int) -> Log:
    widths = (SIZE, SIZE, states, 6, 6, 6, 6)
    return Log(*(np.full((n + 1, width), np.nan) for width in widths))


def _run_kernel(
    scenario: Scenario, controller: str, hold: Hold, gains: Any, grid: Grid, log: Log
) -> None:
    def kernel(function: Any) -> Any:
        return function if is_compiled(gains) else plain(function)

    tableau, model = TABLEAUS[scenario.data['integrator']], control_model(scenario.vehicle)
    x = np.concatenate([initial_state(*scenario.initial), np.zeros(log.state.shape[1])])
    truth, actuators = scenario.uncertainty.truth, scenario.actuators
    with np.errstate(all='ignore'), user_law(gains):
        if hold == 'continuous':
            kernel(fill_continuous)(truth, gains, model, grid, tableau, x, log)
        else:
            guard = anti_windup(gains, scenario.reach(controller))
            kernel(fill_held)(
                truth, actuators, memory(actuators), gains, model, guard, grid, tableau, x, log
            )


def unwrapped_eta(x: np.ndarray) -> np.ndarray:
    """Eta (n, 6) of the states (n, 13) of consecutive samples."""
    eta = eta_of(x)
    eta[:, 3:] = unwrapped(eta[:, 3:])
    return eta


def _check_finite(log: Log, t: np.ndarray, scenario: Scenario, controller: str) -> None:
    finite = np.all([(np.abs(part) < LARGEST).all(axis=1) for part in log], axis=0)
    if not finite.all():
        first = t[np.argmin(finite)]
        where = f'{scenario.name}, {controller}'
        raise DivergedError(f'{where}: the closed loop diverges, not finite from t = {first:g} s')
