"""Sweeps with words, lists and failures, broken and unfinished ones, and their reports."""

import json
import shutil
from pathlib import Path
from types import SimpleNamespace as Made

import numpy as np
import pytest
from helpers.made_sweeps import (
    DAMPING,
    ENERGY,
    K_D,
    MIXED,
    MORRIS,
    SALTELLI,
    SIMPLE,
    change_manifest,
    make_sweep,
    mixed,
    rows,
    simple,
)
from helpers.report_pages import check_numbers
from pyarrow import parquet

from auv_analysis.cli import main as cli
from auv_analysis.studies.sweep.analysis import Analysis, analysed, merged, results_of
from auv_analysis.studies.sweep.dataset import factors_of, open_sweep
from auv_analysis.studies.sweep.plots import draw
from auv_dynamics.files.errors import InputError


@pytest.fixture(scope='module')
def two(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep of which two parts are there."""
    return make_sweep(tmp_path_factory.mktemp('two'), SIMPLE, simple, range(2))


def test_words_lists_and_failures(tmp_path: Path) -> None:
    results = analysed(open_sweep(make_sweep(tmp_path, MIXED, mixed)))
    assert {v.path: list(v.labels) for v in results.factors} == {
        'vehicle': ['herman2018', 'rexrov'],
        'controllers.gvc.k_D': ['[1.0, 1.0, 1.0, 1.0, 1.0, 1.0]', '[2.0, 2.0, 2.0, 2.0, 2.0, 2.0]'],
        'vehicle.rigid_body.mass': ['−1', '250', '300'],
    }
    assert results.counts() == [
        {'controller': 'gvc', 'rows': 12, 'ok': 8, 'diverged': 0, 'refused': 4},
        {'controller': 'cl', 'rows': 12, 'ok': 4, 'diverged': 4, 'refused': 4},
    ]
    assert results.reasons()[0] == {'status': 'refused', 'reason': 'too light', 'rows': 8}
    (light,) = rows(
        results, 'failures', controller='cl', path='vehicle.rigid_body.mass', value='−1'
    )
    assert (light['refused_percent'], light['diverged_percent']) == (100.0, 0.0)
    (rexrov,) = rows(results, 'failures', controller='cl', path='vehicle', value='rexrov')
    assert (rexrov['diverged'], rexrov['rows']) == (4, 6)
    (row,) = rows(results, 'influence', controller='gvc', figure=ENERGY, path='controllers.gvc.k_D')
    assert row['explained_percent'] == pytest.approx(100.0)


def test_a_sweep_that_is_not_finished_is_analysed(tmp_path: Path) -> None:
    sweep = open_sweep(make_sweep(tmp_path, SIMPLE, simple, range(0, 4, 3)))
    assert (sweep.rows, sweep.planned) == (800, 1600)
    results = analysed(sweep)
    assert results.counts()[0]['rows'] == 400
    (row,) = rows(results, 'paired', figure=ENERGY)
    assert row['rollouts'] == 400


def test_bins_are_joined_where_they_are_many(results: Analysis) -> None:
    varied = next(v for v in factors_of(results.sweep) if v.path == K_D)
    codes, labels = merged(varied)
    assert len(varied.labels) > 10 >= len(labels)
    assert labels[0].split('–')[0] == varied.labels[0].split('–')[0]
    assert labels[-1].split('–')[1] == varied.labels[-1].split('–')[1]
    assert codes.max() == len(labels) - 1
    labels = [*(f'{k}–{k + 1}' for k in range(11)), '11']
    twelve = Made(binned=True, codes=np.arange(12), labels=labels)
    codes, labels = merged(twelve)
    assert codes.tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
    assert labels == ['0–2', '2–4', '4–6', '6–8', '8–10', '10–11']


@pytest.mark.parametrize(
    ('spoil', 'words'),
    [
        (lambda out: _part(out).write_bytes(b'PAR1'), 'part-00000001.parquet: expected a finished'),
        (lambda out: _damage(_part(out)), 'part-00000001.parquet: expected a finished part'),
        (lambda out: _without(_part(out), K_D), 'part-00000001.parquet: controllers.*: expected a '
                                                'column'),
        *((lambda out, name=name: _without(_part(out), name), f'{name}: expected a column of every')
          for name in ('index', 'controller', 'seed', 'status', 'reason')),
        (lambda out: _lost(_part(out)), "status: expected one of ok, diverged, .*, found .*'lost'"),
        (lambda out: change_manifest(out, rollouts='800'), 'expected campaign and rollouts'),
        (lambda out: _change_campaign(out, controllers=['gvc', '']), 'expected campaign and'),
        (lambda out: _change_campaign(out, vary=[]), 'expected campaign and rollouts'),
        (lambda out: _change_campaign(out, vary=[{'grids': {}}]), 'expected campaign and rollouts'),
        (lambda out: (out / 'sweep.json').write_text('{'), 'sweep.json: expected the manifest'),
        (lambda out: (out / 'sweep.json').write_text('[]'), 'expected campaign and rollouts'),
        (lambda out: change_manifest(out, campaign={}), 'expected campaign and rollouts'),
        (lambda out: [p.unlink() for p in (out / 'rollouts').iterdir()], 'no part-'),
        (lambda out: (out / 'rollouts').rename(out / 'gone'), 'expected the rows of a sweep'),
    ],
)  # fmt: skip
def test_a_broken_sweep_is_refused_in_one_line(two: Path, tmp_path, spoil, words: str) -> None:
    out = shutil.copytree(two, tmp_path / 'out')
    spoil(out)
    with pytest.raises(InputError, match=words) as refusal:
        analysed(open_sweep(out))
    assert '\n' not in str(refusal.value)


def test_a_part_that_has_changed_is_said(two: Path, tmp_path: Path) -> None:
    out = shutil.copytree(two, tmp_path / 'out')
    assert analysed(open_sweep(out)).notes == []
    parquet.write_table(parquet.read_table(_part(out)), _part(out))
    (note,) = analysed(open_sweep(out)).notes
    assert note.startswith(f'{_part(out)}: not as it was written')
    (out / 'manifest.json').unlink()
    assert analysed(open_sweep(out)).notes == [], 'nothing says how it was written'


def _part(out: Path) -> Path:
    return out / 'rollouts/part-00000001.parquet'


def _damage(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[4 : len(data) // 2] = bytes(len(data) // 2 - 4)
    path.write_bytes(data)


def _without(path: Path, column: str) -> None:
    parquet.write_table(parquet.read_table(path).drop_columns([column]), path)


def _lost(path: Path) -> None:
    table = parquet.read_table(path)
    words = ['lost', *table['status'].to_pylist()[1:]]
    place = table.column_names.index('status')
    parquet.write_table(table.set_column(place, 'status', [words]), path)


def _change_campaign(out: Path, **entries: object) -> None:
    campaign = json.loads((out / 'sweep.json').read_text())['campaign']
    change_manifest(out, campaign=campaign | entries)


def test_the_document_has_no_nan(results: Analysis) -> None:
    document = results_of(results).to_json()
    assert json.loads(json.dumps(document, allow_nan=False))['rows'] == 1600


SECOND_ORDER = f'{SALTELLI}    second_order: true\n'


def product(controller, values, index):
    power = 2 if controller == 'gvc' else 3
    both = values[K_D] * values[DAMPING] ** power
    return {ENERGY: both, 'effort.max.roll': both + values[K_D] ** power}


@pytest.mark.parametrize(
    ('campaign', 'known', 'plots'),
    [
        (SIMPLE, simple, 'unrendered'),
        (MIXED, mixed, 'undrawn'),  # as are those of test_sweep_plots
        (SECOND_ORDER, product, 'unrendered'),
        (MORRIS, product, 'undrawn'),
    ],
)
def test_every_number_of_the_report_is_in_a_file(
    tmp_path: Path, campaign, known, plots, approved, request
) -> None:
    request.getfixturevalue(plots)
    out = tmp_path / 'report'
    cli.main(['analyze', str(make_sweep(tmp_path, campaign, known)), '--out', str(out)])
    assert check_numbers(out) > 100
    approved.folder(out)


@pytest.mark.usefixtures('undrawn')
def test_an_unfinished_sweep_says_so(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    out = make_sweep(tmp_path, SIMPLE, simple, range(0, 4, 3))
    cli.main(['analyze', str(out)])
    assert 'note: not finished, 800 of 1600 rows are there' in capsys.readouterr().err
    report = (tmp_path / 'runs/analyze_simple/report.html').read_text(encoding='utf-8')
    assert 'The sweep is not finished: 800 of 1600 rows are there.' in report


@pytest.mark.usefixtures('undrawn')
def test_a_sweep_in_which_nothing_differs_has_a_report(tmp_path: Path, monkeypatch) -> None:
    """Such as of gains of one controller, all of whose rows failed."""
    monkeypatch.chdir(tmp_path)
    cli.main(['analyze', str(make_sweep(tmp_path, SIMPLE, lambda *_: {}))])
    assert (tmp_path / 'runs/analyze_simple/report.html').is_file()


def test_a_sweep_without_figures_is_a_failure(tmp_path: Path, capsys) -> None:
    def refused(controller, values, index):
        return {'status': np.full(len(index), 'refused', object)}

    out = make_sweep(tmp_path, SIMPLE, refused, range(1))
    with pytest.raises(SystemExit) as end:
        cli.main(['analyze', str(out), '--out', str(tmp_path / 'report')])
    assert end.value.code == 1
    assert capsys.readouterr().err.splitlines()[-1] == f'{out}: none of 400 rows has figures'
    assert not (tmp_path / 'report').exists()


@pytest.mark.usefixtures('undrawn')
def test_results_are_replaced_only_when_asked_and_the_rest_stays(tmp_path: Path, capsys) -> None:
    sweep, out = make_sweep(tmp_path, MIXED, mixed), tmp_path / 'report'
    command = ['analyze', str(sweep), '--out', str(out)]
    cli.main(command)
    (out / 'notes.md').write_text('mine')
    assert 'not finished' not in capsys.readouterr().err
    with pytest.raises(SystemExit):
        cli.main([*command, '--by', 'kinetic_energy'])
    assert capsys.readouterr().err.startswith('--by: expected ')
    with pytest.raises(SystemExit) as end:
        cli.main(command)
    assert (end.value.code, len(capsys.readouterr().err.splitlines())) == (2, 1)
    cli.main([*command, '--overwrite', '--by', ENERGY, '--json'])
    document = json.loads(capsys.readouterr().out)
    assert document == json.loads((out / 'analysis.json').read_text())
    assert {row['by'] for row in document['best']} == {ENERGY}
    assert (out / 'notes.md').read_text() == 'mine'
    with pytest.raises(SystemExit):
        cli.main(['analyze', str(sweep), '--out', str(sweep), '--overwrite'])
    assert (sweep / 'sweep.json').exists()


def test_values_that_vary_side_by_side_are_said(tmp_path: Path) -> None:
    text = """
name: tied
scenario: case1
vary:
  - zip: {controllers.gvc.k_D: [1, 2, 3], controllers.gvc.k_I: [4, 5, 6]}
"""
    results = analysed(open_sweep(make_sweep(tmp_path, text, lambda *_: {})))
    assert results.notes == [
        'controllers.gvc.k_D and controllers.gvc.k_I vary side by side: '
        'what one explains may be the work of another'
    ]
    assert results.measures == []


def test_paths_of_many_lists_have_no_table_of_two(tmp_path: Path) -> None:
    lists = [[float(k)] * 6 for k in range(1, 22)]
    paths = f'controllers.gvc.k_D: {lists}, controllers.gvc.k_I: {lists}'
    text = f'name: lists\nscenario: case1\nvary: [{{zip: {{{paths}}}}}]'

    def rising(controller, values, index):
        return {ENERGY: index + 1.0}

    results = analysed(open_sweep(make_sweep(tmp_path, text, rising)))
    assert len(results.most_influential()) == 2
    assert (results.pair, results.tables['together']) == ([], [])


@pytest.mark.usefixtures('undrawn')
def test_few_rows_still_show_what_they_depend_on(tmp_path: Path) -> None:
    text = 'name: few\nscenario: case1\nvary: [{grid: {controllers.*.k_D: [1, 2, 3]}}]'

    def square(controller, values, index):
        return {ENERGY: values[K_D].astype(float) ** 2}

    results = analysed(open_sweep(make_sweep(tmp_path, text, square)))
    assert results.tables['influence'] == []
    assert [v.path for v in results.most_influential()] == [K_D]
    found = rows(results, 'dependence', figure=ENERGY, controller='cl')
    assert [(row['value'], row['median']) for row in found] == [('1', 1.0), ('2', 4.0), ('3', 9.0)]
    assert {'distributions', 'dependence_1'} == set(draw(results, tmp_path / 'figures'))
