"""Scenarios, simulation, experiments on the node graph, bags, energy and coupling analysis."""

from auv_analysis.scenario import load_scenario
from auv_analysis.simulate import simulate
from auv_analysis.summary import summarize

__all__ = ['load_scenario', 'simulate', 'summarize']
