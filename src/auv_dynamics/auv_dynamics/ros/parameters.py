"""ROS parameters: declared with description and range, read-only unless said, unknown refused."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from auv_dynamics.files import nearest
from auv_dynamics.files.errors import InputError
from auv_dynamics.plant.signals import harmonic_spec
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.ros.private import declared, overrides
from auv_dynamics.vehicle import DOFS

LONGEST = 1e9  # s of a step or a run: stamps end in 2038
KNOWN_TO_ALL = ('use_sim_time', 'start_type_description_service')
TYPE_WORDS = {
    Parameter.Type.BOOL: 'true or false',
    Parameter.Type.INTEGER: 'a whole number',
    Parameter.Type.DOUBLE: 'a number',
    Parameter.Type.STRING: 'a word',
    Parameter.Type.DOUBLE_ARRAY: 'a list of numbers',
    Parameter.Type.STRING_ARRAY: 'a list of words',
}
TYPES = {
    bool: Parameter.Type.BOOL,
    int: Parameter.Type.INTEGER,
    float: Parameter.Type.DOUBLE,
    str: Parameter.Type.STRING,
    list[float]: Parameter.Type.DOUBLE_ARRAY,
    list[str]: Parameter.Type.STRING_ARRAY,
}


def given(node: Node, prefix: str = '') -> list[str]:
    """Names of the parameters that the user gave and that begin with `prefix`."""
    return sorted(name for name in overrides(node) if name.startswith(prefix))


def declare(
    node: Node,
    name: str,
    kind: Any,
    default: Any,
    description: str,
    *,
    at_least: float | None = None,
    at_most: float | None = None,
    one_of: Sequence[str] = (),
    writable: bool = False,
) -> Any:
    """Declare a parameter and return its value.

    Parameters
    ----------
    node : that declares it
    name : of the parameter
    kind : bool, int, float, str, list[float] or list[str]
    default : value when none is given; None leaves it unset and returns None
    description : one line, with the unit
    at_least, at_most : range of numbers
    one_of : the words that are accepted
    writable : taken at run time, else read-only

    Raises
    ------
    InputError : wrong type or out of range

    """
    _coerce(node, name, kind)
    if default is None:
        _leave_unset(node, name)
    descriptor = ParameterDescriptor(description=description, read_only=not writable)
    if one_of:
        descriptor.additional_constraints = f'one of {", ".join(one_of)}'
    if at_least is not None or at_most is not None:
        _set_range(descriptor, kind, at_least, at_most)
    try:
        if default is None:
            node.declare_parameter(name, TYPES[kind], descriptor)
            value = node.get_parameter_or(name, Parameter(name)).value
        else:
            value = node.declare_parameter(name, default, descriptor).value
    except InvalidParameterTypeException:
        found = overrides(node)[name].value
        raise InputError(node.get_name(), name, TYPE_WORDS[TYPES[kind]], found) from None
    except InvalidParameterValueException:
        found = overrides(node)[name].value
        expected = f'{at_least if at_least is not None else "-inf"} to {at_most or "inf"}'
        raise InputError(node.get_name(), name, f'a number from {expected}', found) from None
    if one_of and value not in one_of:
        raise InputError(node.get_name(), name, nearest.one_of(value, one_of), value)
    if value is None and (default is not None or name in overrides(node)):
        raise InputError(node.get_name(), name, TYPE_WORDS[TYPES[kind]], None)
    if hasattr(value, 'tolist'):
        value = value.tolist()
    value = list(value) if isinstance(value, Sequence) and not isinstance(value, str) else value
    numbers: Any = value if isinstance(value, list) else [value]
    if kind in (float, list[float]) and value is not None and not all(map(math.isfinite, numbers)):
        raise InputError(node.get_name(), name, 'finite numbers', value)
    return value


class Grid(NamedTuple):
    """The steps of a run.

    Attributes
    ----------
    step : s
    step_ns : the same in ns
    duration : s, 0: no end
    last : number of the last step, None: no end

    """

    step: float
    step_ns: int
    duration: float
    last: int | None


def declare_grid(node: Node) -> Grid:
    """Declare `step` and `duration`; InputError where they make no grid of whole nanoseconds."""
    step = declare(node, 'step', float, 0.01, 'time step, s', at_least=1e-9, at_most=LONGEST)
    duration = declare(
        node,
        'duration',
        float,
        0.0,
        'length of the run, s; 0: no end',
        at_least=0.0,
        at_most=LONGEST,
    )
    step_ns = round(step * NANOSECONDS)
    if abs(step_ns - step * NANOSECONDS) > 1e-6 * max(1.0, step):
        raise InputError(node.get_name(), 'step', 'a whole number of nanoseconds', step)
    last = round(duration / step) if duration else None
    if last is not None and abs(duration / step - last) > 1e-9 * last:
        raise InputError(node.get_name(), 'duration', f'a multiple of step ({step} s)', duration)
    return Grid(step, step_ns, duration, last)


def harmonic_parameters(
    node: Node, prefix: str, unit: str, axes: tuple[str, ...] = DOFS
) -> dict[str, Any]:
    """Declare `<prefix><axis>.{offset, amplitude, omega, phase}` and return them as a mapping."""
    columns: dict[str, Any] = {}
    for axis in axes:
        columns[f'{axis}.offset'] = declare(
            node, f'{prefix}{axis}.offset', float, 0.0, f'constant part of {axis}, {unit}'
        )
        for key, what in (
            ('amplitude', f'amplitude, {unit}'),
            ('omega', 'angular frequency, rad/s'),
            ('phase', 'phase, rad'),
        ):
            text = f'{what}, of each sinusoid of {axis}'
            values = declare(node, f'{prefix}{axis}.{key}', list[float], None, text)
            columns[f'{axis}.{key}'] = values or []
    try:
        spec = harmonic_spec(columns, axes)
    except ValueError as error:
        raise InputError(node.get_name(), prefix.rstrip('.'), str(error), 'other lengths') from None
    return {axis: entry for axis, entry in spec.items() if entry['offset'] or entry['terms']}


def _coerce(node: Node, name: str, kind: Any) -> None:
    """Take whole numbers where numbers are expected: `-p duration:=30` is not an error."""
    override = overrides(node).get(name)
    if override is None:
        return
    if kind is float and override.type_ == Parameter.Type.INTEGER:
        value: Any = float(override.value)
    elif kind == list[float] and override.type_ == Parameter.Type.INTEGER_ARRAY:
        value = [float(number) for number in override.value]
    elif kind == list[float] and override.type_ in (Parameter.Type.INTEGER, Parameter.Type.DOUBLE):
        value = [float(override.value)]
    elif kind == list[float] and override.type_ == Parameter.Type.DOUBLE_ARRAY:
        value = [float(number) for number in override.value]
    else:
        return
    overrides(node)[name] = Parameter(name, value=value)


def _leave_unset(node: Node, name: str) -> None:
    """Take `null`, as `ros2 param dump` writes what is not set, and `[]` for no value."""
    override = overrides(node).get(name)
    if override is not None and override.value in (None, 'null'):
        del overrides(node)[name]


def _set_range(
    descriptor: ParameterDescriptor, kind: Any, at_least: float | None, at_most: float | None
) -> None:
    low = at_least if at_least is not None else -1e308
    high = at_most if at_most is not None else 1e308
    if kind is int:
        limit = 2**62
        entry = IntegerRange(from_value=int(max(low, -limit)), to_value=int(min(high, limit)))
        descriptor.integer_range = [entry]
    else:
        descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]


def refuse_unknown(node: Node) -> None:
    """Raise InputError for a parameter that was given but that the node does not declare."""
    for name in given(node):
        if name in KNOWN_TO_ALL or name.startswith('qos_overrides.') or node.has_parameter(name):
            continue
        own = [
            k
            for k in declared(node)
            if k not in KNOWN_TO_ALL and not k.startswith('qos_overrides.')
        ]
        expected = nearest.one_of(name, own)
        raise InputError(node.get_name(), name, expected, 'an unknown parameter')
