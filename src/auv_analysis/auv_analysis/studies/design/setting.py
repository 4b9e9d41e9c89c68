"""The experiment by which a design is judged: a scenario with the vehicle in it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from auv_analysis.runs.run import Hold, Run
from auv_analysis.scenario.scaling import REFERENCE, scaled_case1
from auv_analysis.scenario.scenario import Scenario, load_scenario, scenario_from
from auv_analysis.simulation.simulate import simulate
from auv_analysis.studies.design.change import ChangeSpace
from auv_analysis.studies.design.couplings import Sizes, sizes_of
from auv_analysis.studies.design.vehicle_file import change_words, changed_data, changed_text
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import check, read_text, read_yaml
from auv_dynamics.plant.parameters import SCHEMA
from auv_gvc_controller.control.sampled import is_compiled

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
    vehicle_text : of the unchanged vehicle's file
    inputs : files that were read

    """

    scenario: Scenario
    space: ChangeSpace
    vehicle_text: str
    inputs: tuple[Path, ...]

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

    def with_vehicle(self, data: Mapping[str, Any]) -> Scenario:
        """The same scenario with another vehicle, checked as if it had been written so."""
        one = self.scenario
        return scenario_from(one.data, dict(data), one.path, one.vehicle_path, one.attachments)

    def simulated(self, x: np.ndarray) -> tuple[Run, Sizes]:
        """Run of a changed vehicle and the sizes of its couplings."""
        run = simulate(self.with_vehicle(changed_data(self.space, x)), self.controller, self.hold)
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
    made = scenario_from(contents, data, path, vehicle_path, attachments)
    return Setting(made, space, text, tuple(made.inputs))


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
    (out / 'vehicle_before.yaml').write_text(setting.vehicle_text, encoding='utf-8')
    text = setting.vehicle_text
    if x is not None:
        words = '; '.join(change_words(setting.space, x))
        about = (
            f'{setting.space.vehicle.name}, changed by auv design against {target}: {words}.\n'
            'vehicle_before.yaml beside it is the vehicle as it was, with its comments.'
        )
        text = changed_text(changed_data(setting.space, x, words), about)
    (out / 'vehicle.yaml').write_text(text, encoding='utf-8')
    data = dict(setting.scenario.data)
    data['vehicle'] = 'vehicle.yaml'
    data['name'] = f'{data["name"][:LONGEST]}_changed'
    if 'setpoint.csv' in setting.scenario.attachments:
        data['setpoint'] = {'file': 'setpoint.csv'}
        csv = setting.scenario.attachments['setpoint.csv']
        (out / 'setpoint.csv').write_text(csv, encoding='utf-8')
    header = f'# {setting.scenario.name} with the vehicle beside it, every default filled in\n'
    body = yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=100)
    (out / 'scenario.yaml').write_text(header + body, encoding='utf-8')
    return load_scenario(out / 'scenario.yaml')
