"""In-process simulation of a scenario by the one kernel."""

from typing import Literal

import numpy as np

from auv_analysis.closed_loop import Grid, Log, fill_continuous, fill_held
from auv_analysis.run import Run
from auv_analysis.scenario import Scenario
from auv_dynamics.integrator import TABLEAUS, stage_times
from auv_dynamics.jit import plain
from auv_dynamics.kinematics import unwrapped
from auv_dynamics.plant import SIZE, eta_of, initial_state
from auv_gvc_controller.model import control_model
from auv_gvc_controller.sampled import is_compiled

Hold = Literal['continuous', 'zoh']
KERNELS = {'continuous': fill_continuous, 'zoh': fill_held}


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
    InputError : no controller of that name
    ValueError : no such hold
    DivergedError : a value stopped being finite; the text says when

    """
    if hold not in KERNELS:
        raise ValueError(f'hold: expected {" or ".join(KERNELS)}, found {hold!r}')
    gains = scenario.gains(controller)
    kernel = KERNELS[hold] if is_compiled(gains) else plain(KERNELS[hold])
    tableau = TABLEAUS[scenario.data['integrator']]
    n, states = scenario.steps, type(gains).STATES
    t = stage_times(tableau, scenario.step, 0, n + 1)
    reference = np.concatenate(
        [scenario.setpoint.value(t), scenario.setpoint.derivative(t)], axis=-1
    )
    F = scenario.disturbance(t.ravel()).reshape(*t.shape, 6)
    log = Log(*(np.full((n + 1, width), np.nan) for width in (SIZE, states, 6, 6)))
    x = np.concatenate([initial_state(*scenario.initial), np.zeros(states)])
    model = control_model(scenario.vehicle)
    with np.errstate(all='ignore'):
        kernel(
            scenario.vehicle.model,
            gains,
            model,
            Grid(t, reference, F, scenario.step),
            tableau,
            x,
            log,
        )
    _check_finite(log, t[:, 0], scenario, controller)
    spec = dict(scenario.controller(controller))
    return Run(
        t=t[:, 0],
        eta=unwrapped_eta(log.x),
        nu=log.x[:, 7:],
        nu_d=reference[:, 0, :6],
        nu_d_dot=reference[:, 0, 6:],
        tau=log.tau,
        disturbance=F[:, 0],
        disturbance_estimate=log.f,
        vehicle=scenario.vehicle,
        scenario=scenario.name,
        controller=controller,
        law=spec.pop('law'),
        gains=spec,
        step=scenario.step,
        source='simulate',
    )


def unwrapped_eta(x: np.ndarray) -> np.ndarray:
    """Eta (n, 6) of the states (n, 13) of consecutive samples."""
    eta = eta_of(x)
    eta[:, 3:] = unwrapped(eta[:, 3:])
    return eta


def _check_finite(log: Log, t: np.ndarray, scenario: Scenario, controller: str) -> None:
    finite = np.isfinite(log.x).all(axis=1) & np.isfinite(log.tau).all(axis=1)
    if not finite.all():
        first = t[np.argmin(finite)]
        where = f'{scenario.name}, {controller}'
        raise DivergedError(f'{where}: the closed loop diverges, not finite from t = {first:g} s')
