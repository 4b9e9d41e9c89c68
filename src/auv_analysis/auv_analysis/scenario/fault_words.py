"""Faults in words and as spans of time, for reports and figures."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from auv_dynamics.plant.faults import RANDOM
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.vehicle import Vehicle

LINES = 4  # below each other, in which numbers of faults stand


class Mark(NamedTuple):
    """A fault as a run shows it.

    Attributes
    ----------
    number : in the scenario's list, from 1
    kind, label : of the fault; in a few words
    start, end : s, inf where it has no end

    """

    number: int
    kind: str
    label: str
    start: float
    end: float

    @property
    def times(self) -> str:
        """From when to when, in words."""
        if math.isinf(self.end):
            return f'from {self.start:g} s on' if self.start else 'throughout'
        return f'{self.start:g}–{self.end:g} s'


def line_of(mark: Mark, marks: Sequence[Mark]) -> int:
    """In which of `LINES` the number of a mark stands: below those that its start finds there."""
    earlier = marks[: mark.number - 1]
    return sum(other.start <= mark.start < other.end for other in earlier) % LINES


def marks_of(specs: Sequence[Mapping[str, Any]], vehicle: Vehicle) -> tuple[Mark, ...]:
    """Marks of the faults of a checked scenario, thrusters by their names."""
    names = vehicle.thrusters.names if vehicle.thrusters else ()
    marks = []
    for number, spec in enumerate(specs, start=1):
        words = dict(spec)
        given = spec.get('thruster')
        if isinstance(given, int | float) and given < len(names):
            words['thruster'] = names[int(given)]
        start, end = float(spec.get('from', 0.0)), float(spec.get('to', math.inf))
        marks.append(Mark(number, str(spec['kind']), label(words), start, end))
    return tuple(marks)


def label(spec: Mapping[str, Any]) -> str:
    """A fault in a few words, for people."""
    kind = spec['kind']
    if kind in RANDOM:
        share = spec.get('probability', 1.0)
        what = 'measurements' if kind == 'sensor_drop_out' else 'wrenches'
        return f'{what} lost' if share >= 1 else f'{100 * share:g} % of the {what} lost'
    if kind == 'sensor_delay':
        return f'measurements {spec["delay"]:g} s late'
    if kind == 'sensor_bias':
        return f'biased {_biased(spec)}'
    device = f'thruster {spec["thruster"]}' if kind == 'thruster' else f'{spec["axis"]} actuator'
    if 'stuck' in spec:
        unit = 'N m' if spec.get('axis') in DOFS[3:] else 'N'
        return f'{device} stuck at {spec["stuck"]:g} {unit}'
    if spec['efficiency'] == 0:
        return f'{device} lost'
    return f'{device} at {100 * spec["efficiency"]:g} %'


def _biased(spec: Mapping[str, Any]) -> str:
    parts = []
    for key, names, units in (
        ('velocity', DOFS, ('m/s',) * 3 + ('rad/s',) * 3),
        ('attitude', DOFS[3:], ('rad',) * 3),
    ):
        values = zip(names, spec.get(key, ()), units, strict=False)
        parts += [
            f'{name}{" angle" if key == "attitude" else ""} {value:+g} {unit}'
            for name, value, unit in values
            if value
        ]
    return ', '.join(parts) or 'by zero'
