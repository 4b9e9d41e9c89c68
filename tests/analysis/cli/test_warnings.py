"""What is odd but usable is said by every command that takes a scenario, before it works."""

from pathlib import Path

import pytest
from helpers.tunings import GVC, write

from auv_analysis.cli import main, scenario_runs
from auv_analysis.simulation import simulate
from auv_dynamics.files.errors import FailedError

CAMPAIGN = 'name: small\nscenario: s.yaml\nvary: [{grid: {controllers.gvc.k_D: [6.0]}}]\n'


@pytest.mark.parametrize(
    'command', ['simulate s.yaml', 'study s.yaml', 'sweep c.yaml', 'tune s.yaml',
                'design rexrov --scenario s.yaml'],
)  # fmt: skip
def test_an_odd_scenario_is_warned_of(command: str, tmp_path: Path, monkeypatch, capsys) -> None:
    def enough(*_: object) -> None:
        raise FailedError('enough')

    monkeypatch.chdir(tmp_path)
    write(tmp_path, {'gvc': GVC}, initial={'eta': [0.0, 0.0, 0.0, 45.0, 0.0, 0.0]})
    (tmp_path / 'c.yaml').write_text(CAMPAIGN)
    for module in (simulate, scenario_runs):  # what comes next of each
        monkeypatch.setattr(module, 'announce', enough)
    with pytest.raises(SystemExit):
        main.main(command.split())
    *said, last = capsys.readouterr().err.splitlines()
    assert any(line.startswith('warning: ') and line.endswith('degrees?') for line in said)
    assert last == 'enough'
