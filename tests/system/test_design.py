"""`auv design` as a user runs it: its claim is what `auv simulate` gives for that vehicle."""

import json

import pytest
from helpers.node_processes import auv

from auv_analysis.cli import main
from auv_analysis.studies.design import search
from auv_dynamics.files.errors import FailedError

FILES = {
    'design.json', 'summary.json', 'summary_before.json', 'vehicle.yaml', 'vehicle_before.yaml',
    'scenario.yaml', 'report.html', 'numbers.parquet', 'figures',
    'manifest.json',
}  # fmt: skip


def designed(*arguments, folder):
    done = auv(*arguments, cwd=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.long
def test_the_claim_is_what_a_simulation_of_the_changed_vehicle_gives(tmp_path):
    document = json.loads(designed('design', 'rexrov', '--json', folder=tmp_path))
    out = tmp_path / 'runs' / 'design_rexrov'
    assert {path.name for path in out.iterdir()} == FILES
    assert json.loads((out / 'design.json').read_text()) == document
    rows = {row['name']: row for row in document['measures']}
    target = rows[document['reduce'].replace('.', '_max.')]
    assert target['after'] <= 0.5 * target['before']
    assert {one['coupling'] for one in document['alternatives']} >= {'delta_xi.surge'}

    scenario = str(out / 'scenario.yaml')
    summaries = json.loads(
        designed('simulate', scenario, '--json', '--no-report', '--out', 'after', folder=tmp_path)
    )
    assert summaries == json.loads((out / 'summary.json').read_text())
    for i, dof in enumerate(('surge', 'sway', 'heave', 'roll', 'pitch', 'yaw')):
        for name in ('delta_xi_max', 'delta_pi_max'):
            row = rows.get(f'{name}.{dof}')
            if row is not None:
                assert row['after'] == summaries['gvc']['coupling'][name][i]
        assert rows[f'effort.rms.{dof}']['after'] == summaries['gvc']['effort']['rms'][i]
    assert rows['kinetic_energy.mean']['after'] == summaries['gvc']['kinetic_energy']['mean']


@pytest.mark.parametrize('options', [[], ['--json'], ['--reduce', 'delta_xi.surge']])
def test_a_vehicle_without_couplings_is_told_so(options, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    main.main(['design', 'lauv', *options])
    text = capsys.readouterr().out
    assert 'M is diagonal' in text
    if '--json' in options:
        assert json.loads(text)['measures'] == []


def test_the_coupling_that_is_asked_for_is_reduced(tmp_path, monkeypatch):
    asked = []

    def propose(setting, target, _shown):
        first = setting.space.parameters[0]
        asked.append((target, first.name, first.lower, first.upper))
        raise FailedError('enough')

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(search, 'propose', propose)
    with pytest.raises(SystemExit):
        main.main(
            ['design', 'rexrov', '--reduce', 'delta_pi.pitch', '--bound', 'shift.x=-0.02:0.05']
        )
    assert asked == [('delta_pi.pitch', 'shift.x', -0.02, 0.05)]
