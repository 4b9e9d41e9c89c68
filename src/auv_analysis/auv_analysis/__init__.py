"""Scenarios, simulation, experiments on the node graph, bags, energy and coupling analysis."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from auv_analysis.bag import load_run, open_bag
    from auv_analysis.linearization.loop import linearize
    from auv_analysis.scenario import load_scenario
    from auv_analysis.simulation import simulate
    from auv_analysis.summary import summarize

_HOME = {
    'linearize': 'auv_analysis.linearization.loop',
    'load_run': 'auv_analysis.bag',
    'open_bag': 'auv_analysis.bag',
    'load_scenario': 'auv_analysis.scenario',
    'simulate': 'auv_analysis.simulation',
    'summarize': 'auv_analysis.summary',
}
__all__ = ['linearize', 'load_run', 'load_scenario', 'open_bag', 'simulate', 'summarize']


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for: `auv --help` must not load numba."""
    if name in _HOME:
        return getattr(importlib.import_module(_HOME[name]), name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
