"""Scenarios, simulation, experiments on the node graph, bags, energy and coupling analysis.

- `load_scenario(path or name)`: a scenario, checked with its vehicle, gains and set-point
- `simulate(scenario, controller)`: a `Run` by the kernel that the nodes use
- `load_run(bag)`, `open_bag(bag)`: the same `Run` of a recorded bag; with its attachments
- `Run`: the samples of a closed loop, as arrays or, by `to_pandas()`, as a data frame
- `summarize(run)`: its figures as plain data, as in summary.json
- `open_loop(model, commands, start, step)`: the plant alone under recorded commands, many variants
- `linearize(vehicle or scenario)`: the linear model of a vehicle or of a closed loop

Many runs at once: `auv_analysis.simulation.rollouts`. On the command line: `auv --help`.
"""

from typing import TYPE_CHECKING

from auv_dynamics.files.lazy import lazy_names

if TYPE_CHECKING:
    from auv_analysis.bag.load import load_run, open_bag
    from auv_analysis.metrics.summary import summarize
    from auv_analysis.runs.run import Run
    from auv_analysis.scenario.scenario import load_scenario
    from auv_analysis.simulation.open_loop import open_loop
    from auv_analysis.simulation.simulate import simulate
    from auv_analysis.studies.linearize.linearize import linearize

_HOME = {
    'linearize': 'auv_analysis.studies.linearize.linearize',
    'load_run': 'auv_analysis.bag.load',
    'open_bag': 'auv_analysis.bag.load',
    'Run': 'auv_analysis.runs.run',
    'load_scenario': 'auv_analysis.scenario.scenario',
    'open_loop': 'auv_analysis.simulation.open_loop',
    'simulate': 'auv_analysis.simulation.simulate',
    'summarize': 'auv_analysis.metrics.summary',
}
__all__ = [
    'Run',
    'linearize',
    'load_run',
    'load_scenario',
    'open_bag',
    'open_loop',
    'simulate',
    'summarize',
]
__getattr__, __dir__ = lazy_names(__name__, _HOME)
