"""Runs of several controllers, one after the other: which failure counts, and what goes on."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from auv_analysis.graph import recorded_runs
from auv_analysis.graph.node_parameters import parameter_file
from auv_analysis.graph.recorded_runs import FreeGraph, recorded
from auv_analysis.graph.supervisor import NodeDiedError, TroubleError
from auv_analysis.output.folder import ResultsFolder
from auv_dynamics.files.errors import FailedError
from auv_dynamics.files.yaml_files import read_yaml

FIRST, SECOND, DEAD = TroubleError('first'), TroubleError('second'), NodeDiedError('dead')


@pytest.mark.parametrize(
    ('fails', 'run', 'done', 'failure'),
    [
        ({}, 'abc', 'abc', None),
        ({'a': FIRST, 'b': SECOND}, 'abc', 'abc', FIRST),
        ({'a': FIRST, 'b': DEAD}, 'ab', 'a', DEAD),
    ],
)
def test_after_trouble_the_others_run_and_after_a_death_none(
    fails: dict[str, FailedError], run: str, done: str, failure: Any, tmp_path: Path, monkeypatch
) -> None:
    out_of_ascii = tmp_path / f"Prüfung, d'été{20 * ' 2026'}"  # YAML escapes and folds it
    results = ResultsFolder(out_of_ascii / 'unfinished', out_of_ascii)
    asked = []

    def run_controller(_: object, name: str, out: Path, domain: int, *__: object, composed: bool):
        asked.append((name, domain, composed))
        (out / name).mkdir(parents=True)
        text = parameter_file({'recorder_node': {'bag': f'{out}/{name}'}}, 'made')
        (out / name / 'params.yaml').write_text(text)
        if name in fails:
            raise fails[name]

    monkeypatch.setattr(recorded_runs, 'run_controller', run_controller)
    monkeypatch.setattr(recorded_runs, 'open_bag', lambda bag: SimpleNamespace(run=bag.name))
    scenario: Any = SimpleNamespace(name='s', steps=3)
    graph = FreeGraph(7, None, lambda: None)
    found, error = recorded(scenario, [*'abc'], results, graph, composed=True)
    assert asked == [(name, 7, True) for name in run]
    assert found == {name: name for name in done}
    assert error is failure
    place = results.folder if fails else results.out
    for name in done:
        data = read_yaml(results.folder / name / 'params.yaml', 'parameter')
        told = data['/**/recorder_node']['ros__parameters']['bag']
        assert told == f'{place}/{name}', 'where it lies in the end'
