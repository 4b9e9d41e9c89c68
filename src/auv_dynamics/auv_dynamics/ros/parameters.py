"""ROS parameters: declared with description and range, read-only unless said, unknown refused."""

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterValueException
from rclpy.parameter import Parameter as RosParameter

from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import one_of as nearest_of
from auv_dynamics.files.yaml_files import is_number
from auv_dynamics.ros.settings import Settings, read_settings

KNOWN_TO_ALL = {'use_sim_time', 'start_type_description_service'}
TYPES = {  # and what is expected of their values
    bool: (RosParameter.Type.BOOL, 'true or false'),
    int: (RosParameter.Type.INTEGER, 'a whole number'),
    float: (RosParameter.Type.DOUBLE, 'a number'),
    str: (RosParameter.Type.STRING, 'a word'),
    list[float]: (RosParameter.Type.DOUBLE_ARRAY, 'a list of numbers'),
    list[str]: (RosParameter.Type.STRING_ARRAY, 'a list of words'),
}


def given(node: Any, prefix: str = '') -> list[str]:
    """Names of the parameters that the user gave and that begin with `prefix`."""
    return sorted(name for name in node.given if name.startswith(prefix))


def declare(
    node: Any,
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
    value = _taken(node.given[name], kind) if name in node.given else default
    if default is None and value == 'null':  # what `ros2 param dump` writes of what is not set
        value = None
    descriptor = ParameterDescriptor(description=description, read_only=not writable)
    if one_of:
        descriptor.additional_constraints = f'one of {", ".join(one_of)}'
    if at_least is not None or at_most is not None:
        _set_range(descriptor, kind, at_least, at_most)
    ros_type, expected = TYPES[kind]
    if value is None and default is None:
        node.declare_parameter(name, ros_type, descriptor, ignore_override=True)
        return None
    if value is None or RosParameter.Type.from_parameter_value(value) != ros_type:
        raise InputError(node.get_name(), name, expected, value)
    try:
        node.declare_parameter(name, value, descriptor, ignore_override=True)
    except InvalidParameterValueException:
        low = '-inf' if at_least is None else at_least
        high = 'inf' if at_most is None else at_most
        raise InputError(node.get_name(), name, f'a number from {low} to {high}', value) from None
    if one_of and value not in one_of:
        raise InputError(node.get_name(), name, nearest_of(value, one_of), value)
    numbers: Any = value if isinstance(value, list) else [value]
    if kind in (float, list[float]) and not all(map(math.isfinite, numbers)):
        raise InputError(node.get_name(), name, 'finite numbers', value)
    return value


def declare_settings(node: Any, kind: type[Settings], **usual: Any) -> Settings:
    """Declare the parameters of a class of settings as the last ones of a node.

    Parameters
    ----------
    node : that declares them
    kind : class of the settings
    usual : field -> default that depends on the circumstances

    Raises
    ------
    InputError : a parameter that is refused, or one that the node does not know

    """
    settings = read_settings(kind, partial(declare, node), node.get_name(), **usual)
    refuse_unknown(node)
    return settings


def _taken(value: Any, kind: Any) -> Any:
    """A value that was given, as a list and with whole numbers as numbers where these are meant."""
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        value = list(value)
    if kind is float and is_number(value):
        return float(value)
    if kind == list[float]:
        listed = [value] if is_number(value) else value
        if isinstance(listed, list) and all(map(is_number, listed)):
            return [float(number) for number in listed]
    return value


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


def refuse_unknown(node: Any) -> None:
    """Raise InputError for a parameter that was given but that the node does not declare."""
    for name in given(node):
        if name in KNOWN_TO_ALL or name.startswith('qos_overrides.') or node.has_parameter(name):
            continue
        own = [
            k
            for k in sorted(node.get_parameters_by_prefix(''))
            if k not in KNOWN_TO_ALL and not k.startswith('qos_overrides.')
        ]
        expected = nearest_of(name, own)
        raise InputError(node.get_name(), name, expected, 'an unknown parameter')
