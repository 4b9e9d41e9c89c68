"""`auv tune`: its folder, its document, and one line for what it cannot take."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace as Made

import numpy as np
import pyarrow.parquet as pq
import pytest
import yaml
from helpers.report_pages import check_numbers
from helpers.tunings import GVC, SAME_CL, write

from auv_analysis import load_scenario, simulate
from auv_analysis.cli import main, tune
from auv_analysis.metrics.quantities import COSTS
from auv_analysis.output.folder import sha256_of, write_manifest
from auv_analysis.studies.tune import search as searching
from auv_analysis.studies.tune.cost import measures_of_run
from auv_analysis.studies.tune.gain_space import STRUCTURES
from auv_analysis.studies.tune.perturbations import Spread, monte_carlo
from auv_analysis.studies.tune.report import FAIR
from auv_analysis.studies.tune.search import Request

FILES = {'tune.json', 'scenario.yaml', 'vehicle.yaml', 'search.parquet', 'monte_carlo.parquet',
         'numbers.parquet', 'report.html', 'figures', 'manifest.json'}  # fmt: skip
FIGURES = {f'{name}.{kind}' for name in ('trade_off', 'draws', 'paired') for kind in ('png', 'pdf')}
# of 13 draws and fewer, p is counted out where some tie: for seconds
QUICK = ('--law', 'cl', '--samples', '14', '--structure', 'mass')


@pytest.fixture
def command(tmp_path: Path, monkeypatch, capsys) -> Callable:
    """`auv tune s.yaml` in this process: exit code, stdout, lines of stderr."""
    monkeypatch.chdir(tmp_path)
    for name, fewer in (('POINTS', 64), ('STARTS', 2), ('SHORT', 8)):
        monkeypatch.setattr(searching, name, fewer)
    write(tmp_path, {'gvc': GVC, 'cl': SAME_CL | {'k_D': 300.0}}, duration=1.0)

    def call(*arguments: str) -> tuple[object, str, list[str]]:
        code: object = 0
        try:
            main.main(['tune', 's.yaml', *arguments])
        except SystemExit as end:
            code = end.code
        captured = capsys.readouterr()
        return code, captured.out, captured.err.splitlines()

    return call


@pytest.fixture
def brief(monkeypatch) -> None:
    """A search that ends at the first of its optima, where nobody asks for the best one."""
    monkeypatch.setattr(searching, 'FINALISTS', 1)


@pytest.mark.usefixtures('unrendered')
def test_folder_document_and_files_agree(command: Callable, tmp_path: Path, approved) -> None:
    code, out, lines = command(*QUICK, '--json')
    folder = tmp_path / 'runs/tune_small'
    document = json.loads(out)
    assert code == 0
    assert {entry.name for entry in folder.iterdir()} == FILES
    assert {entry.name for entry in (folder / 'figures').iterdir()} == FIGURES
    assert json.loads((folder / 'tune.json').read_text()) == document
    assert list(document['controllers']) == ['gvc', 'cl', 'gvc_tuned', 'cl_tuned']
    assert lines[-1].endswith('runs/tune_small/report.html')
    assert set(document['controllers']) <= {
        line.partition(' ')[0] for line in map(str.strip, lines)
    }
    _equal(document, 'effort', 1e-3)
    _repeated(document, folder)
    _searched(document, folder)
    _perturbed(document, folder)
    assert all(sentence['source'] for sentence in document['verdict'])
    assert check_numbers(folder) > 100
    approved.folder(folder)
    approved.within = 0.05
    page = (folder / 'report.html').read_text(encoding='utf-8')
    assert 'equal effort within 0.1 %, hold continuous, seed 0' in page
    assert FAIR in page
    said = {sentence['text'] for sentence in document['verdict']}
    entries = document['controllers'].items()
    assert {f'{name}: {text}.' for name, entry in entries for text in entry['remarks']} <= said


def test_without_law_every_shipped_one_is_tuned_the_own_first(tmp_path: Path) -> None:
    scenario = load_scenario(write(tmp_path, {'gvc': GVC}))
    options = main.parser(['tune']).parse_args(['tune', 's.yaml'])
    assert tune._request(options, scenario) == Request(
        scenario, 'gvc', ('gvc', 'cl', 'pid', 'smc'), 'effort', 'weighted_error', 0.001, 'best',
        'continuous', 0, len(os.sched_getaffinity(0)), 256,
    )  # fmt: skip


def test_the_first_gvc_is_the_reference_and_a_law_of_ones_own_is_not_tuned() -> None:
    laws = {'one': 'cl', 'slow': 'gvc', 'fast': 'gvc', 'mine': 'module:Law'}
    controllers = {name: {'law': law} for name, law in laws.items()}
    scenario = Made(controllers=controllers, controller=controllers.__getitem__, sampled=[],
                    vehicle=Made(M_RB=None))  # fmt: skip
    found = []
    for asked in (['--law', 'cl', '--law', 'gvc', '--law', 'cl'], ['--reference', 'mine'],
                  ['--reference', 'one', '--law', 'smc']):  # fmt: skip
        options = main.parser(['tune']).parse_args(['tune', 's.yaml', *asked])
        request = tune._request(options, scenario)
        found.append((request.reference, request.laws))
    assert found == [
        ('slow', ('gvc', 'cl')), ('mine', ('gvc', 'cl', 'pid', 'smc')), ('one', ('cl', 'smc')),
    ]  # fmt: skip


@pytest.mark.parametrize('samples', ['0', '10', '100000'])
def test_there_may_be_no_draws_or_enough(samples: str) -> None:
    options = main.parser(['tune']).parse_args(['tune', 's.yaml', '--samples', samples])
    assert options.samples == int(samples)


def _equal(document: dict, measure: str, tolerance: float) -> None:
    entries = document['controllers']
    base = entries['gvc']['measures'][measure]
    for name in ('gvc_tuned', 'cl_tuned'):
        assert entries[name]['reached']
        assert entries[name]['measures'][measure] == pytest.approx(base, rel=tolerance)
        assert entries[name]['equality'] == pytest.approx(
            entries[name]['measures'][measure] / base - 1, abs=1e-12
        )


def _repeated(document: dict, folder: Path) -> None:
    """The scenario that is left behind gives the numbers of the document."""
    scenario = load_scenario(folder / 'scenario.yaml')
    for name, entry in document['controllers'].items():
        found = measures_of_run(simulate(scenario, name))
        for measure, expected in entry['measures'].items():
            value = getattr(found, measure)[0]
            assert (value if np.isfinite(value) else None) == (
                expected if expected is None else pytest.approx(expected, rel=1e-6)
            )
    assert document['validation']['largest_relative_deviation'] < 1e-6


def _searched(document: dict, folder: Path) -> None:
    table = pq.read_table(folder / 'search.parquet')
    assert document['measures']['effort'] == {
        'label': COSTS['effort'].label, 'unit': 'J/s²', 'text': COSTS['effort'].meaning
    }  # fmt: skip
    bounds = document['controllers']['cl_tuned']['searches'][0]['searched']
    assert bounds['k_D'] == {'low': 0.05, 'high': 100.0, 'times_inertia': True}  # 1/step
    assert bounds['Lambda'] == {'low': 0.01, 'high': 100.0, 'times_inertia': False}
    tuned = {n: e for n, e in document['controllers'].items() if e['tuned']}
    assert len(table) == sum(entry['evaluations'] for entry in tuned.values())
    rows = table.to_pylist()
    for name, entry in tuned.items():
        assert (entry['structure'], entry['structure_means']) == ('mass', STRUCTURES['mass'])
        (search,) = entry['searches']
        assert [search[key] for key in ('structure', 'reached', 'evaluations', 'measures')] == [
            entry[key] for key in ('structure', 'reached', 'evaluations', 'measures')
        ]
        mine = [r for r in rows if r['controller'] == name and r['allowed'] and not r['diverged']
                and r['stage'] != 'gradient']  # fmt: skip
        base = document['controllers']['gvc']['measures']['effort']
        equal = [r for r in mine if abs(r['effort'] / base - 1) < 1e-9]
        assert (
            entry['measures']['weighted_error'] <= min(r['weighted_error'] for r in equal) * 1.001
        )


def _perturbed(document: dict, folder: Path) -> None:
    assert document['monte_carlo']['samples'] == 14
    assert document['monte_carlo']['spread']['waves'] == 0.05
    draws = pq.read_table(folder / 'monte_carlo.parquet').to_pandas()
    assert draws.groupby('controller')['draw'].apply(list).map(len).tolist() == [14] * 4
    for name, entry in document['monte_carlo']['controllers'].items():
        mine = draws[draws.controller == name]
        assert entry['error']['q95'] == np.quantile(mine.error, 0.95, method='higher')
    wide = draws.pivot_table(index='draw', columns='controller', values='weighted_error')
    for row in document['monte_carlo']['comparisons']:
        if row['measure'] == 'weighted_error':
            ratios = wide[row['controller']] / wide[row['against']]
            assert row['interval'][0] <= row['ratio'] <= row['interval'][1]
            assert row['verdict'] * row['effect'] >= 0 <= row['effect'] * np.log(row['ratio'])
            assert row['smaller'] == pytest.approx((ratios < 1 - 1e-6).mean())


@pytest.mark.usefixtures('undrawn', 'brief')
def test_search_check_and_draws_are_held_where_that_is_asked_for(command, tmp_path: Path) -> None:
    write(tmp_path, {'gvc': GVC}, duration=0.5, step=0.05)
    asked = '--law', 'gvc', '--structure', 'mass', '--samples', '10', '--hold', 'zoh'
    asked = *asked, '--tolerance', '0.05'
    code, out, _ = command(*asked, '--spread', 'waves=0.2', '--seed', '3', '--json')
    document, folder = json.loads(out), tmp_path / 'runs/tune_small'
    assert (code, document['tolerance']) == (0, 0.05)
    scenario = load_scenario(folder / 'scenario.yaml')
    drawn = monte_carlo(scenario, Spread(waves=0.2), 10, 3, 'zoh', 1)
    table = pq.read_table(folder / 'monte_carlo.parquet').to_pandas()
    for name, entry in document['controllers'].items():
        found = measures_of_run(simulate(scenario, name, 'zoh'))
        assert entry['measures']['error'] == pytest.approx(found.error[0], rel=1e-6)
        assert table.error[table.controller == name].tolist() == drawn[name].error.tolist()
    base, best = (document['controllers'][name]['measures'] for name in ('gvc', 'gvc_tuned'))
    assert best['effort'] == pytest.approx(base['effort'], rel=1e-3)


@pytest.mark.usefixtures('unrendered')
@pytest.mark.long
def test_same_seed_same_document_another_seed_another(command: Callable) -> None:
    arguments = ('--json', '--law', 'cl', '--samples', '10', '--structure', 'mass', '--overwrite')
    first, again, other = (
        json.loads(command(*arguments, '--seed', seed)[1]) for seed in ('1', '1', '2')
    )
    assert first == again
    assert first['monte_carlo']['controllers'] != other['monte_carlo']['controllers']


@pytest.mark.usefixtures('undrawn', 'brief')
def test_equal_error_and_no_draws(command: Callable, tmp_path: Path) -> None:
    write(tmp_path, {'gvc': GVC, 'cl': SAME_CL}, duration=1.0)
    arguments = ('--equal', 'error', '--index', 'mean', '--samples', '0', '--out', 'mine')
    code, out, _ = command(*QUICK, *arguments, '--json')
    document = json.loads(out)
    assert (code, document['monte_carlo']) == (0, None)
    _equal(document, 'error', 1e-3)
    effort = {n: e['measures']['effort'] for n, e in document['controllers'].items()}
    assert effort['gvc_tuned'] <= effort['gvc'] * 1.001
    assert json.loads((tmp_path / 'mine/tune.json').read_text()) == document
    assert not (tmp_path / 'mine/monte_carlo.parquet').exists()
    assert not (tmp_path / 'runs').exists()


@pytest.mark.usefixtures('undrawn', 'brief')
def test_scenario_without_gvc_needs_a_reference(command: Callable, tmp_path: Path) -> None:
    write(tmp_path, {'cl': SAME_CL}, duration=0.5)
    code, _, lines = command(*QUICK)
    assert (code, len(lines)) == (2, 1)
    expected = 'controllers: expected a controller of law gvc, or --reference with another one'
    assert f'{expected}, found cl' in lines[0]
    code, out, _ = command('--reference', 'cl', '--law', 'cl', '--samples', '0', '--json')
    assert code == 0
    [(name, entry)] = [
        found for found in json.loads(out)['controllers'].items() if found[1]['tuned']
    ]
    assert name == 'cl_tuned'
    searches = {search['structure']: search for search in entry['searches']}
    assert list(searches) == ['scalar', 'mass']
    best = min(searches.values(), key=lambda one: one['measures']['weighted_error'])
    assert all(search['reached'] for search in searches.values())
    assert [entry[key] for key in ('structure', 'measures')] == [
        best[key] for key in ('structure', 'measures')
    ]


@pytest.mark.long
@pytest.mark.usefixtures('unrendered')
def test_effort_out_of_reach_is_said_plainly(command: Callable, tmp_path: Path) -> None:
    weak = {'law': 'pid', 'k_P': 1e-3, 'k_I': 1e-3, 'k_D': 1e-3, 'k_FF': 0.0}
    write(tmp_path, {'lazy': weak}, disturbance=[])
    code, out, lines = command('--reference', 'lazy', *QUICK[:2], '--samples', '0', '--json')
    entry = json.loads(out)['controllers']['cl_tuned']
    assert (code, entry['reached'], entry['price']) == (0, False, None)
    assert entry['equality'] > 1
    assert any('No gains of cl that were tried have the effort of lazy' in line for line in lines)


@pytest.mark.parametrize(
    ('arguments', 'match'),
    [
        (('--reference', 'none'), 'controllers: expected one of gvc, cl, found none'),
        (('--samples', '9'), '--samples: expected 0 for none, or a whole number from 10 to 100000'),
        (('--samples', '-20'), 'to 100000, found -20'),
        (('--samples', '100001'), 'to 100000, found 100001'),
        (('--samples', 'ten'), 'to 100000, found ten'),
        (('--tolerance', '0.0'), '--tolerance: expected a number above 0, below 0.1, found 0.0'),
        (('--tolerance', 'nan'), '--tolerance: expected a finite number'),
        (('--seed', '-1'), '--seed: expected a whole number from 0'),
        (('--spread', 'mass=2'), '--spread: mass: expected a number from 0 up below 1, found 2'),
        (('--equal', 'cost'), '--equal: expected one of effort, error, found cost'),
        (('--law', 'lqr'), '--law: expected one of gvc, cl, pid, smc, found lqr'),
    ],
)
def test_wrong_options_are_one_line(command, arguments, match, tmp_path: Path) -> None:
    code, _, lines = command(*arguments)
    assert (code, len(lines)) == (2, 1)
    assert match in lines[0]
    assert not (tmp_path / 'runs').exists()


def test_the_scenario_that_is_read_is_never_replaced(command: Callable, tmp_path: Path) -> None:
    write_manifest(tmp_path, {'s.yaml': sha256_of(tmp_path / 's.yaml')})
    code, _, lines = command(*QUICK, '--out', '.', '--overwrite')
    assert (code, len(lines)) == (2, 1)
    assert 's.yaml' in lines[0]


def test_actuators_need_sampling(command: Callable, tmp_path: Path) -> None:
    write(tmp_path, {'gvc': GVC}, actuators={'limit': [500.0] * 6})
    code, _, lines = command(*QUICK)
    assert (code, len(lines)) == (2, 1)
    assert 'actuators: expected hold' in lines[0]


@pytest.mark.usefixtures('undrawn', 'brief')
def test_names_that_are_taken_stay_what_they_are(command: Callable, tmp_path: Path) -> None:
    write(tmp_path, {'gvc': GVC, 'cl_tuned': SAME_CL}, duration=0.3)
    code, out, _ = command(*QUICK, '--samples', '0', '--json')
    names = ['gvc', 'cl_tuned', 'gvc_tuned', 'cl_tuned_again']
    assert (code, list(json.loads(out)['controllers'])) == (0, names)
    left = yaml.safe_load((tmp_path / 'runs/tune_small/scenario.yaml').read_text())
    assert left['name'] == 'small_tuned'
