"""Compile what the tests call, once and before they start: workers would do it side by side.

Two processes share it, as there are two cores on a small machine. What is missing here is compiled
by the test that calls it first. Where any clone did it before, there is nothing to do.
"""

import hashlib
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from auv_dynamics.kernel.compile import JITTED, cache_folder

STEPS = 20
SHARED, OWN = 'controllers.{}.k_D', 'setpoint.surge.offset'  # set-points that are shared, or not
HOLDS = ('continuous', 'zoh')
LIFT = 'case1_lauv'  # a vehicle with a lift matrix has kernels of its own


class Called(NamedTuple):
    """How the tests call a law: in which scenario, and in which batches."""

    scenario: str
    batches: Sequence[tuple[str, str]] = ()
    tuned: Sequence[str] = ()  # by their holds
    with_lift: str = ''


LAWS = {
    'gvc': Called('case1', [(path, hold) for path in (SHARED, OWN) for hold in HOLDS], HOLDS, LIFT),
    'cl': Called('case1', [(SHARED, HOLDS[0]), (OWN, HOLDS[0])], HOLDS[:1], LIFT),
    'pid': Called('faults_bluerov2_heavy'),
    'smc': Called('faults_bluerov2_heavy'),
}
OPEN_LOOP = 'open_loop'  # of a vehicle without lift, and of one with it
TOGETHER = (('gvc', OPEN_LOOP), ('cl', 'pid', 'smc'))


def compile_law(law: str) -> None:
    """What nodes, simulations, batches of them and the figures of a run call."""
    import numpy as np

    from auv_analysis import load_scenario, simulate, summarize
    from auv_analysis.simulation.rollouts import rollouts
    from auv_analysis.simulation.simulate import warm_up
    from auv_analysis.studies.tune.cost import measured

    def shortened(name: str) -> Any:
        """A shipped scenario of a few steps, without what acts on samples alone."""
        scenario = load_scenario(name)
        data = {**scenario.data, 'vehicle': str(scenario.vehicle_path)}
        for key in ('faults', 'actuators', 'sensors'):
            data.pop(key, None)
        path = Path(folder) / f'{name}.yaml'
        path.write_text(yaml.safe_dump({**data, 'duration': STEPS * scenario.step}))
        return load_scenario(path)

    called = LAWS[law]
    with tempfile.TemporaryDirectory() as folder:
        warm_up(load_scenario(called.scenario), [law])
        scenario = shortened(called.scenario)
        summarize(simulate(scenario, law, 'zoh'))
        simulate(scenario, law, 'continuous')
        for path, hold in called.batches:
            rollouts(scenario, law, {path.format(law): [0.1, 0.2]}, hold=hold)
        for hold in HOLDS if called.with_lift else ():
            simulate(shortened(called.with_lift), law, hold)
        for hold in called.tuned:
            measured(scenario, law, {'k_D': np.array([0.1, 0.2])}, hold, 1)


def compile_open_loop() -> None:
    """The plant alone, which knows no law, and what is measured of it less what is simulated."""
    import numpy as np

    from auv_analysis import open_loop
    from auv_analysis.studies.identify.residuals import fill_residuals
    from auv_dynamics import load_vehicle
    from auv_dynamics.plant.plant import initial_state

    start = initial_state(np.zeros((1, 1, 6)), np.zeros((1, 1, 6)))
    for vehicle in ('rexrov', 'lauv'):
        states = open_loop(load_vehicle(vehicle), np.zeros((1, 1, 6)), start, 0.01)
    one, e = np.ones(1), np.zeros((1, 1, 9))
    fill_residuals(start[..., 3:], states, 0, one, e[0, :, :6], e[0, :, :4], np.ones(9), e)


def main() -> None:
    """Compile for the laws that are named, or for all in processes of their own."""
    for name in sys.argv[1:]:
        compile_open_loop() if name == OPEN_LOOP else compile_law(name)
    done = cache_folder() / f'tests.{hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:16]}'
    if not sys.argv[1:] and JITTED and not done.exists():
        print('compiling the kernels that the tests call ...', flush=True)
        started = [subprocess.Popen([sys.executable, __file__, *laws]) for laws in TOGETHER]
        if max(abs(process.wait()) for process in started):  # negative: by a signal
            sys.exit('the kernels do not compile')
        done.touch()


if __name__ == '__main__':
    main()
