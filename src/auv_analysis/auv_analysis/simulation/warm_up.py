"""Compile what the nodes will call, once and before they start, with a word about it."""

import sys
import time

import numpy as np

from auv_analysis.scenario.scenario import Scenario
from auv_dynamics.kernel.compile import JITTED, cache_folder, config
from auv_dynamics.plant.plant import Plant, initial_state
from auv_gvc_controller.control.sampled import SampledLaw, is_compiled
from auv_gvc_controller.laws.model import control_model

NOTICE_AFTER = 1.0  # s: a cached kernel is loaded faster than that


def announce(scenario: Scenario, controllers: list[str]) -> None:
    """Say how the kernel runs where that costs time: not compiled, or to be compiled first."""
    for name in controllers:
        gains = scenario.gains(name)
        if JITTED and not is_compiled(gains):
            law = type(gains).__name__
            print(f'{name}: the law {law} runs as plain Python', file=sys.stderr)
    if not JITTED:
        why = 'numba is switched off' if config else 'numba is not installed'
        print(f'{why}: the kernel runs as plain Python, slower', file=sys.stderr)
    elif not any(cache_folder().glob('**/*.nbi')):
        print('compiling the kernel for this machine, once ...', file=sys.stderr, flush=True)


def warm_up(scenario: Scenario, controllers: list[str]) -> None:
    """Load or compile the kernel for one step of each law; say so when it takes time."""
    announce(scenario, controllers)
    if not JITTED:
        return
    begin = time.monotonic()
    model = control_model(scenario.vehicle)
    for name in controllers:
        gains = scenario.gains(name)
        if is_compiled(gains):
            SampledLaw(gains, model, scenario.reach(name))
    x = initial_state(np.zeros(6), np.zeros(6))
    integrator = scenario.data['integrator']
    devices = scenario.actuators, scenario.noise(), scenario.faults
    Plant(scenario.uncertainty, scenario.step, integrator, x, *devices)
    if time.monotonic() - begin > NOTICE_AFTER:
        print(f'kernel ready after {time.monotonic() - begin:.1f} s', file=sys.stderr)
