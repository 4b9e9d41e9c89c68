"""The verdict on several controllers: who, by how much, with which gains, at which effort."""

import copy
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from helpers import tunings
from helpers.report_pages import tokens

from auv_analysis import simulate, summarize
from auv_analysis.cli import main
from auv_analysis.metrics.lyapunov import OF_THE_MOTION
from auv_analysis.report.digest import RunDigest, digests
from auv_analysis.report.verdict import FAILED, _tune, verdict
from auv_analysis.runs.run import Extent

CL = tunings.SAME_CL | {'k_D': 30.0}
Runs = tuple[dict[str, RunDigest], dict[str, Any]]


def made(folder: Path, controllers: dict[str, Any], **changes: Any) -> Runs:
    scenario = tunings.scenario(folder, controllers, **changes)
    runs = {name: simulate(scenario, name) for name in controllers}
    return digests(runs), {name: summarize(run) for name, run in runs.items()}


@pytest.fixture(scope='module')
def two(tmp_path_factory) -> Runs:
    return made(tmp_path_factory.mktemp('two'), {'cl': CL, 'gvc': tunings.GVC})


def said(two: Runs, **changes: Any) -> str:
    """Verdict with other errors, peaks, gains or settling times of gvc and of cl."""
    runs, summaries = two[0], copy.deepcopy(two[1])
    places = {
        'rms': ('velocity_error', 'rms'), 'times': ('velocity_error', 'settling_time'),
        'peaks': ('effort', 'max'), 'K_D': ('gains', 'K_D'),
    }  # fmt: skip
    for key, values in changes.items():
        for name, value in zip(('gvc', 'cl'), values, strict=True):
            group, figure = places[key]
            summaries[name][group][figure] = value
    return ' '.join(verdict(runs, summaries))


def test_errors_gains_and_peaks_are_in_the_first_sentence(two: Runs) -> None:
    runs, summaries = two
    first, second = verdict(runs, summaries)
    assert first.startswith('gvc tracks better than cl: against cl, gvc has ')
    K_D, peak = (
        [np.array(f(summaries[name])) for name in ('gvc', 'cl')]
        for f in (lambda s: np.diagonal(s['gains']['K_D']), lambda s: s['effort']['max'])
    )
    factor = K_D[0] / K_D[1]
    force = peak[0][:3].max() / peak[1][:3].max()
    wanted = [*(f(factor[g]) for g in (slice(0, 3), slice(3, 6)) for f in (min, max)), force]
    for (shown, half), value in zip(tokens(first), wanted, strict=False):
        assert abs(shown - value) <= half
    assert 'velocity gain K_D in translation' in first
    assert 'auv tune SCENARIO' in second
    gains = said(two, K_D=(np.diag([1.0, 1.5, 1.2, 2.0, 2.0, 2.0]), np.eye(6)))
    assert '1.0 to 1.5 times the velocity gain K_D in translation and 2.0 times in' in gains
    assert verdict(dict(reversed(runs.items())), summaries)[0] == first


@pytest.mark.parametrize(
    ('ratio', 'law', 'sentences'), [(1.09, 'gvc', 1), (1.12, 'gvc', 2), (1.12, 'own:Law', 1)]
)
def test_a_fair_comparison_is_advised_of_shipped_laws_that_differ(two, ratio, law, sentences):
    runs, summaries = two[0], copy.deepcopy(two[1])
    summaries['gvc']['gains']['K_D'] = np.eye(6).tolist()
    summaries['cl']['gains']['K_D'] = (ratio * np.eye(6)).tolist()
    summaries['gvc']['effort']['max'] = summaries['cl']['effort']['max']
    summaries['gvc']['law'] = law
    assert len(verdict(runs, summaries)) == sentences


def test_the_verdict_stands_above_the_tables_and_first_in_the_report(
    tmp_path: Path, capsys, monkeypatch, unrendered
) -> None:
    from auv_analysis.report import run_report

    found = []
    monkeypatch.setattr(run_report, 'draw_figures', lambda *_: [])
    monkeypatch.setattr(
        run_report, 'write_document', lambda out, *rest: found.append(rest[2]) or out
    )
    path = tunings.write(tmp_path, {'cl': CL, 'gvc': tunings.GVC}, duration=0.5)
    main.main(['simulate', str(path), '--out', str(tmp_path / 'out')])
    shown = capsys.readouterr().err
    first = found[0][0].text
    assert first.startswith('gvc tracks better than cl')
    assert shown.index('gvc tracks better than cl') < shown.index('gvc: law gvc')
    main.main(['simulate', str(path), '--no-report', '--out', str(tmp_path / 'brief')])
    assert first in capsys.readouterr().err
    assert len(found) == 1


ONE, HALF, TWICE = [1.0] * 6, [0.5] * 6, [2.0] * 6
MIXED = [0.5] * 3 + [2.0] * 3
LATE = [0.5] * 5 + [1.0]


@pytest.mark.parametrize(
    ('changes', 'parts'),
    [
        ({'rms': (HALF, ONE)}, ['gvc tracks better', '0.50 times the RMS velocity error']),
        ({'rms': (TWICE, ONE)}, ['cl tracks better than gvc']),
        ({'rms': (MIXED, ONE)}, ['none tracks better in all', 'translation and 2.0 times in']),
        ({'rms': (ONE, ONE)}, ['cl and gvc track alike', 'the same RMS velocity error']),
        ({'rms': ([0.0] * 6, [0.0] * 6)}, ['track alike']),
        ({'rms': ([0.0] * 6, ONE)}, ['gvc tracks better', '0 times the RMS velocity error']),
        ({'rms': (HALF, ONE), 'peaks': ([0.0] * 6, [0.0] * 6)}, ['the same peak moment (0 ag']),
        ({'rms': (HALF, ONE), 'peaks': ([1.0] + [0.0] * 5, [0.0] * 6)},
         ['infinitely many', '(1.00 against 0 N']),
        ({'rms': (HALF, ONE), 'peaks': ([0.0] * 6, ONE)}, ['0 times the peak force']),
        ({'rms': (HALF, ONE), 'K_D': (None, None)}, ['gvc tracks better than cl']),
        ({'rms': (HALF, ONE), 'K_D': (np.diag([1.0] * 5 + [0.0]), np.eye(6))},
         ['gvc tracks better than cl']),
        ({'times': ([None] * 6, [None] * 6)}, ['neither gvc nor cl settles in all']),
        ({'times': (LATE, [2.0, *LATE[1:]])}, ['gvc settles in 1.0 s, cl settles in 2.0 s']),
        ({'times': ([None, *ONE[1:]], ONE)}, ['cl settles in 1.0 s, gvc does not in surge']),
        ({'times': (ONE, [*ONE[1:], None])}, ['gvc settles in 1.0 s, cl does not in yaw']),
        ({'rms': (None, None), 'times': (None, None)}, []),
        ({'rms': ([None, *ONE[1:]], ONE)}, []),
        ({'peaks': (ONE, [None, *ONE[1:]])}, []),
    ],
)  # fmt: skip
def test_every_pair_of_outcomes(
    two: Runs, changes: dict[str, Any], parts: list[str], approved
) -> None:
    text = said(two, **changes)
    approved.add([text])
    assert all(part in text for part in parts), text
    assert bool(text) == bool(parts)
    assert 'nan' not in text
    assert ('K_D' in text) == (bool(parts) and 'K_D' not in changes)


def test_of_several_the_best_is_held_against_the_next(tmp_path: Path) -> None:
    weak = CL | {'k_D': 3.0}
    runs, summaries = made(tmp_path, {'weak': weak, 'gvc': tunings.GVC, 'cl': CL})
    (text, _) = verdict(runs, summaries)
    assert text.startswith('Of 3 controllers, gvc tracks best, cl next: against cl, gvc has ')
    left = {name: (runs[name], summaries[name]) for name in ('weak', 'cl')}
    (_, without) = verdict(*({n: pair[i] for n, pair in left.items()} for i in (0, 1)))
    assert 'auv tune SCENARIO --reference cl compares' in without
    one = {'gvc': runs['gvc']}, {'gvc': summaries['gvc']}
    assert verdict(*one) == []


def of_errors(two: Runs, **errors: tuple[float, float]) -> str:
    """First sentence on runs that differ in their errors in translation and in rotation alone."""
    summaries = {name: copy.deepcopy(two[1]['gvc']) for name in errors}
    for name, (linear, angular) in errors.items():
        summaries[name]['velocity_error']['rms'] = [linear] * 3 + [angular] * 3
    return verdict(dict.fromkeys(errors, two[0]['gvc']), summaries)[0]


def test_where_none_is_best_in_both_the_best_in_each_are_compared(two: Runs) -> None:
    text = of_errors(two, a=(0.5, 2.0), b=(1.0, 1.0), c=(2.0, 0.9))
    assert text.startswith('Of 3 controllers, none tracks better in all, neither a nor c: ')


def test_the_best_may_be_worse_by_less_than_counts(two: Runs) -> None:
    text = of_errors(two, a=(1.0, 1.0), b=(1.005, 0.5), c=(2.0, 2.0))
    assert text.startswith('Of 3 controllers, b tracks best, a next: ')
    text = of_errors(two, a=(1.0, 1.0), b=(10.0, 1.5), c=(4.0, 4.0))
    assert text.startswith('Of 3 controllers, a tracks best, b next: '), 'by the product'


def longer(run: RunDigest, times: float) -> Extent:
    return run.extent._replace(end=run.start + times * run.duration)


@pytest.mark.parametrize(
    ('word', 'change'),
    [
        ('vehicle', lambda run: {'vehicle': run.vehicle.changed(M=1.1 * run.vehicle.M)}),
        ('vehicle', lambda run: {'vehicle': run.vehicle.changed(lift=np.eye(6))}),
        ('vehicle', lambda run: {'vehicle': run.vehicle.changed(weight=0.9 * run.vehicle.weight)}),
        ('length', lambda run: {'known_extent': longer(run, 1.02)}),
        ('start', lambda run: {'begin': run.begin + 0.006 * (np.arange(12) == 3)}),
        ('disturbance', lambda run: {'course': run.course | {'F': run.course['F'] + 1.0}}),
        ('', lambda run: {  # a force that follows the motion is another one of each run
            'kinds': frozenset({min(OF_THE_MOTION)}),
            'course': run.course | {'F': run.course['F'] + 1.0},
        }),
        ('', lambda run: {
            'known_extent': longer(run, 1.005),
            'begin': run.begin + np.where(np.arange(12) < 3, 1.0, 0.004),
        }),
    ],
)  # fmt: skip
def test_runs_are_ranked_where_they_share_all_but_the_law(two: Runs, word: str, change) -> None:
    runs, summaries = two
    changed = runs | {'cl': replace(runs['cl'], **change(runs['cl']))}
    text = verdict(changed, summaries)[0]
    told = f'These runs cannot be ranked: they differ in {word}.'
    assert text.startswith(told if word else 'gvc tracks better')
    three = verdict(changed | {'third': changed['cl']}, summaries | {'third': summaries['cl']})[0]
    assert three.startswith(told if word else 'Of 3 controllers')


def test_what_is_not_alike_is_not_ranked(two: Runs, tmp_path: Path) -> None:
    runs, summaries = two
    setpoint = {'surge': {'offset': 0.2}}
    others, more = made(tmp_path, {'other': CL}, setpoint=setpoint)
    (text,) = verdict({'gvc': runs['gvc'], **others}, {'gvc': summaries['gvc'], **more})
    assert text == 'These runs cannot be ranked: they differ in set-point.'


def test_a_controller_that_diverged_is_named_first(two: Runs) -> None:
    notes = f'{FAILED}: slow diverges at 1 s', 'another note'
    told = f'Not all are compared: {notes[0]}.'
    runs, summaries = {name: replace(run, notes=notes) for name, run in two[0].items()}, two[1]
    assert verdict({'gvc': runs['gvc']}, {'gvc': summaries['gvc']}) == [told]
    moved = runs | {'cl': replace(runs['cl'], begin=runs['cl'].begin + 1.0)}
    for found, then in ((runs, 'gvc tracks better'), (moved, 'These runs cannot be ranked')):
        first, second, *_ = verdict(found, summaries)
        assert first == told
        assert second.startswith(then)


@pytest.mark.parametrize(
    ('acting', 'sensing', 'words'),
    [((), (), ''), (('lag',), (), ' --hold zoh'), ((), ('noise',), ' --hold zoh')],
)
def test_laws_behind_devices_are_tuned_as_they_are_sampled(acting, sensing, words: str) -> None:
    run = SimpleNamespace(scenario='mine', law='gvc', acting=acting, sensing=sensing)
    plain = SimpleNamespace(scenario='mine', law='cl', acting=(), sensing=())
    assert _tune('gvc', [run, plain]) == f'auv tune SCENARIO{words}'
