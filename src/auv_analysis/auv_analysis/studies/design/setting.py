"""The experiment by which a design is judged: a scenario with the vehicle in it."""

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.output.text import join, number, plain
from auv_analysis.runs.run import Hold, Run
from auv_analysis.scenario.scaling import REFERENCE, scaled_case1
from auv_analysis.scenario.scenario import Scenario, load_scenario, scenario_from
from auv_analysis.scenario.scenario import write_inputs as write_files
from auv_analysis.simulation.simulate import simulate
from auv_analysis.studies.design.change import ChangeSpace, disc_mass, normal_of, parts_of, spread
from auv_analysis.studies.design.prediction import Sizes, sizes_of
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import check, matrix6, read_text, read_yaml, yaml_text
from auv_dynamics.plant.parameters import SCHEMA
from auv_gvc_controller.control.sampled_law import is_compiled

PREFIX = 'design_'  # of its name: nobody shall take it for the vehicle that it came from
WAYS = (('forward', 'aft'), ('to starboard', 'to port'), ('down', 'up'))
PLACES = (('forward', 'aft'), ('to starboard', 'to port'), ('below', 'above'))
ORIGIN = 'the reference point'  # origin of the body frame
ALIGNED = np.radians(0.5)  # less than this from an axis is along it
NEAR = 5e-4  # of a unit vector: not worth a word


def changed_data(space: ChangeSpace, x: np.ndarray, words: str = '') -> dict[str, Any]:
    """Contents of the file of a changed vehicle.

    Parameters
    ----------
    space : of the vehicle
    x : (13,) real, within bounds
    words : that tell the change, for `source`

    Returns
    -------
    data : of a vehicle file; `vehicle_from_dict` makes of it the vehicle of `space.effect(x)`

    """
    data = copy.deepcopy(dict(space.data))
    if not np.any(x[[0, 1, 2, 3, 7]]):
        return data
    data['name'] = f'{PREFIX}{data["name"]}'
    parts = (data.get('source', ''), f'changed by auv design: {words or "see the parameters"}')
    data['source'] = '; '.join(filter(None, parts))
    _set_inertia(data, space, x)
    _set_rigid_body(data, space, x)
    _set_water(data, space, x)
    return data


def changed_text(data: dict[str, Any], about: str) -> str:
    """Text of the file, every number in full; `about` lines stand in its comment."""
    comment = ''.join(f'# {line}\n' for line in about.splitlines())
    body = yaml_text(data, width=110, allow_unicode=True)
    return comment + body


def _set_inertia(data: dict[str, Any], space: ChangeSpace, x: np.ndarray) -> None:
    """M itself, or M_A of the file's sign convention where there is a disc."""
    if 'inertia_matrix' in data:
        data['inertia_matrix'] = (space.vehicle.M + space.effect(x).M).tolist()
    elif x[7] > 0 and space.vehicle.M_A is not None:
        alone = np.where(np.arange(len(x)) < 7, 0.0, x)
        M_A = space.vehicle.M_A + space.effect(alone).M
        data['added_mass'] = (_sign(data) * M_A).tolist()
    if x[7] > 0:
        quadratic = matrix6(data['damping']['quadratic'])
        quadratic += _sign(data) * np.diag(space.effect(x).drag)
        diagonal = np.ndim(data['damping']['quadratic']) == 1
        data['damping']['quadratic'] = (np.diag(quadratic) if diagonal else quadratic).tolist()


def _set_rigid_body(data: dict[str, Any], space: ChangeSpace, x: np.ndarray) -> None:
    """Mass, its centre and the tensor about the point that the file gives it for."""
    body = data['rigid_body']
    mass, ballast, at, moved = space.mass, float(x[3]), x[4:7], space.vehicle.r_G + x[:3]
    r_G = (mass * moved + ballast * at) / (mass + ballast)
    if 'inertia' in body:
        about_gravity = body['inertia_reference'] == 'cg'
        tensor = np.array(body['inertia'], float)
        tensor = (tensor + tensor.T) / 2
        if about_gravity:
            tensor += spread(mass, moved - r_G) + spread(ballast, at - r_G)
        else:
            added = spread(mass, moved) - spread(mass, space.vehicle.r_G)
            tensor += added + spread(ballast, at)
        if ballast or not about_gravity:
            body['inertia'] = tensor.tolist()
    body['mass'], body['center_of_gravity'] = mass + ballast, r_G.tolist()


def _set_water(data: dict[str, Any], space: ChangeSpace, x: np.ndarray) -> None:
    """Foam at the ballast that carries its weight."""
    if x[3] > 0:
        water, foam = data['hydrostatics'], float(x[3]) / space.density
        volume = water['volume'] + foam
        r_B = (water['volume'] * space.vehicle.r_B + foam * x[4:7]) / volume
        water['volume'], water['center_of_buoyancy'] = volume, r_B.tolist()


def _sign(data: dict[str, Any]) -> float:
    return -1.0 if data.get('sign') == 'sname' else 1.0


def change_words(space: ChangeSpace, x: np.ndarray) -> list[str]:
    """Instructions for the change, a phrase for each part; none where nothing is changed."""
    phrases = {'shift': _shift, 'ballast': _ballast, 'disc': _disc}
    return [phrases[part](space, x) for part in parts_of(x)]


def _shift(_: ChangeSpace, x: np.ndarray) -> str:
    ways = [
        f'{plain(abs(d), 4)} m {names[d < 0]}'
        for d, names in zip(x[:3].tolist(), WAYS, strict=True)
        if d
    ]
    return f'move the centre of gravity {join(ways)}'


def _ballast(_: ChangeSpace, x: np.ndarray) -> str:
    return f'add {number(x[3])} kg of ballast {_place(x[4:7])}, trimmed by foam at the same place'


def _disc(space: ChangeSpace, x: np.ndarray) -> str:
    mass = float(disc_mass(x[7], space.density))
    normal = normal_of(x[11], x[12])
    normal = normal * np.sign(normal[int(np.argmax(np.abs(normal)))])  # a disc has two of them
    return (
        f'fit a thin circular plate of {number(2 * x[7])} m diameter, {_place(x[8:11])}, '
        f'{_facing(normal)} ({number(mass)} kg of added mass)'
    )


def _place(r: np.ndarray) -> str:
    """Where a part goes, seen from the reference point."""
    ways = [
        f'{plain(round(abs(float(v)), 3), 4)} m {names[int(v < 0)]}'
        for v, names in zip(r, PLACES, strict=True)
        if abs(v) >= NEAR
    ]
    return f'{join(ways)}, seen from {ORIGIN}' if ways else f'at {ORIGIN}'


def _facing(normal: np.ndarray) -> str:
    """Direction of a plate, its largest part positive: the nearest axis, and the angle to it."""
    main = int(np.argmax(normal))
    text = f'facing {WAYS[main][0]}'
    angle = float(np.arccos(min(normal[main], 1.0)))
    if angle < ALIGNED:
        return text
    ways = [
        WAYS[i][int(normal[i] < 0)]
        for i in range(3)
        if i != main and abs(normal[i]) >= np.sin(ALIGNED)
    ]
    numbers = ', '.join('0' if abs(v) < NEAR else plain(round(float(v), 3), 3) for v in normal)
    return f'{text}, turned {np.degrees(angle):.1f}° {join(ways)}, its normal ({numbers})'


MANY_STEPS = 30_000
LONGEST = 92  # of a scenario's name, with room for the word behind it
LAW = 'gvc'  # the first controller of this law is the one that a design is judged by


@dataclass(frozen=True, eq=False)
class Setting:
    """A scenario, the vehicle in it and the changes of that vehicle.

    Attributes
    ----------
    scenario : with the unchanged vehicle
    space : of its changes

    """

    scenario: Scenario
    space: ChangeSpace

    @property
    def controller(self) -> str:
        """Name of the controller whose run decides: the first under GVC, else the first."""
        laws = {name: spec['law'] for name, spec in self.scenario.controllers.items()}
        return next((name for name, law in laws.items() if law == LAW), next(iter(laws)))

    @property
    def hold(self) -> Hold:
        """'continuous', but 'zoh' where actuators, sensors or faults act on samples."""
        return 'zoh' if self.scenario.sampled else 'continuous'

    @property
    def is_quick(self) -> bool:
        """Whether some dozens of runs take seconds: a compiled law, and not too many steps."""
        one = self.scenario
        return is_compiled(one.gains(self.controller)) and one.steps <= MANY_STEPS

    def simulated(self, x: np.ndarray) -> tuple[Run, Sizes]:
        """Run of a changed vehicle and the sizes of its couplings."""
        one, data = self.scenario, changed_data(self.space, x)
        made = scenario_from(one.data, data, one.path, one.vehicle_path, one.attachments)
        run = simulate(made, self.controller, self.hold)
        return run, sizes_of(run, np.linalg.inv(self.space.vehicle.M))


def open_setting(
    vehicle: str, scenario: str | None, own: Sequence[tuple[str, float, float]] = ()
) -> Setting:
    """Setting of the command line.

    Parameters
    ----------
    vehicle : a vehicle file, or the bare name of a shipped one
    scenario : a scenario, whose vehicle is replaced; none: case1 scaled to the vehicle, of
        herman2018 case1 itself
    own : bounds in place of the usual ones, see `parameters_of`

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    vehicle_path = shipped('vehicles', vehicle)
    text = read_text(vehicle_path, 'vehicle')
    data = read_yaml(vehicle_path, 'vehicle')
    space = ChangeSpace.of(data, vehicle_path, own)
    path, contents = _contents(vehicle, scenario)
    attachments = {'vehicle.yaml': text}
    file = contents['setpoint'].get('file')
    if file is not None:
        csv = path.parent / file
        attachments['setpoint.csv'] = read_text(csv, 'CSV set-point')
        contents['setpoint'] = {'file': str(csv.resolve())}
    contents['vehicle'] = str(vehicle_path.resolve())
    return Setting(scenario_from(contents, data, path, vehicle_path, attachments), space)


def _contents(vehicle: str, scenario: str | None) -> tuple[Path, dict[str, Any]]:
    """Path of the scenario file and its contents; of the scaled case1, the path of case1."""
    name = scenario if scenario is not None else 'case1'
    path = shipped('scenarios', name)
    is_reference = shipped('vehicles', vehicle).samefile(shipped('vehicles', REFERENCE))
    if scenario is None and not is_reference:
        return path, scaled_case1(vehicle)
    contents = read_yaml(path, 'scenario')
    check(contents, SCHEMA, path)
    return path, contents


def write_inputs(setting: Setting, x: np.ndarray | None, target: str, out: Path) -> Scenario:
    """Write both vehicles and the scenario with the changed one, and read that back.

    Parameters
    ----------
    setting : the experiment
    x : (13,) the change; None: there is none
    target : the coupling that it is made against
    out : folder

    """
    one = setting.scenario
    text = one.attachments['vehicle.yaml']
    (out / 'vehicle_before.yaml').write_text(text, encoding='utf-8')
    if x is not None:
        words = '; '.join(change_words(setting.space, x))
        about = (
            f'{setting.space.vehicle.name}, changed by auv design against {target}: {words}.\n'
            'vehicle_before.yaml beside it is the vehicle as it was, with its comments.'
        )
        text = changed_text(changed_data(setting.space, x, words), about)
    changed = replace(
        one, path=Path(one.name), data={**one.data, 'name': f'{one.name[:LONGEST]}_changed'},
        attachments={**one.attachments, 'vehicle.yaml': text},
    )  # fmt: skip
    return load_scenario(write_files(changed, out)['scenario.yaml'])
