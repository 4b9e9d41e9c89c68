"""Scenario file, format 1: one experiment, resolved so that nothing is left to look up."""

import copy
import json
import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.output.folder import NAMES, ROLLOUTS, STAGING
from auv_analysis.scenario.fault_words import Mark, marks_of
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import one_of
from auv_dynamics.files.shipped import shipped, shipped_by_name
from auv_dynamics.files.yaml_files import check, parse_yaml, read_text, yaml_text
from auv_dynamics.plant.actuators import Actuators, make_actuators
from auv_dynamics.plant.devices import SensorNoise
from auv_dynamics.plant.faults import FaultRows, Faults, FaultSetting, make_faults
from auv_dynamics.plant.parameters import SCHEMA
from auv_dynamics.plant.uncertainty import Uncertainty, make_uncertainty
from auv_dynamics.ros.interface import NANOSECONDS, time_grid
from auv_dynamics.vehicle.thrusters import AttainableWrench, make_reach
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict
from auv_gvc_controller.control.gains import body_gains, sampling_warning, state_warning
from auv_gvc_controller.control.setpoint import Setpoint, make_setpoint
from auv_gvc_controller.laws import OPEN_LOOP
from auv_gvc_controller.laws.law import make_gains, refusal, try_law
from auv_gvc_controller.laws.model import control_model
from auv_gvc_controller.laws.multisine import MOST, multisine_gains

SETTINGS = ('law', 'anti_windup')  # of a controller, which are no gains
MOST_STEPS = 10_000_000  # some 10 GB of arrays


def resolved(data: dict[str, Any]) -> dict[str, Any]:
    """Copy of a checked scenario's contents with every default filled in."""
    data = copy.deepcopy(data)
    for key, value in (('format', 1), ('integrator', 'ode5'), ('seed', 0), ('initial', {})):
        data.setdefault(key, value)
    data['seed'] = int(data['seed'])
    data['duration'], data['step'] = float(data['duration']), float(data['step'])
    for key in ('eta', 'nu'):
        data['initial'][key] = [float(x) for x in data['initial'].get(key, [0.0] * 6)]
    disturbance = data.get('disturbance', [])
    data['disturbance'] = disturbance if isinstance(disturbance, list) else [disturbance]
    if data.get('faults') == []:
        del data['faults']
    return data


def check_names(names: Iterable[str], path: Path, endings: Sequence[str] = ('',)) -> None:
    """Refuse a controller whose results, of these endings, would take the place of our own."""
    for name in names:
        if any(f'{name}{ending}' in (*NAMES, STAGING, ROLLOUTS) for ending in endings):
            expected = 'names that are not those of our own files'
            raise InputError(path, 'controllers', expected, name)


def check_time(data: dict[str, Any], path: Path) -> None:
    """Refuse a step that is no whole number of ns, and a duration that is no multiple of it."""
    steps = time_grid(data['step'], data['duration'], path).last or 0
    if steps > MOST_STEPS:
        raise InputError(path, 'duration', f'at most {MOST_STEPS} steps', f'{steps}')


def check_excitation(data: dict[str, Any], path: Path) -> None:
    """Refuse an open loop without its wrench or with gains, and a wrench that no law follows."""
    followers = [name for name, entry in data['controllers'].items() if entry['law'] == OPEN_LOOP]
    if followers and 'excitation' not in data:
        expected = f'a mapping of degrees of freedom, the wrench of the law {OPEN_LOOP}'
        raise InputError(path, 'excitation', expected, None)
    for name in followers:
        for key in set(data['controllers'][name]) - set(SETTINGS):
            expected = 'no gains beside the law: excitation is its wrench'
            raise InputError(path, f'controllers.{name}', expected, key)
    if 'excitation' in data and not followers:
        expected = f'one of law {OPEN_LOOP}, which follows excitation'
        raise InputError(path, 'controllers', expected, ', '.join(data['controllers']))
    for dof, entry in data.get('excitation', {}).items():
        count = len(entry.get('terms', ()))
        if count > MOST:
            raise InputError(path, f'excitation.{dof}.terms', f'at most {MOST} terms', f'{count}')


def vehicle_path_of(vehicle: str, scenario: Path) -> Path:
    """Path of a vehicle as a scenario file names it: relative to it, absolute or a bare name."""
    relative = scenario.parent / vehicle
    is_path = Path(vehicle).suffix in ('.yaml', '.yml') or len(Path(vehicle).parts) != 1
    if os.path.isfile(relative) or is_path:
        return relative
    try:
        return shipped_by_name('vehicles', vehicle)
    except InputError as error:
        raise InputError(scenario, 'vehicle', error.expected, vehicle) from None


SAMPLED = ('actuators', 'sensors', 'faults')  # keys of a scenario that act on samples


@dataclass(frozen=True, eq=False, repr=False)
class Scenario:
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
        name = self.data['vehicle']
        return name if self.vehicle_path.name == f'{name}.yaml' else None

    def controller(self, name: str) -> dict[str, Any]:
        """Law and gains of one controller; InputError when there is none of that name."""
        if name not in self.controllers:
            raise InputError(self.path, 'controllers', one_of(name, self.controllers), name)
        return self.controllers[name]

    def gain_values(self, name: str) -> dict[str, Any]:
        """Gains of one controller as the file gives them."""
        if self.controller(name)['law'] == OPEN_LOOP:
            return multisine_gains(self.data['excitation'])
        return {k: v for k, v in self.controller(name).items() if k not in SETTINGS}

    def gains(self, name: str) -> Any:
        """Gains of one controller as the kernel takes them."""
        return make_gains(self.controller(name)['law'], self.gain_values(name))

    def reach(self, name: str) -> AttainableWrench:
        """A controller's knowledge of the actuators, for its anti-windup."""
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
        """Disturbances and model errors of the plant."""
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
        """Warnings on the vehicle and on gains for this step, one line each."""
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

    @cached_property
    def actuators(self) -> Actuators:
        """Between the command and the applied wrench."""
        return make_actuators(
            self.data.get('actuators'), self.vehicle, self.data['step'], self.path
        )

    @cached_property
    def faults(self) -> Faults:
        """Faults of sensors, actuators and links."""
        specs, step = self.data.get('faults', []), self.data['step']
        allocated = self.data.get('actuators', {}).get('thrusters', False)
        vehicle, thrusters = self.vehicle, self.vehicle.thrusters
        setting = FaultSetting(
            step, self.data['duration'], thrusters, allocated, vehicle.name, self.path
        )
        return make_faults(specs, [f'faults[{i}]' for i in range(len(specs))], setting)

    @property
    def marks(self) -> tuple[Mark, ...]:
        """The faults in words and times."""
        return marks_of(self.data.get('faults', []), self.vehicle)

    @property
    def senses(self) -> bool:
        """Whether the controllers see measurements in place of the true state."""
        return 'sensors' in self.data or self.faults.sensing

    @property
    def acts(self) -> bool:
        """Whether another wrench may be applied than the command."""
        return 'actuators' in self.data or self.faults.acting

    @property
    def sampled(self) -> list[str]:
        """Keys of what acts on samples, and so takes a zero-order hold."""
        return [key for key in SAMPLED if key in self.data]

    def noise(self, seed: int | None = None) -> SensorNoise | None:
        """Random numbers of the sensors from the first sample on; None: they are perfect."""
        if not self.senses:
            return None
        seed = self.data['seed'] if seed is None else seed
        return SensorNoise(self.data.get('sensors', {}), seed, self.faults)

    def fault_rows(self, seed: int | None = None) -> FaultRows | None:
        """Faults of a run from the first sample on; None where there are none."""
        if not self.faults.entries:
            return None
        return FaultRows(self.faults, self.data['seed'] if seed is None else seed)

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
    texts = {'scenario.yaml': read_text(path, 'scenario')}
    data = parse_yaml(texts['scenario.yaml'], path, 'scenario')
    check(data, SCHEMA, path)
    vehicle_path = vehicle_path_of(data['vehicle'], path)
    texts['vehicle.yaml'] = read_text(vehicle_path, 'vehicle')
    vehicle_data = parse_yaml(texts['vehicle.yaml'], vehicle_path, 'vehicle')
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
    check_names(data['controllers'], path)
    check_time(data, path)
    check_excitation(data, path)
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


def write_inputs(scenario: Scenario, out: Path) -> dict[str, Path]:
    """Write the resolved scenario and its files into the results' folder: name -> path."""
    files = dict(scenario.attachments)
    resolved = {**scenario.data, 'vehicle': 'vehicle.yaml'}
    if 'setpoint.csv' in files:
        resolved['setpoint'] = {'file': 'setpoint.csv'}
    header = f'# {scenario.path.name} with every default filled in\n'
    files['scenario.yaml'] = header + yaml_text(resolved)
    paths = {}
    for name, text in files.items():
        paths[name] = out / name
        paths[name].write_text(text, encoding='utf-8')
    return paths
