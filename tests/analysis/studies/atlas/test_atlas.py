"""The atlas of several vehicles: its files, its report and who it names."""

import json
from html import unescape
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.report_pages import check_numbers
from pyarrow import parquet

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.cli import main
from auv_analysis.studies.atlas import atlas
from auv_analysis.studies.atlas.atlas import charts, results_of
from auv_analysis.studies.atlas.plots import coupled, uncoupled
from auv_dynamics.files.errors import FailedError
from auv_dynamics.files.shipped import shipped, shipped_names
from auv_dynamics.vehicle import DOFS


@pytest.fixture(scope='module')
def found():
    return charts(['bluerov2_heavy', 'herman2018_neutral', 'rexrov', 'herman2018'])


def test_the_strongest_come_first_and_equal_inertias_share_a_panel(found) -> None:
    assert [c.name for c in found] == ['herman2018', 'herman2018_neutral', 'rexrov',
                                       'bluerov2_heavy']  # fmt: skip
    assert [name for name, _ in coupled(found)] == ['herman2018, herman2018_neutral', 'rexrov']
    assert uncoupled(found) == (
        ' bluerov2_heavy has a diagonal M: Upsilon = I, nothing is coupled by inertia.'
    )


def test_a_vehicle_that_diverges_says_why_it_has_no_peaks(monkeypatch) -> None:
    def diverges(*_: object) -> None:
        raise ArithmeticError('gvc diverges at 0.1 s')

    monkeypatch.setattr(atlas, 'simulate', diverges)
    reason = {'failure': 'gvc diverges at 0.1 s', 'scenario': 'case1_rexrov'}
    (chart,) = charts(['rexrov'])
    assert chart.reached == reason
    rows = results_of([chart]).tables['atlas'].records()
    assert [row[key] for row in rows for key in row if key.startswith('case1_')] == [None] * 3 * 36


def test_peaks_are_those_of_the_scaled_scenario(found) -> None:
    summary = summarize(simulate(load_scenario('case1_rexrov'), 'gvc'))
    reached = next(c for c in found if c.name == 'rexrov').reached
    assert reached['delta_xi_max'] == summary['coupling']['delta_xi_max']
    assert reached['delta_pi_max'] == summary['coupling']['delta_pi_max']
    N = summary['decomposition']['N'][0]
    energy = 50 * N * reached['delta_xi_max'][0] ** 2 / summary['kinetic_energy']['mean']
    assert reached['delta_xi_energy_percent'][0] == pytest.approx(energy)


def test_a_document_has_no_nan(found) -> None:
    whole = json.loads(json.dumps(results_of(found).to_json(), allow_nan=False))
    assert list(whole['vehicles']) == [c.name for c in found]
    assert whole['vehicles']['bluerov2_heavy']['diagonal'] is True


@pytest.mark.usefixtures('unrendered')
def test_command_writes_table_and_report(tmp_path: Path, capsys, approved) -> None:
    data = yaml.safe_load(shipped('vehicles', 'rexrov').read_text(encoding='utf-8'))
    mine = tmp_path / 'mine.yaml'
    mine.write_text(yaml.safe_dump(data))  # its name is that of the shipped one
    out = tmp_path / 'out'
    main.main(['atlas', 'rexrov', str(mine), 'lauv', '--only', '--out', str(out), '--json'])
    whole = json.loads(capsys.readouterr().out)
    assert whole == json.loads((out / 'atlas.json').read_text())
    assert set(whole['vehicles']) == {'rexrov', 'rexrov_2', 'lauv'}
    approved.folder(out)
    table = parquet.read_table(out / 'atlas.parquet').to_pylist()
    assert len(table) == 3 * 36
    row = next(r for r in table if (r['vehicle'], r['in'], r['of']) == ('rexrov', 'sway', 'roll'))
    entry = whole['vehicles']['rexrov']
    assert row['correlation'] == entry['correlation'][1][3]
    assert row['Upsilon_inv'] == entry['Upsilon_inv'][1][3]
    report = unescape((out / 'report.html').read_text(encoding='utf-8'))
    assert 'lauv has a diagonal M: Upsilon = I, nothing is coupled by inertia.' in report
    assert 'sway–yaw, heave–pitch' in report, 'what damping couples'


@pytest.mark.usefixtures('undrawn')
def test_every_number_of_the_report_is_in_the_document(tmp_path: Path) -> None:
    main.main(['atlas', 'herman2018', '--only', '--out', str(tmp_path / 'out')])
    assert check_numbers(tmp_path / 'out') > 20


@pytest.mark.usefixtures('unrendered')
def test_vehicles_without_coupling_alone_are_said_not_drawn(tmp_path: Path, capsys) -> None:
    main.main(['atlas', 'lauv', '--only', '--out', str(tmp_path / 'out')])
    assert 'nothing is coupled by inertia' in capsys.readouterr().err
    assert list((tmp_path / 'out' / 'figures').iterdir()) == []


def test_all_shipped_vehicles_are_taken() -> None:
    assert len(shipped_names('vehicles')) >= 8
    assert len(DOFS) == np.array(results_of(charts(['lauv'])).facts['vehicles']['lauv']['N']).size


def test_an_unknown_vehicle_is_refused_in_one_line(tmp_path: Path, capsys) -> None:
    with pytest.raises(SystemExit) as end:
        main.main(['atlas', 'nautilus', '--out', str(tmp_path / 'out')])
    lines = capsys.readouterr().err.splitlines()
    assert end.value.code == 2
    assert len(lines) == 1
    assert 'nautilus' in lines[0]
    assert not (tmp_path / 'out').exists()


def test_a_vehicle_is_shown_beside_all_that_are_shipped(tmp_path: Path, monkeypatch) -> None:
    mine = tmp_path / 'mine.yaml'
    mine.write_text(shipped('vehicles', 'rexrov').read_text())
    asked = []

    def asks(vehicles: list[str]) -> None:
        asked.extend(vehicles)
        raise FailedError('enough')

    monkeypatch.setattr(atlas, 'charts', asks)
    with pytest.raises(SystemExit):
        main.main(['atlas', 'rexrov', str(mine), str(mine), '--out', str(tmp_path / 'out')])
    assert asked == [*shipped_names('vehicles'), str(mine)]
