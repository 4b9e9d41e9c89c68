"""Sensors, actuators and faults of a scenario: what stands between its plant and its laws."""

from functools import cached_property
from pathlib import Path
from typing import Any

from auv_analysis.fault_words import Mark, marks_of
from auv_dynamics.actuators import Actuators, make_actuators
from auv_dynamics.fault_checks import FaultSetting, make_faults
from auv_dynamics.fault_rows import FaultRows
from auv_dynamics.faults import Faults
from auv_dynamics.sensors import SensorNoise
from auv_dynamics.vehicle import Vehicle

SAMPLED = ('actuators', 'sensors', 'faults')  # keys of a scenario that act on samples


class Devices:
    """The part of a `Scenario` that its keys `actuators`, `sensors` and `faults` make."""

    path: Path
    vehicle: Vehicle
    data: dict[str, Any]

    @cached_property
    def actuators(self) -> Actuators:
        """Between the command and the applied wrench."""
        return make_actuators(
            self.data.get('actuators'), self.vehicle, self.data['step'], self.path
        )

    @cached_property
    def faults(self) -> Faults:
        """What fails of sensors, actuators and links."""
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
