"""Scenario file, format 1: one experiment, resolved so that nothing is left to look up."""

import json
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.scenario_devices import Devices
from auv_analysis.scenario_values import (
    NANOSECONDS,
    check_names,
    check_time,
    resolved,
    vehicle_path_of,
)
from auv_dynamics.allocation import Reach, make_reach
from auv_dynamics.config import shipped
from auv_dynamics.files import InputError, check, read_text, read_yaml
from auv_dynamics.nearest import one_of
from auv_dynamics.uncertainty import Uncertainty, make_uncertainty
from auv_dynamics.vehicle import Vehicle
from auv_dynamics.vehicle_file import vehicle_from_dict
from auv_gvc_controller.gains import body_gains, sampling_warning, state_warning
from auv_gvc_controller.laws import make_gains, refusal, try_law
from auv_gvc_controller.model import control_model
from auv_gvc_controller.setpoint import Setpoint, make_setpoint

SCHEMA = Path(__file__).with_name('scenario.schema.json')


@dataclass(frozen=True, eq=False, repr=False)
class Scenario(Devices):
    """A checked scenario.

    Attributes
    ----------
    path : of the scenario file
    vehicle_path : of its vehicle file
    vehicle : what the controller knows; the plant is that plus `uncertainty`
    vehicle_data : the vehicle file's contents
    data : the scenario file's contents with every default filled in
    attachments : name -> text of each file that the scenario consists of

    """

    path: Path
    vehicle_path: Path
    vehicle: Vehicle
    vehicle_data: dict[str, Any]
    data: dict[str, Any]
    attachments: dict[str, str]

    def __repr__(self) -> str:
        """Name, vehicle, controllers and length, in a line."""
        loops = ', '.join(self.controllers)
        return f'<Scenario {self.name}: vehicle {self.vehicle.name}, {loops}, {self.duration:g} s>'

    @property
    def name(self) -> str:
        """Name, which is also that of the results' folder."""
        return self.data['name']

    @property
    def step(self) -> float:
        """Integration step and control period, s."""
        return self.data['step']

    @property
    def step_ns(self) -> int:
        """The same in whole nanoseconds."""
        return round(self.step * NANOSECONDS)

    @property
    def steps(self) -> int:
        """Index n of the last sample; a run has n + 1 of them."""
        return round(self.data['duration'] / self.step)

    @property
    def duration(self) -> float:
        """Length of the run, s."""
        return self.data['duration']

    @property
    def controllers(self) -> dict[str, dict[str, Any]]:
        """Name -> law and gains, in the file's order."""
        return self.data['controllers']

    @property
    def shipped_vehicle(self) -> str | None:
        """Bare name of the vehicle where it is a shipped one."""
        named = self.vehicle_path.with_suffix('').name
        return named if named == self.data['vehicle'] else None

    def controller(self, name: str) -> dict[str, Any]:
        """Law and gains of one controller; InputError when there is none of that name."""
        if name not in self.controllers:
            raise InputError(self.path, 'controllers', one_of(name, self.controllers), name)
        return self.controllers[name]

    def gain_values(self, name: str) -> dict[str, Any]:
        """Gains of one controller as the file gives them."""
        settings = ('law', 'anti_windup')
        return {k: v for k, v in self.controller(name).items() if k not in settings}

    def gains(self, name: str) -> Any:
        """Gains of one controller as the kernel takes them."""
        return make_gains(self.controller(name)['law'], self.gain_values(name))

    def reach(self, name: str) -> Reach:
        """What one controller knows of the actuators, for its anti-windup."""
        if self.controller(name).get('anti_windup', True):
            return self.actuators.reach
        return make_reach(None, None)

    @cached_property
    def setpoint(self) -> Setpoint:
        """nu_d(t) and its derivative."""
        text = self.attachments.get('setpoint.csv')
        return make_setpoint(self.data['setpoint'], self.duration, text)

    @cached_property
    def uncertainty(self) -> Uncertainty:
        """What acts on the plant besides the wrench."""
        specs = self.data['disturbance']
        places = [f'disturbance[{i}]' for i in range(len(specs))]
        return make_uncertainty(self.vehicle, specs, self.path, places)

    @cached_property
    def texts(self) -> tuple[str, str]:
        """Texts that are the same for scenarios whose set-point, or disturbance, is."""
        setpoint = self.data['setpoint'], self.attachments.get('setpoint.csv')
        return json.dumps(setpoint), json.dumps(self.data['disturbance'])

    @property
    def kinds(self) -> frozenset[str]:
        """Kinds of its disturbances."""
        return frozenset(spec['kind'] for spec in self.data['disturbance'])

    @cached_property
    def warnings(self) -> list[str]:
        """What is odd but usable, of the vehicle and of gains for this step, one line each."""
        found = list(self.vehicle.warnings)
        angles = self.data['initial']['eta'][3:5]
        if max(map(abs, angles)) > 2 * math.pi:
            found.append(f'{self.path}: initial.eta: roll and pitch of {angles} rad: degrees?')
        for name in self.controllers:
            gains = self.gains(name)
            K_D, _ = body_gains(gains, control_model(self.vehicle))
            loop = sampling_warning(K_D, self.vehicle.M, self.step)
            for warning in filter(None, (loop, state_warning(gains, self.step))):
                found.append(f'{self.path}: controllers.{name}: {warning}')
        return found

    @property
    def inputs(self) -> list[Path]:
        """Files that the scenario was read from."""
        file = self.data['setpoint'].get('file')
        return [self.path, self.vehicle_path, *([Path(file)] if file else [])]

    @property
    def initial(self) -> tuple[np.ndarray, np.ndarray]:
        """Eta (6,) and nu (6,) at the start."""
        return np.array(self.data['initial']['eta']), np.array(self.data['initial']['nu'])


def load_scenario(scenario: str | Path) -> Scenario:
    """Scenario of a file or of a shipped bare name.

    Parameters
    ----------
    scenario : path of a scenario file, or a bare name such as 'case1'

    Returns
    -------
    scenario : Scenario, checked with its vehicle, gains and set-point file

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    path = shipped('scenarios', scenario)
    data = read_yaml(path, 'scenario')
    check(data, SCHEMA, path)
    vehicle_path = vehicle_path_of(data['vehicle'], path)
    vehicle_data = read_yaml(vehicle_path, 'vehicle')
    texts = {
        'scenario.yaml': read_text(path, 'scenario'),
        'vehicle.yaml': read_text(vehicle_path, 'vehicle'),
    }
    if 'file' in data['setpoint']:
        csv = path.parent / data['setpoint']['file']
        texts['setpoint.csv'] = read_text(csv, 'CSV set-point')
        data['setpoint']['file'] = str(csv.resolve())
    return scenario_from(data, vehicle_data, path, vehicle_path, texts)


def scenario_from(
    data: dict[str, Any],
    vehicle_data: dict[str, Any],
    path: Path,
    vehicle_path: Path,
    attachments: dict[str, str],
) -> Scenario:
    """Scenario of the contents of its files; nothing is read.

    Parameters
    ----------
    data, vehicle_data : contents of a scenario file and of its vehicle file
    path, vehicle_path : of these files, for their names and for errors
    attachments : name -> text of each file; `setpoint.csv` must be there where the set-point is
        a file

    Returns
    -------
    scenario : Scenario, checked

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    check(data, SCHEMA, path)
    data = resolved(data)
    check_names(data, path)
    check_time(data, path)
    vehicle = vehicle_from_dict(vehicle_data, vehicle_path)
    result = Scenario(path, vehicle_path, vehicle, vehicle_data, data, attachments)
    # made and checked now, so that errors come first
    _ = (result.setpoint, result.uncertainty, result.actuators, result.faults)
    for name in result.controllers:
        _check_gains(result, name)
    return result


def _check_gains(scenario: Scenario, name: str) -> None:
    try:
        try_law(scenario.gains(name), control_model(scenario.vehicle))
    except ValueError as error:
        key, expected, found = refusal(error)
        place = f'controllers.{name}.{key or "law"}'
        raise InputError(scenario.path, place, expected, found) from None
