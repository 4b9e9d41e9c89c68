"""The file for the rerun viewer: what is in it, and what is said where rerun is absent."""

import sys
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.needs import need
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from auv_analysis.cli.main import main
from auv_analysis.report import rerun_export
from auv_analysis.report.plots import COLOURS, GREY
from auv_analysis.runs.run import Run
from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle import DOFS

SAMPLES = 7
FORWARD, RIGHT, DOWN = 5, 3, 2  # as rerun's ViewCoordinates has them


def made_run() -> Run:
    """A run whose every column is like no other's."""
    t = 0.01 * np.arange(SAMPLES)
    names = 'eta', 'nu', 'nu_d', 'nu_d_dot', 'tau', 'disturbance_estimate'
    shapes = np.random.default_rng(1).normal(size=(len(names), SAMPLES, 6))
    facts = {'scenario': 'made', 'controller': 'my own', 'law': 'gvc', 'gains': {}, 'step': 0.01}
    return Run(
        vehicle=load_vehicle('rexrov'), source='bag', t=t, disturbance=None, **facts,
        **dict(zip(names, shapes, strict=True)),
    )  # fmt: skip


def shares_of(run: Run) -> np.ndarray:
    """Shares (n, 6) in per cent of N_i xi_i^2 / 2: M = C C^T, and sqrt(N_i) xi = C^T nu."""
    energy = (run.nu @ np.linalg.cholesky(run.vehicle.M)) ** 2
    return 100.0 * energy / energy.sum(axis=1, keepdims=True)


def test_energy_shares_are_per_cent_of_what_moves() -> None:
    run = made_run()
    found = {(kind, whose): values for kind, whose, values in rerun_export.signals(run, run)}
    assert list(found) == [
        ('velocity', 'my own'), ('velocity', 'setpoint'), ('wrench', 'my own'),
        ('energy_shares', 'my own'),
    ]  # fmt: skip
    assert_allclose(found['energy_shares', 'my own'], shares_of(run), rtol=1e-9)


def test_no_setpoint_is_drawn_where_none_is_known() -> None:
    run = made_run()
    run = replace(run, nu_d=np.full_like(run.nu_d, np.nan))
    assert ('velocity', 'setpoint') not in [s[:2] for s in rerun_export.signals(run, run)]


def test_without_rerun_one_line_says_how_to_get_it(monkeypatch, capsys, tmp_path) -> None:
    monkeypatch.setitem(sys.modules, 'rerun', None)
    with pytest.raises(SystemExit) as ended:
        main(['export-rerun', str(tmp_path)])
    assert ended.value.code == 2
    assert capsys.readouterr().err == (
        'rerun-sdk: expected rerun installed: pip install -r requirements-rerun.txt, '
        'found no such module\n'
    )
    assert not list(tmp_path.iterdir())


def test_an_earlier_file_is_not_replaced_unasked(monkeypatch, capsys, tmp_path) -> None:
    monkeypatch.setattr('auv_analysis.report.rerun_export.library', lambda: None)
    (tmp_path / 'gvc.rrd').touch()
    with pytest.raises(SystemExit) as ended:
        main(['export-rerun', str(tmp_path / 'gvc')])
    assert ended.value.code == 2
    assert 'expected a new file, or --overwrite, found an existing file' in capsys.readouterr().err


def test_out_is_heard_and_the_bag_never_replaced(monkeypatch, capsys, tmp_path) -> None:
    monkeypatch.setattr(rerun_export, 'library', lambda: None)
    monkeypatch.setattr(rerun_export, 'export', lambda _, out: out.write_text('ours') or SAMPLES)
    monkeypatch.setattr('auv_analysis.bag.load.open_bag', lambda _: SimpleNamespace(run=made_run()))
    bag, out = tmp_path / 'gvc.mcap', tmp_path / 'mine.rrd'
    bag.write_text('theirs')
    main(['export-rerun', str(bag), '--out', str(out)])
    assert out.read_text() == 'ours'
    with pytest.raises(SystemExit, match='2'):
        main(['export-rerun', str(bag), '--out', str(bag), '--overwrite'])
    assert bag.read_text() == 'theirs'


@pytest.mark.parametrize(
    ('bag', 'file'),
    [
        ('k_D=0.5', 'k_D=0.5.rrd'),
        ('log.1.mcap', 'log.1.rrd'),
        ('.', 'inner.rrd'),
        ('..', 'outer.rrd'),
    ],
)
def test_the_file_is_named_as_the_bag(monkeypatch, tmp_path, bag: str, file: str) -> None:
    """A dot in the name of a folder begins no ending, and `.` is a folder of another name."""
    monkeypatch.setattr(rerun_export, 'library', lambda: None)
    monkeypatch.setattr(rerun_export, 'export', lambda _, out: out.write_text('ours') or SAMPLES)
    monkeypatch.setattr('auv_analysis.bag.load.open_bag', lambda _: SimpleNamespace(run=made_run()))
    inner = tmp_path / 'outer' / 'inner'
    (inner / 'k_D=0.5').mkdir(parents=True)
    (inner / 'log.1.mcap').touch()
    monkeypatch.chdir(inner)
    main(['export-rerun', bag])
    assert [path.name for path in tmp_path.rglob('*.rrd')] == [file]


def test_a_file_that_cannot_be_is_refused_before_anything_is_written(monkeypatch, tmp_path) -> None:
    monkeypatch.setattr(rerun_export, 'library', lambda: None)
    (tmp_path / 'file').touch()
    with pytest.raises(InputError, match='--out: expected a file that can be written, found '):
        rerun_export.export(made_run(), tmp_path / 'file' / 'made.rrd')


def test_an_export_that_fails_leaves_the_earlier_file_and_no_other(monkeypatch, tmp_path) -> None:
    def fail(*_: object) -> None:
        raise MemoryError

    recording = SimpleNamespace(save=lambda *_, **__: None)
    rerun = SimpleNamespace(RecordingStream=lambda *_, **__: recording)
    monkeypatch.setattr(rerun_export, 'library', lambda: rerun)
    monkeypatch.setattr(rerun_export, '_blueprint', lambda: None)
    monkeypatch.setattr(rerun_export, '_name', fail)
    path = tmp_path / 'made.rrd'
    path.write_text('earlier')
    with pytest.raises(MemoryError):
        rerun_export.export(made_run(), path)
    assert [(one.name, one.read_text()) for one in tmp_path.iterdir()] == [('made.rrd', 'earlier')]


@pytest.mark.parametrize(('law', 'width'), [('gvc', 2.0), ('cl', 1.0)])
def test_each_axis_has_its_colour_and_the_set_point_is_grey_and_thin(
    monkeypatch, law: str, width: float
) -> None:
    logged: dict[str, object] = {}
    rerun = SimpleNamespace(
        ViewCoordinates=SimpleNamespace(FRD='x north, z down'),
        SeriesLines=lambda **look: (look['colors'], look['widths']),
        TransformAxes3D=lambda length: f'{length:g} m',
        new_entity_path='/'.join,
    )
    recording = SimpleNamespace(log=lambda path, what, static: logged.update({path: what}))
    monkeypatch.setattr(rerun_export, 'library', lambda: rerun)
    rerun_export._name(recording, replace(made_run(), law=law))
    expected: dict[str, object] = {
        'trajectory': 'x north, z down', 'trajectory/my own/vehicle': '1 m',
    }  # fmt: skip
    for dof, colour in zip(DOFS, COLOURS, strict=True):
        for quantity in ('velocity', 'wrench', 'energy_shares'):
            expected[f'{quantity}/{dof}/my own'] = ([rgb(colour)], [width])
        expected[f'velocity/{dof}/setpoint'] = ([rgb(GREY)], [1.0])
    assert logged == expected


def rgb(colour: str) -> list[int]:
    return [int(colour[i : i + 2], 16) for i in (1, 3, 5)]


def exported(run: Run, path: Path) -> dict[str, dict[str, list]]:
    """Entity of the file of a run -> component -> its values, by rising time."""
    need('rerun-sdk', find_spec('rerun'))
    assert rerun_export.export(run, path) == SAMPLES
    found: dict[str, list[tuple[float, str, object]]] = {}
    for part in import_module('rerun.chunk').RrdReader(path).stream().to_chunks():
        batch = part.to_record_batch()
        times = [0.0] * len(batch) if part.is_static else batch['t'].cast('int64').to_pylist()
        for name in (name for name in batch.schema.names if ':' in name):
            rows = zip(times, batch[name].to_pylist(), strict=True)
            entity = part.entity_path.replace('\\', '')
            found.setdefault(entity, []).extend((1e-9 * t, name, value) for t, (value,) in rows)
    for rows in found.values():
        rows.sort(key=lambda row: row[0])
    return {
        entity: {name: [(t, value) for t, known, value in rows if known == name]
                 for name in {name for _, name, _ in rows}}
        for entity, rows in found.items()
    }  # fmt: skip


@pytest.fixture
def in_blocks(monkeypatch) -> None:
    monkeypatch.setattr(Run, 'blocks', lambda run: (run.part(slice(i, i + 3)) for i in (0, 3, 6)))


@pytest.mark.usefixtures('in_blocks')
def test_every_sample_is_in_the_file(tmp_path: Path) -> None:
    run, path = made_run(), tmp_path / 'made.rrd'
    found = exported(run, path)
    assert list(tmp_path.iterdir()) == [path]
    for entity, values, units in (
        ('velocity/{}/my own', run.nu, ('m/s', 'rad/s')),
        ('velocity/{}/setpoint', run.nu_d, ('m/s', 'rad/s')),
        ('wrench/{}/my own', run.tau, ('N', 'N m')),
        ('energy_shares/{}/my own', shares_of(run), ('%', '%')),
    ):
        for i, dof in enumerate(DOFS):
            parts = found[f'/{entity.format(dof)}']
            assert_allclose(parts['Scalars:scalars'], np.column_stack([run.t, values[:, i]]))
            ((_, name),) = parts['SeriesLines:names']
            assert name == f'{entity.rpartition("/")[2]} ({units[i // 3]})'


@pytest.mark.usefixtures('in_blocks')
def test_the_vehicle_goes_and_turns_as_in_the_run(monkeypatch, tmp_path: Path) -> None:
    monkeypatch.setattr(rerun_export, 'POINTS', 2)
    run = made_run()
    found = exported(run, tmp_path / 'made.rrd')
    vehicle = found['/trajectory/my own/vehicle']
    places, turns = (vehicle[f'Transform3D:{name}'] for name in ('translation', 'quaternion'))
    assert_allclose([t for t, _ in places], run.t, atol=1e-9)
    assert_allclose([place for _, place in places], run.eta[:, :3], rtol=1e-6)
    expected = Rotation.from_euler('ZYX', run.eta[:, :2:-1]).as_matrix()
    shown = Rotation.from_quat([turn for _, turn in turns]).as_matrix()
    assert_allclose(shown, expected, atol=1e-6)
    assert found['/trajectory']['ViewCoordinates:xyz'] == [(0.0, [FORWARD, RIGHT, DOWN])]
    ((_, line),) = found['/trajectory/my own/path']['LineStrips3D:strips']
    assert_allclose(line, run.eta[::4, :3], rtol=1e-6)
