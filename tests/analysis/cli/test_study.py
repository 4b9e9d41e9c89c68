"""`auv study`: what it refuses before it works."""

from argparse import Namespace
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

from auv_analysis.cli import main, study
from auv_analysis.graph import domain, recorded_runs
from auv_analysis.simulation import simulate
from auv_analysis.studies.study import sensitivity
from auv_dynamics.files.errors import FailedError, InputError

GAINS = {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}
SCENARIO = {'name': 's', 'vehicle': 'herman2018', 'duration': 1.0, 'step': 0.01, 'setpoint': {}}


@pytest.mark.parametrize('name', ['numbers', 'sensitivity', 'claims'])
def test_samples_never_take_the_place_of_a_table(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    scenario = tmp_path / 's.yaml'
    controllers = {'gvc': {'law': 'gvc', **GAINS}, name: {'law': 'cl', **GAINS}}
    scenario.write_text(yaml.safe_dump(SCENARIO | {'controllers': controllers}))
    with pytest.raises(SystemExit) as end:
        main.main(['study', str(scenario), '--out', str(tmp_path / 'out')])
    errors = capsys.readouterr().err
    assert (end.value.code, errors.count('\n'), (tmp_path / 'out').exists()) == (2, 1, False)
    assert f'expected names that are not those of our own files, found {name}' in errors


def test_a_study_on_the_nodes_is_one(tmp_path: Path, monkeypatch, capsys) -> None:
    asked = []

    def recorded(*given: object, composed: bool) -> tuple[dict, FailedError]:
        asked.append((given[3], composed))
        return {}, FailedError('enough')

    monkeypatch.setattr(domain, 'own_domain', lambda number: nullcontext((number, False)))
    monkeypatch.setattr(recorded_runs, 'free_graph', lambda *given: nullcontext(given[:2]))
    monkeypatch.setattr(recorded_runs, 'recorded', recorded)
    monkeypatch.setattr(simulate, 'check_hold', lambda _, hold: asked.append(hold))
    options = '--run', '--composed', '--domain-id', '7', '--out', str(tmp_path / 'out')
    with pytest.raises(SystemExit) as end:
        main.main(['study', 'case1', *options])
    assert (end.value.code, 'enough' in capsys.readouterr().err) == (1, True)
    assert asked == ['zoh', ((7, False), True)]


def test_a_window_lies_in_the_run_and_has_a_length() -> None:
    made = SimpleNamespace(duration=0.3, step=0.1)
    for whole in ((0.0, 0.3), (0.0, 0.1 + 0.2)):
        assert study._window(made, *whole) == whole
    for wrong in ((-0.1, 0.3), (0.0, 0.4), (0.2, 0.2), (0.2, 0.1)):
        with pytest.raises(InputError, match='--window: expected two times'):
            study._window(made, *wrong)


def test_why_there_is_no_sensitivity_is_said(monkeypatch, capsys) -> None:
    refused = SimpleNamespace(refusal='the law has no gains')
    monkeypatch.setattr(sensitivity, 'sensitivity', lambda *_, **__: refused)
    options = Namespace(sensitivity=None, samples=None, span=2.0, seed=0, hold='zoh')
    study._sensitivities(options, SimpleNamespace(name='s'), {'mine': None})
    said = 'note: mine: no sensitivity to the gains: the law has no gains'
    assert said in capsys.readouterr().err.splitlines()
