"""The experiment by which a design is judged: a scenario with the vehicle in it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.design.changed_file import changed_data
from auv_analysis.design.couplings import Sizes, sizes_of
from auv_analysis.design.space import Space
from auv_analysis.runs.run import Hold, Run
from auv_analysis.scenario.scaling import REFERENCE, scaled_case1
from auv_analysis.scenario.scenario import SCHEMA, Scenario, scenario_from
from auv_analysis.simulation.simulate import simulate
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import check, read_text, read_yaml
from auv_gvc_controller.control.sampled import is_compiled

MANY_STEPS = 30_000
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
    space: Space
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
    space = Space.of(data, vehicle_path, own)
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
