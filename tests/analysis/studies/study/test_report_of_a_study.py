"""`auv study`: every number of the report is found in the files beside it."""

import json
import re
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest
from helpers.report_pages import Page, at, check_numbers, tokens

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.cli import main
from auv_analysis.herman2018.cases import case_of
from auv_analysis.report.document import NUMBERS
from auv_analysis.studies.study.sensitivity import sensitivity
from auv_dynamics.files.shipped import shipped
from auv_dynamics.vehicle import DOFS

NO_NUMBER = re.compile(r'[ξπτΔ]+_?[1-6]|M46|equation \(\d+\)|\(39\)|m/s2|1/s2')


@pytest.fixture(scope='module')
def folder(tmp_path_factory, composing) -> Path:
    out = tmp_path_factory.mktemp('study') / 'case1'
    with composing():
        main.main(['study', 'case1', '--samples', '4', '--window', '0', '10.28', '--out', str(out)])
    return out


@pytest.fixture(scope='module')
def rows(folder) -> list[dict]:
    return parquet.read_table(folder / NUMBERS).to_pylist()


def test_all_that_it_shows(folder, approved):
    approved.folder(folder)


def test_every_number_of_every_table_is_found_where_its_source_says(folder, rows):
    assert check_numbers(folder) > 100
    summary = json.loads((folder / 'summary.json').read_text(encoding='utf-8'))
    columns: dict[tuple[str, str], set] = {}
    for row in rows:
        source, _, factor = row['source'].partition('*')
        file, _, place = source.partition(':')
        wanted = row['value'] / float(factor or 1.0)
        if file == 'summary.json':
            assert at(summary, place) == pytest.approx(wanted, rel=1e-14), row
        elif file.endswith('.parquet'):
            key = file, place.partition('[')[0]
            if key not in columns:
                values = parquet.read_table(folder / file, columns=[key[1]]).column(0).to_pylist()
                columns[key] = {float(value) for value in values if value is not None}
            assert any(abs(x - wanted) <= 1e-14 * abs(wanted) for x in columns[key]), row
        else:  # the number of a claim is that of its row
            assert row['table'] in ('claims', 'deviations'), row


def test_every_cell_with_a_number_is_kept_and_is_what_it_shows(folder, rows):
    page = Page((folder / 'report.html').read_text(encoding='utf-8'))
    shown = [float(v) for table in page.tables.values() for r in table for _, v in r if v]
    assert sorted(shown) == sorted(row['value'] for row in rows)
    cells: dict[tuple, list[float]] = {}
    for row in rows:
        cells.setdefault((row['table'], row['row'], row['column'], row['text']), []).append(
            row['value']
        )
    for place, values in cells.items():
        for value, half in tokens(NO_NUMBER.sub('', place[-1])):
            near = half + 1e-12 * abs(value)
            assert any(min(abs(value - x), abs(value + x)) <= near for x in values), (place, value)


def test_the_summary_is_that_of_a_fresh_run(folder):
    summary = json.loads((folder / 'summary.json').read_text(encoding='utf-8'))
    scenario = load_scenario(folder / 'scenario.yaml')
    for name in scenario.controllers:
        fresh = summarize(simulate(scenario, name), windows=[(0.0, 10.28)])
        assert summary[name] == json.loads(json.dumps(fresh))


def test_the_report_takes_the_steps_of_the_procedure(folder):
    page = Page((folder / 'report.html').read_text(encoding='utf-8'))
    steps = ['gains', 'tracking', 'sensitivity', 'energy', 'couplings', 'discussion', 'claims',
             'quantities']  # fmt: skip
    assert [name for name in page.ids if name in steps] == steps
    assert set(page.links) <= set(page.ids)
    verdicts = [row[1][0].strip() for row in page.tables['claims']]
    assert len(verdicts) == 21
    assert set(verdicts) <= {'reproduced', 'partly', 'not reproduced'}
    windows = {row['value'] for row in parquet.read_table(folder / NUMBERS).to_pylist()
               if row['table'] == 'energy' and row['column'] == 'to'}  # fmt: skip
    assert windows == {10.0, 10.28, 30.0}


def test_pieces_and_shares_of_the_files_add_up(folder):
    summary = json.loads((folder / 'summary.json').read_text(encoding='utf-8'))
    for entry in summary.values():
        assert sum(entry['kinetic_energy']['shares_percent']) == pytest.approx(100.0, rel=1e-12)
        for terms in entry['coupling_terms'].values():
            for dof in {term['to'] for term in terms}:
                shares = [term['share_percent'] for term in terms if term['to'] == dof]
                assert sum(shares) == pytest.approx(100.0, rel=1e-9)
    samples = parquet.read_table(folder / 'gvc.parquet').to_pandas()
    energies = samples.filter(regex=r'^kinetic_energy\.')
    by_component = summary['gvc']['kinetic_energy']['mean_by_component']
    np.testing.assert_allclose(energies.mean(axis=0), by_component, rtol=1e-12)


@pytest.mark.parametrize(
    ('options', 'line'),
    [
        (
            ['--window', '5', '3'],
            '--window: expected two times, FROM < TO, from 0 to 30 s, found 5 3',
        ),
        (['--window', '0', '31'], '--window: expected two times'),
        (['--span', '1'], '--span: expected a number above 1'),
        (['--samples', '6'], '--samples: expected a power of two from 2 on, found 6'),
        (['--seed', '-1'], '--seed: expected a whole number from 0 on, found -1'),
        (['--controller', 'x'], 'expected one of gvc, cl'),
        (
            ['--sensitivity', 'none', '--seed', '0'],
            '--seed: expected sobol or morris, found --sensitivity none',
        ),
    ],
)
def test_wrong_options_end_in_one_line(tmp_path, capsys, options, line):
    with pytest.raises(SystemExit) as end:
        main.main(['study', 'case1', *options, '--out', str(tmp_path / 'out')])
    assert end.value.code == 2
    error = capsys.readouterr().err
    assert line in error
    assert error.count('\n') == 1
    assert not (tmp_path / 'out').exists()


@pytest.mark.usefixtures('undrawn')
def test_a_study_of_another_vehicle_has_no_claims(tmp_path):
    out = tmp_path / 'out'
    main.main(['study', 'case1_bluerov2_heavy', '--sensitivity', 'none', '--out', str(out)])
    page = Page((out / 'report.html').read_text(encoding='utf-8'))
    assert 'claims' not in page.tables
    assert 'sensitivity' not in page.ids
    assert 'discussion' in page.ids


@pytest.mark.usefixtures('undrawn')
def test_all_of_a_study_is_held_and_varied_as_it_is_asked_to(tmp_path):
    path, out = tmp_path / 'case1.yaml', tmp_path / 'out'
    text = shipped('scenarios', 'case1').read_text(encoding='utf-8')
    path.write_text(text.replace('duration: 30.0', 'duration: 2.5'))
    asked = ['--hold', 'zoh', '--samples', '2', '--span', '1.5', '--seed', '3']
    main.main(['study', str(path), *asked, '--out', str(out)])
    summary = json.loads((out / 'summary.json').read_text(encoding='utf-8'))
    varied = parquet.read_table(out / 'sensitivity.parquet').to_pylist()
    errors = [row for row in varied if row['figure'] == 'velocity_error.rms']
    assert {row['controller'] for row in errors} == {'gvc', 'cl'}
    for row in errors:
        rms = summary[row['controller']]['velocity_error']['rms'][DOFS.index(row['dof'])]
        assert row['value'] == pytest.approx(rms, rel=1e-9)
    known = sensitivity(load_scenario(path), 'gvc', count=2, span=1.5, seed=3, hold='zoh').rows
    largest = {row['dof']: row['largest'] for row in known if row['figure'] == 'velocity_error.rms'}
    assert largest == {r['dof']: r['largest'] for r in errors if r['controller'] == 'gvc'}
    claims = parquet.read_table(out / 'claims.parquet').to_pylist()
    (start,) = (row['value'] for row in claims
                if (row['number'], row['name']) == (20, 'peak of τ_X, cl'))  # fmt: skip
    other = case_of(load_scenario(path), 'case2')
    assert start == np.abs(simulate(other, 'cl', 'zoh').tau[:201, 0]).max()
