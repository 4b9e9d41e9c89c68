"""A run that stands still: ended where it waits for what does not come, not where it is paused."""

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest
import yaml

from auv_analysis import load_scenario
from auv_analysis.bag.metadata import METADATA, as_text
from auv_analysis.graph import experiment
from auv_analysis.graph.experiment import PACKAGES, SILENCE, SPIN, run_controller
from auv_analysis.graph.supervisor import NodeDiedError

WHILE = round(0.9 * SILENCE / SPIN)  # looks at a run that are not yet too many
ALL = set(PACKAGES)


class OverError(Exception):
    """The run was still waited for at the end of the test."""


class Graph(SimpleNamespace):
    """What is seen of a graph whose nodes do what a function of the number of the look says."""

    waits_for = ''

    def ask_to_run(self) -> bool:
        return not self.waits_for

    def spin(self, _: float) -> None:
        self.looks += 1
        if self.looks > 5 * WHILE:
            raise OverError
        self.does(self)


def stalls(graph: Graph, silent: str) -> None:
    if graph.looks == WHILE:
        graph.complete_ns = 5 * 10_000_000
    graph.alive |= ALL - ({silent} if graph.looks > WHILE + 10 else set())


def watch(does: Callable[[Graph], None], folder: Path, **seen: str) -> None:
    graph = Graph(looks=0, does=does, alive=set(), **seen)

    def begin(_: list[str], **options: object) -> psutil.Popen:
        return psutil.Popen(['sleep', '600'], **options)

    run_controller(load_scenario('case1'), 'gvc', folder, 0, graph, begin, lambda _: None)


@pytest.mark.parametrize('silent', ['plant_node', 'recorder_node'])
def test_a_node_that_hangs_ends_a_run_and_is_named(silent: str, tmp_path: Path) -> None:
    expected = f'no step after 5 for 60 s, and no sign of life of {silent}$'
    with pytest.raises(NodeDiedError, match=expected):
        watch(lambda graph: stalls(graph, silent), tmp_path)


@pytest.mark.parametrize('composed', [False, True])
def test_a_recorder_that_a_signal_ends_has_not_finished_the_run(
    composed: bool, tmp_path: Path
) -> None:
    graph = Graph(looks=0, does=lambda _: None, alive=set())
    told = {'topic_metadata': {'name': '/wrench'}, 'message_count': 8}
    text = as_text({'topics_with_message_count': [told]})

    def begin(command: list[str], **options: object) -> psutil.Popen:
        (tmp_path / 'gvc' / METADATA).write_text(text)
        if Path(command[0]).name not in ('recorder_node', 'composed_graph'):
            return psutil.Popen(['sleep', '600'], **options)
        ended = psutil.Popen(['true'], **options)
        ended.wait()
        return ended

    steps: list[int] = []
    given = load_scenario('case1'), 'gvc', tmp_path, 0, graph, begin, steps.append
    with pytest.raises(NodeDiedError, match='ended at step 7 of 3000'):
        run_controller(*given, composed=composed)
    assert steps == [7]
    told = yaml.safe_load((tmp_path / 'gvc' / 'params.yaml').read_text())
    assert told['/**/plant_node']['ros__parameters']['start_paused'], 'until all are there'


def test_a_run_that_is_paused_goes_on(tmp_path: Path) -> None:
    with pytest.raises(OverError):
        watch(lambda graph: stalls(graph, ''), tmp_path)


def test_a_graph_that_does_not_start_is_given_up(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(experiment, 'START_TIMEOUT', 0.0)
    with pytest.raises(NodeDiedError, match='no start within 0 s: waiting for the analysis_node'):
        watch(lambda graph: None, tmp_path, waits_for='the analysis_node')


def test_a_recorder_that_does_not_close_its_bag_is_given_up(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(experiment, 'END_TIMEOUT', 0.0)

    def ends(graph: Graph) -> None:
        graph.alive |= ALL
        graph.complete_ns = load_scenario('case1').steps * 10_000_000

    with pytest.raises(NodeDiedError, match='recorder_node does not close the bag'):
        watch(ends, tmp_path)
