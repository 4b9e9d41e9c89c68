"""Settings of nodes: each a class, the same from ROS parameters, a bag and a scenario.

A field is a parameter, with its default, description and range, or a key of a scenario, whose
parameters are those of its schema.
"""

from collections.abc import Callable, Mapping
from dataclasses import Field, dataclass, field, fields
from typing import Any, TypeVar, get_args, get_origin

from auv_dynamics.files.errors import InputError
from auv_dynamics.plant.parameters import flattened, nested, parameters_of, part
from auv_dynamics.ros.interface import DEPTH, Frames, TimeGrid, time_grid

LONGEST = 1e9  # s of a step or a run: stamps end in 2038
Reader = Callable[..., Any]  # name, type, default, description, range -> value
Spec = Mapping[str, Any]  # of a scenario
KEY, ENTRIES = {'several': False}, {'several': True}  # metadata of a field that is a scenario's key
Settings = TypeVar('Settings')


def setting(
    default: Any, description: str, name: str = '', *, needed: str = '', **accepted: Any
) -> Any:
    """Field of a class of settings.

    Parameters
    ----------
    default : when none is given; a tuple stands for a list, an empty one for none
    description : one line, with the unit
    name : of the parameter, by default that of the field
    needed : what is expected of one that must be given
    accepted : `at_least`, `at_most`, `one_of`

    """
    told = {'name': name, 'description': description, 'needed': needed, 'accepted': accepted}
    return field(default=default, metadata=told)


def name_of(entry: Field[Any]) -> str:
    """Name of the parameter of a field."""
    return entry.metadata['name'] or entry.name


def read_settings(kind: type[Settings], reader: Reader, source: str, **usual: Any) -> Settings:
    """Settings from whatever knows parameters.

    Parameters
    ----------
    kind : class of the settings
    reader : `(name, type, default, description, *, at_least, at_most, one_of)` -> value
    source : node or file, for refusals
    usual : field -> default that depends on the circumstances

    Raises
    ------
    InputError : what the reader refuses, what is needed and not given, what the schema refuses

    """
    values: dict[str, Any] = {}
    for entry in fields(kind):  # type: ignore[arg-type]  # every class of settings is a dataclass
        if 'several' in entry.metadata:
            read = _read_entries if entry.metadata['several'] else _read_key
            values[entry.name] = read(entry.name, reader, source)
        elif entry.metadata:
            default = usual.get(entry.name, entry.default)
            values[entry.name] = _read(entry, default, reader, source)
    return kind(**values)


def _read(entry: Field[Any], default: Any, reader: Reader, source: str) -> Any:
    name, told, kind = name_of(entry), entry.metadata, entry.type
    if get_origin(kind) is tuple:
        item: Any = get_args(kind)[0]
        found = reader(name, list[item], list(default) or None, told['description'])
        return tuple(found or ())
    value = reader(name, kind, default, told['description'], **told['accepted'])
    if told['needed'] and not value:
        raise InputError(source, name, told['needed'], None)
    return value


def _read_key(group: str, reader: Reader, source: str, place: str = '') -> Spec:
    about, place, values = part(group), place or group, {}
    for one in parameters_of(about):
        values[one.name] = reader(f'{place}.{one.name}', one.kind, None, one.text, **one.range)
    for one in parameters_of(about, values['kind']) if 'kind' in values else ():
        if one.name not in values:
            values[one.name] = reader(f'{place}.{one.name}', one.kind, None, one.text, **one.range)
    return nested(about, values, source, place)


def _read_entries(group: str, reader: Reader, source: str) -> dict[str, Spec]:
    text = f'names; each is {part(group)["title"]}'
    names = reader(f'{group}.names', list[str], None, text) or []
    return {name: _read_key(group, reader, source, f'{group}.{name}') for name in names}


def as_parameters(settings: Any) -> dict[str, Any]:
    """Parameters, name -> value, that `read_settings` makes the same settings of."""
    written: dict[str, Any] = {}
    for entry in fields(settings):
        value = getattr(settings, entry.name)
        several = entry.metadata.get('several')
        if several is None and entry.metadata:
            written[name_of(entry)] = list(value) if isinstance(value, tuple) else value
        for name, spec in value.items() if several else ():
            written |= _as_parameters(entry.name, spec, f'{entry.name}.{name}')
        if several:
            written[f'{entry.name}.names'] = [*value]
        elif several is not None:
            written |= _as_parameters(entry.name, value, entry.name)
    # an empty list has no type in a ROS parameter file
    return {name: value for name, value in written.items() if value != []}


def _as_parameters(group: str, spec: Spec, place: str) -> dict[str, Any]:
    return {f'{place}.{key}': value for key, value in flattened(part(group), spec).items()}


def entries(group: str, specs: list[Spec]) -> dict[str, Spec]:
    """Entries of a list of a scenario by names that are made of their places and kinds."""
    return {f'{group[0]}{i}_{spec["kind"]}': spec for i, spec in enumerate(specs, start=1)}


@dataclass(frozen=True)
class GraphSettings:
    """Settings shared by the nodes of a graph."""

    lockstep: bool = setting(
        False, 'each step waits for its wrench, all nodes alike; else real time'
    )
    odom_frame: str = setting(Frames.odom, 'frame id of poses: north-east-down')
    base_frame: str = setting(Frames.base, 'frame id of the body: forward-starboard-down')
    expected_subscribers: tuple[str, ...] = setting(
        (), 'topic=count: subscriptions that must match before step topics are published'
    )


@dataclass(frozen=True)
class GridSettings:
    """Steps of a run."""

    step: float = setting(0.01, 'time step, s', at_least=1e-9, at_most=LONGEST)
    duration: float = setting(0.0, 'length of the run, s; 0: no end', at_least=0.0, at_most=LONGEST)

    def grid(self, source: str) -> TimeGrid:
        """Steps of whole nanoseconds; InputError, which names `source`, where there are none."""
        return time_grid(self.step, self.duration, source)


@dataclass(frozen=True)
class PlantSettings(GridSettings):
    """Settings of the plant node."""

    vehicle: str = setting(
        '', 'vehicle file, or bare name of a shipped one', needed='a vehicle file'
    )
    start_paused: bool = setting(False, 'wait for ~/run before step 0')
    publish_clock: bool = setting(True, 'publish /clock; false beside another that does')
    recorder_window: int = setting(
        0, 'most steps ahead of recorder/progress; 0: any', at_least=0, at_most=DEPTH - 1
    )
    integrator: str = setting('ode5', 'integration method', one_of=part('integrator')['enum'])
    seed: int = setting(0, 'seed of the random numbers of sensors and faults', at_least=0)
    initial_eta: tuple[float, ...] = setting(
        (0.0,) * 6, 'initial position, m, and Euler angles, rad, NED', 'initial.eta'
    )
    initial_nu: tuple[float, ...] = setting(
        (0.0,) * 6, 'initial velocity, m/s and rad/s, body frame', 'initial.nu'
    )
    start_after: tuple[str, ...] = setting((), 'nodes whose ~/ready is awaited')
    wrench_timeout: float = setting(
        0.5,
        's without a wrench: then zero wrench in real time; in lock-step the run fails',
        at_least=0.0,
    )
    disturbance: Mapping[str, Spec] = field(default_factory=dict, metadata=ENTRIES)
    actuators: Spec = field(default_factory=dict, metadata=KEY)
    sensors: Spec = field(default_factory=dict, metadata=KEY)
    faults: Mapping[str, Spec] = field(default_factory=dict, metadata=ENTRIES)
