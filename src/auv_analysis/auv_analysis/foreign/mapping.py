"""Which topics of a bag hold what: a mapping file and the options that stand for its keys."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import check, read_yaml

SCHEMA = Path(__file__).with_name('mapping.schema.json')
MEASURED = ('odometry', 'pose', 'twist')
MOVING = ('odometry', 'twist')
FORCES = ('wrench', 'thrusters', 'wrench_applied')
ROLES = (*MEASURED, *FORCES, 'setpoint')
OPTIONS = ('odometry', 'wrench', 'setpoint', 'frames', 'twist_frame', 'step', 'gap')  # as well
HELD = ('wrench', 'wrench_applied', 'thrusters', 'setpoint')  # commands


@dataclass(frozen=True)
class Source:
    """One mapped topic.

    Attributes
    ----------
    role : what it holds, of `ROLES`
    topic : its name in the bag
    frames : 'ned_fsd' or 'enu_flu', None where nothing was said
    gap : s, None: by its intervals, and of a set-point none
    stamps : 'header' or 'log'
    twist_frame : 'child' or 'world'
    between : 'hold' or 'linear'

    """

    role: str
    topic: str
    frames: str | None = None
    gap: float | None = None
    stamps: str = 'header'
    twist_frame: str = 'child'
    between: str = 'linear'


@dataclass(frozen=True)
class TopicMap:
    """How a bag is to be read.

    Attributes
    ----------
    sources : role -> its topic
    vehicle : file or shipped bare name
    name : of the run, '': that of the bag
    step, window : s, None: chosen by the data
    origin : named in errors: the file, or 'options'

    """

    sources: Mapping[str, Source]
    vehicle: str | Path | None = None
    name: str = ''
    step: float | None = None
    window: float | None = None
    origin: object = field(default='options')


def read_mapping(file: str | Path | None, options: Mapping[str, Any]) -> TopicMap:
    """Mapping of a file with some of its keys replaced.

    Parameters
    ----------
    file : mapping file, None: there is none
    options : key -> value that stands in the place of the file's; None: not given

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    data: dict[str, Any] = {} if file is None else read_yaml(Path(file), 'mapping')
    origin = 'options' if file is None else file
    given = {key: value for key, value in options.items() if value is not None}
    if file is not None and isinstance(data.get('vehicle'), str):
        beside = Path(file).parent / data['vehicle']
        data = data | {'vehicle': str(beside) if beside.is_file() else data['vehicle']}
    data = data | given
    roles = {key: {'topic': data[key]} for key in ROLES if isinstance(data.get(key), str)}
    check(data | roles, SCHEMA, origin)
    data |= roles
    _check_roles(data, origin)
    shared: dict[str, Any] = {
        key: data[key] for key in ('frames', 'gap', 'twist_frame') if key in data
    }
    return TopicMap(
        sources={role: _source(role, data[role], shared) for role in ROLES if role in data},
        vehicle=data.get('vehicle'),
        name=data.get('name', ''),
        step=data.get('step'),
        window=data.get('window'),
        origin=origin,
    )


def _source(role: str, entry: Mapping[str, Any], shared: Mapping[str, Any]) -> Source:
    apart = {'gap'} if role == 'setpoint' else set()  # a set-point holds until the next
    apart |= set() if role in MOVING else {'twist_frame'}
    common = {key: value for key, value in shared.items() if key not in apart}
    between = {'between': 'hold'} if role in HELD else {}
    return Source(role, **{**common, **between, **entry})


def _check_roles(data: Mapping[str, Any], origin: object) -> None:
    """Refuse what does not make a motion and a force, or makes them twice."""
    motion = [key for key in MEASURED if key in data]
    if motion not in (['odometry'], ['pose', 'twist']):
        key = 'odometry' if not motion else motion[-1]
        found = ' and '.join(motion) or None
        raise InputError(origin, key, 'odometry (--odom), or both pose and twist', found)
    forces = [key for key in ('wrench', 'thrusters') if key in data]
    if len(forces) != 1:
        expected = 'one of wrench (--wrench) and thrusters'
        raise InputError(origin, 'wrench', expected, ' and '.join(forces) or None)
    topics = [data[key]['topic'] for key in ('wrench', 'wrench_applied') if key in data]
    if len(set(topics)) < len(topics):
        raise InputError(origin, 'wrench_applied', 'another topic than wrench', topics[0])
