"""Recordings that lack axes or the wrench: what remains is that of the whole one, the rest null."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.foreign_bags import (
    UNNAMED,
    Maker,
    loaded,
    motion,
    nanoseconds,
    simple,
    simulated,
    write,
)
from helpers.foreign_logs import TABLES, tables
from numpy.testing import assert_allclose

from auv_analysis import summarize
from auv_analysis.cli import main
from auv_analysis.metrics.coupling import input_deformation, velocity_deformation
from auv_analysis.runs.run import Run
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle import DOFS

KEYS = {'odometry': '/o', 'frames': 'enu_flu', 'setpoint': '/s'}
WRENCH = {'wrench': '/w'}
LEVEL = {'initial': {'eta': [0.0] * 6, 'nu': [0.0] * 6}}
LINEAR = ['u', 'v', 'w']


@pytest.fixture(scope='module')
def run() -> Run:
    return simulated(duration=3.0)


@pytest.fixture(scope='module')
def bag(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(run, tmp_path_factory.mktemp('bags') / 'whole')


@pytest.fixture(scope='module')
def whole(bag: Path) -> dict[str, Any]:
    return summarize(loaded(bag, **KEYS, **WRENCH))


def written(run: Run, path: Path, lacking: tuple[int, ...] = ()) -> Path:
    """A bag with odometry, wrench and set-point; NaN in some columns of the velocity."""
    seen, maker = motion(run, enu=True), Maker()
    seen.twist[:, list(lacking)] = np.nan
    asked = [
        ('/s', ns, maker.stamped('Twist', ns, 'base_link', maker.six('Twist', row)))
        for ns, row in zip(nanoseconds(seen.t).tolist(), seen.nu_d, strict=True)
    ]
    return write(path, simple(seen, maker, '/o', '/w', UNNAMED) + asked, maker)


def known_as_whole(found: Any, whole: Any, null: set[str], path: str = '') -> None:
    """Every figure equals that of the whole recording; those named, and no others, are null."""
    if isinstance(whole, dict):
        assert found is not None or path in null, path
        for key in whole if found else ():
            known_as_whole(found[key], whole[key], null, f'{path}.{key}'.strip('.'))
    elif isinstance(whole, list):
        names = DOFS if len(whole) == 6 else range(len(whole))
        for name, x, y in zip(names, found or [None] * len(whole), whole, strict=True):
            known_as_whole(x, y, null, f'{path}.{name}')
    elif any(path == name or path.startswith(f'{name}.') for name in null):
        assert found is None, path
    elif isinstance(whole, float):
        assert found == pytest.approx(whole, rel=1e-9, abs=1e-12), path
    else:
        assert found == whole, path


def resting_on(weights: np.ndarray, unknown: list[int]) -> list[str]:
    """Rows of a linear map that need one of some components."""
    return [dof for dof, row in zip(DOFS, weights, strict=True) if np.any(row[unknown] != 0.0)]


COMPARED = ('kinetic_energy', 'velocity', 'velocity_error', 'settling', 'coupling', 'effort')


@pytest.mark.parametrize(
    ('how', 'lacking'),
    [
        ('told', (0, 1, 2)), ('told', (2,)), ('told', (5,)), ('told', (0, 1, 2, 3, 4, 5)),
        ('nan', (2,)), ('nan', (0, 1, 2, 3, 4, 5)),
    ],
)  # fmt: skip
def test_what_does_not_need_a_velocity_is_as_if_it_were_there(
    how, lacking, run, bag, whole, tmp_path
):
    if how == 'told':
        lacks = loaded(bag, **KEYS, **WRENCH, unknown=['uvwpqr'[i] for i in lacking])
    else:
        lacks = loaded(written(run, tmp_path / 'lacking', lacking), **KEYS, **WRENCH)
    found, unknown = summarize(lacks), [DOFS[i] for i in lacking]
    assert np.isnan(lacks.nu[:, lacking]).all()
    assert not np.isnan(np.delete(lacks.nu, lacking, axis=1)).any()
    Upsilon = np.array(whole['decomposition']['Upsilon'])
    xi = resting_on(np.linalg.inv(Upsilon), [*lacking])
    deformed = resting_on(velocity_deformation(np.linalg.inv(Upsilon)), [*lacking])
    null = {'kinetic_energy.mean', 'kinetic_energy.shares_percent'}
    null |= {f'kinetic_energy.mean_by_component.{dof}' for dof in xi}
    null |= {f'coupling.delta_xi_max.{dof}' for dof in deformed}
    families = ('velocity.rms', 'velocity.max', 'settling.residual')
    families += tuple(f'velocity_error.{key}' for key in whole['velocity_error'])
    null |= {f'{family}.{dof}' for family in families for dof in unknown}
    for key in COMPARED:
        known_as_whole(found[key], whole[key], null, key)
    for kind, weights in (('delta_xi', unknown), ('delta_pi', [])):
        terms = zip(found['coupling_terms'][kind], whole['coupling_terms'][kind], strict=True)
        for mine, theirs in terms:
            assert mine['coefficient'] == theirs['coefficient']
            assert mine['rms'] == (
                None if mine['from'] in weights else pytest.approx(theirs['rms'])
            )
            shared = kind == 'delta_pi' or mine['to'] not in deformed
            assert (mine['share_percent'] is not None) == shared
    assert found['unexplained'] is None, 'C nu needs them all in this vehicle'
    assert any('not recorded: ' in note for note in found['notes'])


@pytest.mark.parametrize('unknown', [['x', 'y'], ['x', 'y', 'z', 'psi']])
def test_position_and_heading_are_needed_by_nothing_but_themselves(unknown, bag):
    whole, found = (loaded(bag, **KEYS, **WRENCH, **more) for more in ({}, {'unknown': unknown}))
    columns = [('x', 'y', 'z', 'phi', 'theta', 'psi').index(name) for name in unknown]
    assert np.isnan(found.eta[:, columns]).all()
    assert_allclose(np.delete(found.eta, columns, 1), np.delete(whole.eta, columns, 1), atol=0)
    assert_allclose(found.unexplained, whole.unexplained, rtol=1e-12)
    assert found.unknown == ()


def test_without_roll_and_pitch_gravity_is_not_known(bag):
    found = loaded(bag, **KEYS, **WRENCH, unknown=['phi', 'theta'])
    assert np.isnan(found.unexplained[:, :5]).all(), 'weight, buoyancy and their arms'
    assert summarize(found)['kinetic_energy']['mean'] is not None


def test_without_wrench_the_required_one_is_that_which_acted(tmp_path):
    """tau - F: what actuators and disturbance exerted together, within the error that is said."""
    run = simulated(duration=20.0, **LEVEL)
    noise = 1e-3 * np.random.default_rng(0).standard_normal(run.nu.shape)
    seen = motion(run, enu=False)
    seen.twist[:] += noise
    keys = {key: TABLES[key] for key in ('odometry', 'frames', 'stamp')}
    found = loaded(tables(tmp_path / 'free', seen, seen), **keys)
    assert np.isnan(found.tau).all()
    assert found.unexplained is None
    k = np.searchsorted(run.t, found.t + 1e-9, 'right') - 1
    late = found.t > 2.0  # a wrench that jumps at the start is smeared by any filter
    acted = 0.5 * (run.tau[k] + run.tau[k - 1]) - run.disturbance[k]
    apart = np.abs(found.required_wrench - acted)[late] / found.required_wrench_error[late]
    assert np.all((apart < 2.0).mean(axis=0) > 0.9), (apart < 2.0).mean(axis=0)
    assert np.all((apart < 0.1).mean(axis=0) < 0.5), 'an error said to be far larger than it is'


def test_without_wrench_only_what_needs_it_is_null(bag, whole):
    found = summarize(loaded(bag, **KEYS))
    Upsilon = np.array(whole['decomposition']['Upsilon'])
    null = {'effort.rms', 'effort.max'}
    null |= {
        f'coupling.delta_pi_max.{d}' for d in resting_on(input_deformation(Upsilon), [*range(6)])
    }
    for key in COMPARED:
        known_as_whole(found[key], whole[key], null, key)
    assert found['unexplained'] is None
    assert whole['required_wrench'] is None
    assert any('no wrench was mapped' in note and '/w' in note for note in found['notes'])


@pytest.mark.usefixtures('unrendered')
@pytest.mark.parametrize('several', [False, True])
def test_report_and_tables_cope_with_what_is_missing(several, bag, tmp_path, capsys):
    told = ''.join(f'{key}: {value}\n' for key, value in KEYS.items()) + 'vehicle: rexrov\n'
    (tmp_path / 'map.yaml').write_text(f'{told}unknown: [x, y, u, v, w]\n')
    bags = [str(bag)] * (2 if several else 1)
    main.main(['analyze', *bags, '--map', str(tmp_path / 'map.yaml'), '--out', str(tmp_path / 'o')])
    report = (tmp_path / 'o' / 'report.html').read_text(encoding='utf-8')
    assert 'not all velocities were recorded' in report
    assert 'no wrench was mapped' in report
    assert 'every row of (1) needs what was not recorded' in report
    assert 'NaN' not in (tmp_path / 'o' / 'summary.json').read_text()
    assert ' nan' not in capsys.readouterr().out.lower()
    assert '>nan<' not in report.lower()


@pytest.mark.parametrize(
    'more', [{'twist_frame': 'world'}, {'rates': 'from attitude'}], ids=['world', 'rates']
)
def test_an_unknown_angle_cannot_turn_velocities(more, bag):
    with pytest.raises(InputError, match='pose: expected all three angles'):
        loaded(bag, **KEYS, **WRENCH, unknown=['psi'], **more)
