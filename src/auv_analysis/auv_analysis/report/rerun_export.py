"""A run as a file for the rerun viewer: where the vehicle went, and its signals per DOF."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from auv_analysis.metrics.energy import kinetic_energy, shares
from auv_analysis.output.new_files import created, unfinished_name
from auv_analysis.report.plots import COLOURS, GREY
from auv_analysis.runs.run import Run
from auv_dynamics.files.errors import InputError, refusing
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.kinematics import quaternion
from auv_gvc_controller.laws.model import control_model

if TYPE_CHECKING:
    import rerun

APPLICATION = 'auv_gvc'
TRAJECTORY, VELOCITY, WRENCH, SHARES = 'trajectory', 'velocity', 'wrench', 'energy_shares'
UNITS = {VELOCITY: ('m/s', 'rad/s'), WRENCH: ('N', 'N m'), SHARES: ('%', '%')}
SETPOINT = 'setpoint'
POINTS = 10_000  # of the line of a trajectory, at most


def library() -> Any:
    """The module of rerun's SDK; InputError where it is not installed."""
    try:
        import rerun
    except ImportError:
        expected = 'rerun installed: pip install -r requirements-rerun.txt'
        raise InputError('rerun-sdk', '', expected, 'no such module') from None
    return rerun


def export(run: Run, path: Path) -> int:
    """Write a run; files of several controllers of a scenario open as one.

    Parameters
    ----------
    run : of `simulate`, `load_run` or `open_bag`
    path : of the file, replaced once the new one is whole

    Returns
    -------
    samples : how many were written

    Raises
    ------
    InputError : rerun is not installed, or the file cannot be written

    """
    rr = library()
    unfinished = unfinished_name(path)
    with refusing(path, '--out', 'a file that can be written'):
        path.parent.mkdir(parents=True, exist_ok=True)
        created(unfinished).close()  # rerun writes to a name
    try:
        recording = rr.RecordingStream(APPLICATION, recording_id=run.scenario)
        recording.save(unfinished, default_blueprint=_blueprint())
        _name(recording, run)
        samples = _send(recording, run)
        recording.flush()
        recording.disconnect()
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
    return samples


def signals(run: Run, block: Run) -> Iterator[tuple[str, str, np.ndarray]]:
    """Quantity, whose it is and its values (n, 6), body frame: m/s, rad/s; N, N m; %."""
    model = control_model(run.vehicle)
    yield VELOCITY, run.controller, block.nu
    if run.knows_setpoint:
        yield VELOCITY, SETPOINT, block.nu_d
    yield WRENCH, run.controller, block.tau
    energy = kinetic_energy(model.Upsilon_inv.reshape(6, 6), model.N, block.nu)
    yield SHARES, run.controller, shares(energy)


def _path(*parts: str) -> str:
    """Path of an entity; whatever a controller is called, it is one part of it."""
    return str(library().new_entity_path(list(parts)))


def _numbers(colour: str) -> list[int]:
    """Red, green and blue of #rrggbb."""
    return list(bytes.fromhex(colour[1:]))


def _name(recording: 'rerun.RecordingStream', run: Run) -> None:
    """Static parts: axes, colours, names and widths of lines."""
    rr = library()
    recording.log(TRAJECTORY, rr.ViewCoordinates.FRD, static=True)  # as NED: x north, z down
    width = 2.0 if run.law == 'gvc' else 1.0
    for quantity, units in UNITS.items():
        for i, dof in enumerate(DOFS):
            lines = [(run.controller, COLOURS[i], width)]
            if quantity == VELOCITY and run.knows_setpoint:
                lines.append((SETPOINT, GREY, 1.0))
            for whose, colour, thick in lines:
                label = f'{whose} ({units[i // 3]})'
                look = rr.SeriesLines(colors=[_numbers(colour)], widths=[thick], names=[label])
                recording.log(_path(quantity, dof, whose), look, static=True)
    axes = rr.TransformAxes3D(1.0)
    recording.log(_path(TRAJECTORY, run.controller, 'vehicle'), axes, static=True)


def _send(recording: 'rerun.RecordingStream', run: Run) -> int:
    rr, count, line = library(), 0, []
    every = -(-run.samples // POINTS)
    for block in run.blocks():
        times = [rr.TimeColumn('t', duration=block.t)]
        for quantity, whose, values in signals(run, block):
            for i, dof in enumerate(DOFS):
                columns = rr.Scalars.columns(scalars=np.ascontiguousarray(values[:, i]))
                recording.send_columns(_path(quantity, dof, whose), times, columns)
        position, turned = block.eta[:, :3], quaternion(block.eta[:, 3:])
        moved = rr.Transform3D.columns(translation=position, quaternion=np.roll(turned, -1, axis=1))
        recording.send_columns(_path(TRAJECTORY, run.controller, 'vehicle'), times, moved)
        line.append(position[-count % every :: every])
        count += len(block.t)
    colour = COLOURS[0] if run.law == 'gvc' else COLOURS[4]
    path = rr.LineStrips3D(
        [np.concatenate(line)], labels=[run.controller], colors=[_numbers(colour)]
    )
    recording.log(_path(TRAJECTORY, run.controller, 'path'), path, static=True)
    return count


def _blueprint() -> Any:
    """A view of the trajectories, and a tab per quantity with a view per degree of freedom."""
    import rerun.blueprint as rrb

    def views(quantity: str) -> Any:
        each = (rrb.TimeSeriesView(origin=f'/{quantity}/{dof}', name=dof) for dof in DOFS)
        return rrb.Grid(*each, grid_columns=3, name=quantity.replace('_', ' '))

    trajectory = rrb.Spatial3DView(origin=f'/{TRAJECTORY}', name=TRAJECTORY)
    return rrb.Blueprint(rrb.Vertical(trajectory, rrb.Tabs(*map(views, UNITS))))
