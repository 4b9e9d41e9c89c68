"""What is found in the rows of a sweep, where the figures are known functions of what varies."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from made_sweeps import change_manifest, make_sweep
from pyarrow import parquet
from scipy.stats import f_oneway, spearmanr
from strategies import QUICK

from auv_analysis import cli
from auv_analysis.exploration.dependence import merged
from auv_analysis.exploration.figures import draw
from auv_analysis.exploration.influence import explained
from auv_analysis.exploration.opening import open_sweep
from auv_analysis.exploration.quantiles import by_group, distribution, quantiles, spread
from auv_analysis.exploration.results import Results, analysed
from auv_analysis.exploration.varied import varied_paths
from auv_analysis.measures import BY_NAME
from auv_dynamics import InputError

ENERGY, SETTLED = 'kinetic_energy.mean', 'overall.velocity_error.settling_time'
SIMPLE = """
name: simple
scenario: case1
block: 50
vary:
  - random:
      controllers.*.k_D: {uniform: {from: 1.0, to: 3.0}}
      vehicle.damping.linear[0]: {uniform: {from: 0.0, to: 1.0}}
      controllers.cl.k_I: {loguniform: {from: 0.1, to: 10.0}}
    count: 400
  - grid: {integrator: [ode5, rk4]}
"""
K_D, DAMPING = 'controllers.*.k_D', 'vehicle.damping.linear[0]'


def simple(controller, values, index):
    bent = 4 * (values[DAMPING] - 0.5) ** 2  # its rank correlation is nothing
    factor = 1.0 if controller == 'gvc' else 1.5
    heave = np.where(values[K_D] > 2.0, 1.0, np.nan)  # settles in half of the rows
    return {ENERGY: factor * values[K_D] ** 2, 'effort.max.roll': 2.0 + bent,
            'velocity_error.settling_time.heave': heave}  # fmt: skip


@pytest.fixture(scope='module')
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return analysed(open_sweep(make_sweep(tmp_path_factory.mktemp('simple'), SIMPLE, simple)))


def rows(results: Results, table: str, **names: object) -> list[dict]:
    return [r for r in results.tables[table] if all(r[k] == v for k, v in names.items())]


def test_figures_that_never_differ_are_named_not_analysed(results: Results) -> None:
    assert [m.name for m in results.measures] == [ENERGY, 'overall.effort.max.angular']
    assert results.fixed['overall.effort.rms.linear'] == pytest.approx(np.sqrt(3))
    assert results.fixed[SETTLED] == 1.0


def test_what_matters_is_found_rising_or_not(results: Results) -> None:
    (energy,) = rows(results, 'influence', figure=ENERGY, controller='gvc', path=K_D)
    assert energy['spearman'] == pytest.approx(1.0)
    assert energy['explained_percent'] > 99
    (bent,) = rows(results, 'influence', figure='overall.effort.max.angular', controller='gvc',
                   path=DAMPING)  # fmt: skip
    assert abs(bent['spearman']) < 0.15
    assert bent['explained_percent'] > 95
    (none,) = rows(results, 'influence', figure=ENERGY, controller='gvc', path='integrator')
    assert (none['spearman'], none['explained_percent']) == (None, 0.0)
    assert {v.path for v in results.pair} == {K_D, DAMPING}


def test_a_path_of_another_controller_has_no_say(results: Results) -> None:
    paths = {row['path'] for row in rows(results, 'influence', controller='gvc')}
    assert 'controllers.cl.k_I' not in paths
    assert 'controllers.cl.k_I' in {r['path'] for r in rows(results, 'influence', controller='cl')}


def test_spearman_is_that_of_scipy(results: Results) -> None:
    varied = next(v for v in results.varied if v.path == DAMPING)
    mine = results.rows_of('cl')
    (row,) = rows(results, 'influence', figure=ENERGY, controller='cl', path=DAMPING)
    expected = spearmanr(varied.numbers[mine], results.values[ENERGY][mine]).statistic
    assert row['spearman'] == pytest.approx(expected)


def test_groups_along_a_path_hold_its_quantiles(results: Results) -> None:
    found = rows(results, 'dependence', figure=ENERGY, controller='gvc', path=K_D)
    assert sum(row['rows'] for row in found) == 800
    assert [row['from'] for row in found] == sorted(row['from'] for row in found)
    for row in found:
        assert row['from'] ** 2 <= row['smallest'] <= row['median'] <= row['to'] ** 2
        assert row['median'] == pytest.approx(row['middle'] ** 2, rel=0.05)


def test_controllers_in_the_same_rollouts(results: Results) -> None:
    (row,) = rows(results, 'paired', figure=ENERGY)
    assert (row['controller'], row['other'], row['rollouts']) == ('gvc', 'cl', 800)
    assert (row['smaller_percent'], row['equal_percent']) == (100.0, 0.0)
    assert row['median_ratio'] == pytest.approx(1 / 1.5)
    (same,) = rows(results, 'paired', figure='overall.effort.max.angular')
    assert same['equal_percent'] == 100.0


def test_two_paths_together(results: Results) -> None:
    cells = rows(results, 'together', figure=ENERGY, controller='gvc')
    assert sum(cell['rows'] for cell in cells) == 800
    first = {cell['value'] for cell in cells}
    assert len(first) <= 10
    assert all(cell['median'] is None or 1 <= cell['median'] <= 9 for cell in cells)


def test_rows_that_settle_in_half(results: Results) -> None:
    name = 'velocity_error.settling_time.heave'
    (row,) = rows(results, 'quantiles', figure=name, controller='gvc')
    share = np.mean(results.varied[0].numbers[results.rows_of('gvc')] > 2.0)
    assert (row['rows'], row['known'] / row['rows']) == (800, pytest.approx(share))
    assert row['high'] is None, 'of a time, what does not exist is late'
    assert row['largest'] == 1.0


def test_best_rows_are_the_smallest(results: Results) -> None:
    found = analysed(results.sweep, ENERGY).tables['best']
    mine = [row for row in found if row['controller'] == 'cl']
    assert [row['rank'] for row in mine] == list(range(1, 11))
    assert mine[0][ENERGY] == np.nanmin(results.values[ENERGY][results.rows_of('cl')])
    assert mine[0][ENERGY] == pytest.approx(1.5 * mine[0][K_D] ** 2)


def test_what_varies_says_its_unit(results: Results) -> None:
    said = {v.path: (v.unit, v.meaning) for v in results.varied}
    assert 'velocity gain' in said[K_D][1]
    assert [v.labels for v in results.varied if v.path == 'integrator'] == [['ode5', 'rk4']]


# the parts


@QUICK
@given(st.integers(0, 10_000), st.integers(2, 6))
def test_explained_share_is_that_of_the_f_test(seed, groups) -> None:
    """1 - MS_within / MS_total, which F = MS_between / MS_within gives another way."""
    rng = np.random.default_rng(seed)
    codes = np.concatenate([np.arange(groups), rng.integers(0, groups, 60)])
    ranks = rng.normal(size=len(codes)) + 0.5 * codes
    F = f_oneway(*by_group(ranks, codes, groups)).statistic
    n = len(codes)
    expected = (groups - 1) * (F - 1) / ((groups - 1) * F + n - groups)
    assert explained(ranks, codes) == pytest.approx(max(expected, 0.0), abs=1e-9)


@QUICK
@given(arrays(float, st.integers(1, 40), elements=st.floats(-5, 5)))
def test_quantiles_are_values_and_a_distribution_ends_at_all(values) -> None:
    at = quantiles(values, [0.05, 0.5, 0.95])
    assert set(at) <= set(values)
    assert np.mean(values <= at[1]) >= 0.5
    x, share = distribution(values, BY_NAME[ENERGY])
    assert share[-1] == 100.0
    assert x[0] == values.min()
    for value, percent in zip(x, share, strict=True):
        assert percent == pytest.approx(100 * np.mean(values <= value))


def test_a_distribution_of_times_ends_where_the_rest_never_settles() -> None:
    x, share = distribution(np.array([1.0, 2.0, np.nan, np.nan]), BY_NAME[SETTLED])
    assert (x[-1], share[-1]) == (2.0, 50.0)
    assert spread(np.array([1.0, 2.0, np.nan]), 's')['median'] == 2.0
    assert spread(np.array([1.0, 2.0, np.nan]), 'N')['median'] == 1.0
    assert spread(np.full(2, np.nan), 's')['median'] is None


# kinds of values, failures, what is not there


MIXED = """
name: mixed
scenario: case1
block: 4
vary:
  - grid:
      vehicle: [herman2018, rexrov]
      controllers.gvc.k_D: [[1, 1, 1, 1, 1, 1], [2, 2, 2, 2, 2, 2]]
      vehicle.rigid_body.mass: [-1.0, 250.0, 300.0]
"""


def mixed(controller, values, index):
    count = len(index)
    status, reason = np.full(count, 'ok', object), np.full(count, '', object)
    lost = values['vehicle.rigid_body.mass'] < 0
    status[lost], reason[lost] = 'refused', 'too light'
    wild = ~lost & (np.array(values['vehicle']) == 'rexrov') & (controller == 'cl')
    status[wild], reason[wild] = 'diverged', 'not finite'
    gain = np.array([entry[0] for entry in values['controllers.gvc.k_D']])
    energy = np.where(lost | wild, np.nan, gain + (controller == 'cl'))
    return {'status': status, 'reason': reason, ENERGY: energy}


def test_words_lists_and_failures(tmp_path: Path) -> None:
    results = analysed(open_sweep(make_sweep(tmp_path, MIXED, mixed)))
    assert {v.path: list(v.labels) for v in results.varied} == {
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
    sweep = open_sweep(make_sweep(tmp_path, SIMPLE, simple, range(0, 16, 3)))
    assert (sweep.rows, sweep.planned) == (600, 1600)
    results = analysed(sweep)
    assert results.counts()[0]['rows'] == 300
    (row,) = rows(results, 'paired', figure=ENERGY)
    assert row['rollouts'] == 300


def test_bins_are_joined_where_they_are_many(results: Results) -> None:
    varied = next(v for v in varied_paths(results.sweep) if v.path == K_D)
    codes, labels = merged(varied)
    assert len(varied.labels) > 10 >= len(labels)
    assert labels[0].split('–')[0] == varied.labels[0].split('–')[0]
    assert labels[-1].split('–')[1] == varied.labels[-1].split('–')[1]
    assert codes.max() == len(labels) - 1


@pytest.mark.parametrize(
    ('spoil', 'words'),
    [
        (lambda out: _part(out).write_bytes(b'PAR1'), 'part-00000001.parquet: expected a finished'),
        (lambda out: _damage(_part(out)), 'part-00000001.parquet: expected a finished part'),
        (lambda out: _without(_part(out)), 'part-00000001.parquet: controllers.*expected a column'),
        (lambda out: (out / 'sweep.json').write_text('{'), 'sweep.json: expected the manifest'),
        (lambda out: (out / 'sweep.json').write_text('[]'), 'expected campaign and rollouts'),
        (lambda out: change_manifest(out, campaign={}), 'expected campaign and rollouts'),
        (lambda out: [p.unlink() for p in (out / 'rollouts').iterdir()], 'no part-'),
        (lambda out: (out / 'rollouts').rename(out / 'gone'), 'expected the rows of a sweep'),
    ],
)
def test_a_broken_sweep_is_refused_in_one_line(tmp_path: Path, spoil, words: str) -> None:
    out = make_sweep(tmp_path, SIMPLE, simple, range(3))
    spoil(out)
    with pytest.raises(InputError, match=words) as refusal:
        analysed(open_sweep(out))
    assert '\n' not in str(refusal.value)


def _part(out: Path) -> Path:
    return out / 'rollouts/part-00000001.parquet'


def _damage(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[4 : len(data) // 2] = bytes(len(data) // 2 - 4)
    path.write_bytes(data)


def _without(path: Path) -> None:
    from pyarrow import parquet

    parquet.write_table(parquet.read_table(path).drop_columns([K_D]), path)


def test_the_document_has_no_nan(results: Results) -> None:
    from auv_analysis.exploration.files import document

    assert json.loads(json.dumps(document(results), allow_nan=False))['rows'] == 1600


@pytest.mark.usefixtures('unrendered')
@pytest.mark.parametrize(('campaign', 'known'), [(SIMPLE, simple), (MIXED, mixed)])
def test_every_number_of_the_report_is_in_a_file(tmp_path: Path, campaign, known) -> None:
    out = tmp_path / 'report'
    cli.main(['analyze', str(make_sweep(tmp_path, campaign, known)), '--out', str(out)])
    document = json.loads((out / 'analysis.json').read_text())
    numbers = parquet.read_table(out / 'numbers.parquet').to_pylist()
    assert len(numbers) > 100
    tables: dict[str, list[dict]] = {}
    for number in numbers:
        file, _, place = number['source'].partition(':')
        if file == 'analysis.json':
            value = document
            for key in place.removeprefix('/').split('/'):
                value = value[int(key)] if isinstance(value, list) else value[key]
        else:
            rows_ = tables.setdefault(file, parquet.read_table(out / file).to_pylist())
            name, _, row = place.removesuffix(']').rpartition('[')
            value = rows_[int(row)][name]
        assert value == number['value'], number['source']


@pytest.mark.usefixtures('unrendered')
def test_an_unfinished_sweep_says_so(tmp_path: Path, capsys) -> None:
    out = make_sweep(tmp_path, SIMPLE, simple, range(0, 16, 3))
    cli.main(['analyze', str(out), '--out', str(tmp_path / 'report')])
    assert 'note: not finished, 600 of 1600 rows are there' in capsys.readouterr().err
    report = (tmp_path / 'report/report.html').read_text(encoding='utf-8')
    assert 'The sweep is not finished: 600 of 1600 rows are there.' in report


def test_a_sweep_without_figures_is_a_failure(tmp_path: Path, capsys) -> None:
    def refused(controller, values, index):
        return {'status': np.full(len(index), 'refused', object)}

    out = make_sweep(tmp_path, SIMPLE, refused, range(2))
    with pytest.raises(SystemExit) as end:
        cli.main(['analyze', str(out), '--out', str(tmp_path / 'report')])
    assert end.value.code == 1
    assert capsys.readouterr().err.splitlines()[-1] == f'{out}: none of 200 rows has figures'
    assert not (tmp_path / 'report').exists()


@pytest.mark.usefixtures('unrendered')
def test_results_are_replaced_only_when_asked_and_the_rest_stays(tmp_path: Path, capsys) -> None:
    sweep, out = make_sweep(tmp_path, MIXED, mixed), tmp_path / 'report'
    command = ['analyze', str(sweep), '--out', str(out)]
    cli.main(command)
    (out / 'notes.md').write_text('mine')
    capsys.readouterr()
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
