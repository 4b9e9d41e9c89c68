"""Runs of several controllers, one after the other: which failure counts, and what goes on."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from auv_analysis.graph import recorded_runs
from auv_analysis.graph.recorded_runs import FreeGraph, recorded
from auv_analysis.graph.supervisor import NodeDiedError, TroubleError
from auv_analysis.output.folder import ResultsFolder
from auv_dynamics.files.errors import FailedError

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
    results = ResultsFolder(tmp_path / 'unfinished', tmp_path)
    asked = []

    def run_controller(_: object, name: str, out: Path, domain: int, *__: object, composed: bool):
        asked.append((name, domain, composed))
        (out / name).mkdir(parents=True)
        (out / name / 'params.yaml').write_text(f'bag: {out}/{name}')
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
    place = tmp_path / 'unfinished' if fails else tmp_path
    for name in done:
        text = (results.folder / name / 'params.yaml').read_text()
        assert text == f'bag: {place}/{name}', 'where it lies in the end'
