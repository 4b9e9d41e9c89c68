"""Fields of a message: the components that a role needs, the paths to them, and their units.

A standard message type is a preset of paths; a mapping may name the paths of any other.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING
from functools import partial
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import meant, one_of
from auv_dynamics.files.yaml_files import is_number
from auv_dynamics.ros.interface import LARGEST, NANOSECONDS, nanoseconds
from auv_dynamics.vehicle.kinematics import quaternion

Path = str | float  # in a message, such as -motors[2].thrust; a number: the same in every message
Paths = Mapping[str, Path] | list[str] | str  # by component; of thrusters a list, or an array
Units = Mapping[str, str | float] | str | float

POSITION, EULER, QUATERNION = ('x', 'y', 'z'), ('phi', 'theta', 'psi'), ('qw', 'qx', 'qy', 'qz')
VELOCITY, RATES, FORCE, TORQUE = ('uvw', 'pqr', 'XYZ', 'KMN')
COMPONENTS: dict[str, tuple[str, ...]] = {  # of a row of each role; thrusters have as many as told
    'odometry': (*POSITION, *QUATERNION, *VELOCITY, *RATES),
    'pose': (*POSITION, *QUATERNION),
    'twist': (*VELOCITY, *RATES),
    'setpoint': (*VELOCITY, *RATES),
    'wrench': (*FORCE, *TORQUE),
    'wrench_applied': (*FORCE, *TORQUE),
    'thrusters': (),
}
THRUSTS = 'thrusts'
SI = {
    **dict.fromkeys(POSITION, 'm'), **dict.fromkeys(EULER, 'rad'), **dict.fromkeys(VELOCITY, 'm/s'),
    **dict.fromkeys(RATES, 'rad/s'), **dict.fromkeys(FORCE, 'N'), **dict.fromkeys(TORQUE, 'N m'),
    THRUSTS: 'N',
}  # fmt: skip
UNITS: dict[str, tuple[str, float]] = {  # unit -> the SI unit, and how many of it
    'm': ('m', 1.0), 'cm': ('m', 1e-2), 'mm': ('m', 1e-3), 'ft': ('m', 0.3048),
    'rad': ('rad', 1.0), 'deg': ('rad', math.pi / 180.0),
    'm/s': ('m/s', 1.0), 'cm/s': ('m/s', 1e-2), 'mm/s': ('m/s', 1e-3), 'kn': ('m/s', 1852 / 3600),
    'rad/s': ('rad/s', 1.0), 'deg/s': ('rad/s', math.pi / 180.0),
    'N': ('N', 1.0), 'kN': ('N', 1e3), 'kgf': ('N', 9.80665),
    'N m': ('N m', 1.0), 'kN m': ('N m', 1e3),
}  # fmt: skip
FAR = 2**62  # ns, in the year 2116: what is later is no time
TIMES = {'s': NANOSECONDS, 'ms': 10**6, 'us': 10**3, 'ns': 1}  # unit -> ns
UNIT = 1e-2  # of the norm of a quaternion: what rounding to single precision leaves, and more
STEP = re.compile(r'\.?([^.\[\]]+)|\[(\d+)\]')
WIDEST = 64  # numbers of an array that are listed one by one
SHOWN = 12  # paths in one line


def _xyz(names: str | tuple[str, ...], path: str) -> dict[str, str]:
    return {name: f'{path}.{axis}' for name, axis in zip(names, 'xyz', strict=True)}


def _attitude(path: str) -> dict[str, str]:
    return {name: f'{path}.{name[1]}' for name in QUATERNION}


def _pose(path: str) -> dict[str, str]:
    return _xyz(POSITION, f'{path}.position') | _attitude(f'{path}.orientation')


def _twist(path: str) -> dict[str, str]:
    return _xyz(VELOCITY, f'{path}linear') | _xyz(RATES, f'{path}angular')


def _wrench(path: str) -> dict[str, str]:
    return _xyz(FORCE, f'{path}force') | _xyz(TORQUE, f'{path}torque')


PRESETS: dict[str, dict[str, str]] = {  # message type -> component -> path
    'nav_msgs/msg/Odometry': _pose('pose.pose') | _twist('twist.twist.'),
    'geometry_msgs/msg/PoseStamped': _pose('pose'),
    'geometry_msgs/msg/PoseWithCovarianceStamped': _pose('pose.pose'),
    'geometry_msgs/msg/TwistStamped': _twist('twist.'),
    'geometry_msgs/msg/TwistWithCovarianceStamped': _twist('twist.twist.'),
    'geometry_msgs/msg/Twist': _twist(''),
    'geometry_msgs/msg/WrenchStamped': _wrench('wrench.'),
    'geometry_msgs/msg/Wrench': _wrench(''),
    'sensor_msgs/msg/Imu': _attitude('orientation') | _xyz(RATES, 'angular_velocity'),
}
ARRAYS = {  # message type -> path to thrusts in N
    'std_msgs/msg/Float64MultiArray': 'data',
    'std_msgs/msg/Float32MultiArray': 'data',
    'sensor_msgs/msg/JointState': 'effort',
}


def presets(role: str) -> dict[str, Paths]:
    """Message type -> paths of the components that it has for a role; an odometry has all."""
    if role == 'thrusters':
        return dict(ARRAYS)
    found = {kind: {name: paths[name] for name in COMPONENTS[role] if name in paths}
             for kind, paths in PRESETS.items()}  # fmt: skip
    least = len(COMPONENTS[role]) if role == 'odometry' else 1
    return {kind: paths for kind, paths in found.items() if len(paths) >= least}


def check_fields(role: str, fields: Paths | None, units: Units, key: str, origin: object) -> None:
    """Raise InputError, which names `key` in `origin`, for paths or units that no role has.

    Parameters
    ----------
    role : of `COMPONENTS`
    fields : of a mapping file; None: a preset
    units : of all components that are of their kind, or by component
    key, origin : named in refusals

    """
    known = COMPONENTS[role] + (EULER if 'qw' in COMPONENTS[role] else ())
    if not known:
        if isinstance(fields, Mapping):
            expected = 'a list of paths in the order of the thrusters, or one path to an array'
            raise InputError(origin, f'{key}.fields', expected, fields)
        _check_unit(units, {SI[THRUSTS]}, f'{key}.units', origin)
        return
    if fields is not None and not isinstance(fields, Mapping):
        raise InputError(origin, f'{key}.fields', f'paths by {", ".join(known)}', fields)
    for name in fields or ():
        if name not in known:
            raise InputError(origin, f'{key}.fields.{name}', one_of(name, known), 'an unknown key')
    turning = [name for name in fields or () if name in EULER + QUATERNION]
    if not set(turning) <= set(EULER) and set(turning) != set(QUATERNION):
        expected = f'{", ".join(EULER)}, or {", ".join(QUATERNION)}: an attitude from one topic'
        raise InputError(origin, f'{key}.fields', expected, ', '.join(turning))
    if isinstance(units, Mapping):
        for name, unit in units.items():
            where = f'{key}.units.{name}'
            if name not in known:
                raise InputError(origin, where, one_of(name, known), 'an unknown key')
            _check_unit(unit, {SI.get(name, '')}, where, origin)
    elif isinstance(units, str):
        _check_unit(units, {SI.get(name, '') for name in known}, f'{key}.units', origin)
    else:
        raise InputError(origin, f'{key}.units', 'a unit, or units by component', units)


def _check_unit(unit: object, fitting: set[str], key: str, origin: object) -> None:
    """A unit of one of the kinds that fit, or how many SI units one is."""
    listed = [name for name, (si, _) in UNITS.items() if si in fitting]
    if isinstance(unit, str) and unit and unit not in listed:
        raise InputError(origin, key, one_of(unit, listed), unit)


def factor(name: str, units: Units) -> float:
    """Conversion factor of a component to SI, for units that `check_fields` accepted."""
    unit = units.get(name, '') if isinstance(units, Mapping) else units
    if not isinstance(unit, str):
        return float(unit)
    si, size = UNITS.get(unit, ('', 1.0))
    return size if si == SI.get(name) else 1.0


class Reading(NamedTuple):
    """Values of one message.

    Attributes
    ----------
    stamp : ns, None of a message without stamp
    frame, child : frame ids, '' where the message has none
    row : its numbers

    """

    stamp: int | None
    frame: str
    child: str
    row: tuple[Any, ...]


class FieldError(ValueError):
    """A path that does not lead to a number: the key, what is expected and what was found."""


class MessageReader:
    """Reads the numbers of messages of one kind.

    Parameters
    ----------
    role : of `COMPONENTS`
    paths : by component, or of thrusters
    units : as `check_fields` let them pass
    stamp : path to the stamp and its unit; None: that of the header

    """

    def __init__(self, role: str, paths: Paths, units: Units, stamp: tuple[str, str] | None):
        self.role, self._units = role, units
        order = [*COMPONENTS[role], *EULER]
        named = dict(paths) if isinstance(paths, Mapping) else {}
        self.names = tuple(sorted(named, key=order.index))
        told = [named[name] for name in self.names] if named else paths
        self._paths = [told] if isinstance(told, str) else list(told)
        self._is_array = isinstance(paths, str)
        self._stamp = stamp
        self._take: Callable[[Any], tuple[Any, ...]] | None = None
        self._time: Callable[[Any], Any] | None = None

    def __call__(self, message: Any) -> Reading:
        """Stamp, frame ids and numbers of a message; FieldError by the first one."""
        if self._take is None:
            self._time = self._timed(message)
            self._take = self._taken(message)
        header = getattr(message, 'header', None)
        frame, child = getattr(header, 'frame_id', ''), getattr(message, 'child_frame_id', '')
        stamp = self._time(message) if self._time else None
        row = self._take(message)
        if self._is_array:
            row = tuple(map(float, row[0]))
        if stamp is not None and math.isnan(stamp):  # a line without time
            return Reading(0, frame, child, (math.nan,) * len(row))
        return Reading(stamp, frame, child, row)

    def _timed(self, message: Any) -> Callable[[Any], Any] | None:
        """Reader of a message's stamp in ns; None where it has none."""
        if self._stamp is None:
            stamp = getattr(getattr(message, 'header', None), 'stamp', None)
            return (lambda m: nanoseconds(m.header.stamp)) if stamp is not None else None
        path, unit = self._stamp
        get = getter(message, path)
        value = _found(message, get, path, 'stamp')
        if hasattr(value, 'nanosec'):
            return lambda m: nanoseconds(get(m))
        _check_number(message, value, path, 'stamp')
        return lambda m: _scaled(get(m), TIMES[unit])

    def _taken(self, message: Any) -> Callable[[Any], tuple[Any, ...]]:
        """Reader of a message's numbers."""
        keys = [f'fields.{name}' for name in self.names]
        keys = keys or [f'fields[{i}]' for i in range(len(self._paths))]
        plain: list[str] = []
        getters: list[Callable[[Any], Any]] = []
        for key, told in zip(keys, self._paths, strict=True):
            if not isinstance(told, str):
                getters.append(partial(lambda number, _: number, float(told)))
                continue
            path = told.removeprefix('-')
            get = getter(message, path)
            value = _found(message, get, path, key)
            if not self._is_array:
                _check_number(message, value, path, key)
            elif not np.iterable(value) or isinstance(value, str):
                raise FieldError('fields', f'a path to an array{_listed(message, path)}', path)
            getters.append(get)
            if '.' not in path if hasattr(message, path) else '[' not in path:
                plain.append(path)
        if len(plain) == len(self._paths) > 1:
            return attrgetter(*plain)
        return lambda m: tuple([get(m) for get in getters])

    def block(
        self, column: Callable[[str], np.ndarray], count: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Stamps (n,) in ns and rows (n, k) of many lines of a table, NaN without a stamp.

        Parameters
        ----------
        column : gives the numbers of a column
        count : n

        """
        path, unit = self._stamp or ('', 's')
        seconds = column(path)
        known = np.abs(seconds) < FAR / TIMES[unit]
        whole = np.floor(np.where(known, seconds, 0.0))
        part = np.where(known, seconds, 0.0) - whole
        stamps = whole.astype(np.int64) * TIMES[unit] + np.rint(part * TIMES[unit]).astype(np.int64)
        taken = [
            column(path.removeprefix('-')) if isinstance(path, str) else np.full(count, path)
            for path in self._paths
        ]
        return stamps, np.where(known[:, None], self.rows(np.stack(taken, axis=1)), np.nan)

    @property
    def converted(self) -> str:
        """Numbers converted to SI, for a note; '' where there are none."""
        said: dict[str, list[str]] = {}
        for name in self.names or (THRUSTS,):
            unit = self._units.get(name) if isinstance(self._units, Mapping) else self._units
            if factor(name, self._units) != 1.0:
                said.setdefault(f'{unit}, turned into {SI[name]}', []).append(name)
        return '; '.join(f'{", ".join(names)} in {how}' for how, names in said.items())

    def rows(self, taken: np.ndarray) -> np.ndarray:
        """Rows of the role (n, k) in SI, NaN where these messages have no number.

        Parameters
        ----------
        taken : (n, j) numbers of messages as they were read

        """
        minus = [isinstance(path, str) and path.startswith('-') for path in self._paths]
        sizes = [factor(name, self._units) for name in self.names or (THRUSTS,)]
        signs = np.where(minus * (taken.shape[1] if self._is_array else 1), -1.0, 1.0)
        taken = taken * (signs * sizes)
        if not self.names:
            return taken
        order = COMPONENTS[self.role]
        found = np.full((len(taken), len(order)), np.nan)
        by_name = dict(zip(self.names, taken.T, strict=True))
        if not by_name.keys().isdisjoint(EULER):  # of one that is not told any value does
            none = np.zeros(len(taken))
            turned = quaternion(np.stack([by_name.pop(name, none) for name in EULER], axis=1))
            by_name |= dict(zip(QUATERNION, turned.T, strict=True))
        for name, column in by_name.items():
            found[:, order.index(name)] = column
        return found


def getter(message: Any, path: str) -> Callable[[Any], Any]:
    """What follows a path in messages that are like this one, which may call a field so as well."""
    if hasattr(message, path):
        return lambda m: getattr(m, path)
    steps = [name or int(index) for name, index in STEP.findall(path)]

    def follow(value: Any) -> Any:
        for step in steps:
            value = value[step] if isinstance(step, int) else getattr(value, step)
        return value

    return follow


def _found(message: Any, get: Callable[[Any], Any], path: str, key: str) -> Any:
    try:
        return get(message)
    except (AttributeError, IndexError, TypeError, KeyError):
        raise FieldError(key, f'a path in its messages{_listed(message, path)}', path) from None


def _check_number(message: Any, value: Any, path: str, key: str) -> None:
    if not is_number(value):
        kind = type(value).__name__.rpartition('__')[2]
        listed = _listed(message, path)
        raise FieldError(key, f'a path to a number{listed}', f'{path}, which is {kind}')


def _listed(message: Any, path: str) -> str:
    """Known paths to numbers, as the end of a refusal; those within the requested one."""
    every = [name for name, _ in numbers(message)]
    inside = [name for name in every if re.match(re.escape(path) + r'[.\[]', name)]
    named = inside or every
    more = f' and {len(named) - SHOWN} more' if len(named) > SHOWN else ''
    likely = '' if inside else meant(path, every)
    return f': {", ".join(named[:SHOWN])}{more}{likely}' if every else ''


def numbers(message: Any, path: str = '') -> Iterator[tuple[str, float]]:
    """Path and value of all numbers of a message, without those of longer arrays."""
    if is_number(message):
        yield path, message
    elif isinstance(message, list | tuple | np.ndarray):
        for i, part in enumerate(message if len(message) <= WIDEST else ()):
            yield from numbers(part, f'{path}[{i}]')
    elif hasattr(message, '__dict__'):
        declared = getattr(message, '__dataclass_fields__', {})
        for name, part in vars(message).items():
            constant = name in declared and declared[name].default is not MISSING
            if not (constant or name.startswith('_')):
                yield from numbers(part, f'{path}.{name}' if path else name)


def _scaled(value: Any, ns: int) -> float:
    """A time in ns: whole numbers exactly; NaN where there is none."""
    if not abs(value) < FAR / ns:
        return math.nan
    if isinstance(value, int | np.integer):
        return int(value) * ns
    whole = math.floor(value)
    return whole * ns + round((value - whole) * ns)


def are_usable(rows: np.ndarray, role: str) -> np.ndarray:
    """Whether each row (n, k) can be used: finite, not absurd, and poses with unit quaternions.

    Columns of NaN alone are those of components that the topic does not have.
    """
    absent = np.isnan(rows).all(axis=0)
    finite = np.all((np.abs(rows) < LARGEST) | absent, axis=1) & ~absent.all()
    if 'qw' not in COMPONENTS[role] or absent[3]:
        return finite
    return finite & (np.abs(np.linalg.norm(rows[:, 3:7], axis=1) - 1.0) < UNIT)
