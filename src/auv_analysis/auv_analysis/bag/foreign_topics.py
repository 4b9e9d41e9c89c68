"""Topics of other systems: a mapping to what they hold, and which ones a bag offers for it."""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from auv_analysis.bag.any_bag import survey
from auv_analysis.bag.reading import BagContents
from auv_analysis.bag.step_topics import NotOursError
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import check, read_yaml
from auv_dynamics.ros.interface import LARGEST, nanoseconds

SCHEMA = Path(__file__).with_name('mapping.schema.json')
MEASURED = ('odometry', 'pose', 'twist')
MOVING = ('odometry', 'twist')
FORCES = ('wrench', 'thrusters', 'wrench_applied')
ROLES = (*MEASURED, *FORCES, 'setpoint')
OPTIONS = ('odometry', 'wrench', 'setpoint', 'frames', 'twist_frame', 'step', 'gap')  # as well
HELD = ('wrench', 'wrench_applied', 'thrusters', 'setpoint')  # commands
CANDIDATES = ('odometry', 'pose', 'twist', 'wrench', 'setpoint', 'thrusters')
ASKED = ('cmd', 'command', 'desired', 'goal', 'ref', 'reference', 'setpoint', 'target')
THRUSTING = ('actuator', 'actuators', 'esc', 'motor', 'motors', 'propeller', 'propellers', 'pwm',
             'servo', 'servos', 'thrust', 'thruster', 'thrusters', 'thrusts')  # fmt: skip
FROM_ATTITUDE = 'from attitude'
SHOWN = 6  # topics of a role in one line
UNIT = 1e-2  # of the norm of a quaternion: what rounding to single precision leaves, and more
Numbers = tuple[float, ...]


@dataclass(frozen=True)
class MappedTopic:
    """One mapped topic.

    Attributes
    ----------
    role : what it holds, of `ROLES`
    topic : its name in the bag
    frames : 'ned_fsd' or 'enu_flu', None where nothing was said
    gap : s, None: by its intervals, and of a set-point none
    stamps : 'header', 'log' or 'uniform': those of the header, spread evenly
    twist_frame : 'child' or 'world'
    between : 'hold' or 'linear'
    delay : s, by which a measurement is older than its stamp, or a command acts behind it
    curve : of thrusters: name or file of the curve that turns their commands into N, '': they are N
    reversed : of thrusters: names, or numbers from 1, of those whose command is mirrored

    """

    role: str
    topic: str
    frames: str | None = None
    gap: float | None = None
    stamps: str = 'header'
    twist_frame: str = 'child'
    between: str = 'linear'
    delay: float = 0.0
    curve: str = ''
    reversed: Sequence[str | int] = ()


@dataclass(frozen=True)
class TopicMap:
    """How a bag is to be read.

    Attributes
    ----------
    sources : role -> its topic
    vehicle : file or shipped bare name
    name : of the run, '': that of the bag
    step, window : s, None: chosen by the data
    rates : 'from attitude', or '': the angular velocity is the one recorded
    origin : named in errors: the file, or 'options'

    """

    sources: Mapping[str, MappedTopic]
    vehicle: str | Path | None = None
    name: str = ''
    step: float | None = None
    window: float | None = None
    rates: str = ''
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
        rates=data.get('rates', ''),
        origin=origin,
    )


def _source(role: str, entry: Mapping[str, Any], shared: Mapping[str, Any]) -> MappedTopic:
    apart = {'gap'} if role == 'setpoint' else set()  # a set-point holds until the next
    apart |= set() if role in MOVING else {'twist_frame'}
    common = {key: value for key, value in shared.items() if key not in apart}
    between = {'between': 'hold'} if role in HELD else {}
    return MappedTopic(role, **{**common, **between, **entry})


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


class Reading(NamedTuple):
    """What one message says.

    Attributes
    ----------
    stamp : ns, None of a message without header
    frame, child : frame ids, '' where the message has none
    row : its numbers

    """

    stamp: int | None
    frame: str
    child: str
    row: Numbers


def _vector(v: Any) -> Numbers:
    return v.x, v.y, v.z


def _pose(pose: Any) -> Numbers:
    q = pose.orientation
    return *_vector(pose.position), q.w, q.x, q.y, q.z


def _twist(twist: Any) -> Numbers:
    return *_vector(twist.linear), *_vector(twist.angular)


def _wrench(wrench: Any) -> Numbers:
    return *_vector(wrench.force), *_vector(wrench.torque)


def _stamped(take: Callable[[Any], Numbers]) -> Callable[[Any], Reading]:
    def read(message: Any) -> Reading:
        header = message.header
        child = getattr(message, 'child_frame_id', '')
        return Reading(nanoseconds(header.stamp), header.frame_id, child, take(message))

    return read


def _bare(take: Callable[[Any], Numbers]) -> Callable[[Any], Reading]:
    return lambda message: Reading(None, '', '', take(message))


# roles: 'odometry' 13 numbers (position, quaternion w x y z, twist), 'pose' the first 7 of them,
# 'twist' and 'wrench' 6, 'thrusters' one per thruster
READERS: dict[str, dict[str, Callable[[Any], Reading]]] = {
    'odometry': {
        'nav_msgs/msg/Odometry': _stamped(lambda m: (*_pose(m.pose.pose), *_twist(m.twist.twist))),
    },
    'pose': {
        'geometry_msgs/msg/PoseStamped': _stamped(lambda m: _pose(m.pose)),
        'geometry_msgs/msg/PoseWithCovarianceStamped': _stamped(lambda m: _pose(m.pose.pose)),
        'nav_msgs/msg/Odometry': _stamped(lambda m: _pose(m.pose.pose)),
    },
    'twist': {
        'geometry_msgs/msg/TwistStamped': _stamped(lambda m: _twist(m.twist)),
        'geometry_msgs/msg/TwistWithCovarianceStamped': _stamped(lambda m: _twist(m.twist.twist)),
        'geometry_msgs/msg/Twist': _bare(_twist),
        'nav_msgs/msg/Odometry': _stamped(lambda m: _twist(m.twist.twist)),
    },
    'wrench': {
        'geometry_msgs/msg/WrenchStamped': _stamped(lambda m: _wrench(m.wrench)),
        'geometry_msgs/msg/Wrench': _bare(_wrench),
    },
    'thrusters': {
        'std_msgs/msg/Float64MultiArray': _bare(lambda m: tuple(map(float, m.data))),
        'std_msgs/msg/Float32MultiArray': _bare(lambda m: tuple(map(float, m.data))),
        'sensor_msgs/msg/JointState': _stamped(lambda m: tuple(map(float, m.effort))),
    },
}
READERS['wrench_applied'] = READERS['wrench']
READERS['setpoint'] = READERS['twist']


def are_usable(rows: np.ndarray, role: str) -> np.ndarray:
    """Whether each row (n, k) can be used: finite, not absurd, and poses with unit quaternions."""
    finite = np.all(np.abs(rows) < LARGEST, axis=1)  # NaN: false
    if role not in ('odometry', 'pose'):
        return finite
    return finite & (np.abs(np.linalg.norm(rows[:, 3:7], axis=1) - 1.0) < UNIT)


def candidates(contents: BagContents) -> dict[str, list[str]]:
    """Role -> topics with messages of a type that fits, the likeliest first.

    An odometry is no candidate for pose and twist, a velocity whose name says that it is asked
    for is one for the set-point alone, and an array holds thrusts only where its name says so:
    states of filters come in arrays as well.
    """
    types = {topic: kind for topic, kind in contents.types.items() if contents.counts.get(topic)}
    found = {role: _fitting(types, role) for role in CANDIDATES}
    whole = set(found['odometry'])
    for role in ('pose', 'twist', 'setpoint'):
        found[role] = [topic for topic in found[role] if topic not in whole]
    found['setpoint'] = [topic for topic in found['setpoint'] if _is_asked(topic)]
    found['twist'] = [topic for topic in found['twist'] if not _is_asked(topic)]
    found['thrusters'] = [topic for topic in found['thrusters'] if _has_word(topic, THRUSTING)]
    return {
        role: sorted(topics, key=lambda topic: (-contents.counts[topic], topic))
        for role, topics in found.items()
    }


def _fitting(types: Mapping[str, str], role: str) -> list[str]:
    return [topic for topic, kind in types.items() if kind in READERS[role]]


def _is_asked(topic: str) -> bool:
    return _has_word(topic, ASKED)


def _has_word(topic: str, words: Collection[str]) -> bool:
    return any(word in words for word in re.split(r'[\W\d_]+', topic.lower()))


def with_candidates(error: NotOursError) -> InputError:
    """The refusal of a bag that is not ours, with the options that would map its topics.

    Parameters
    ----------
    error : what is missing; of a bag that cannot be looked through it is returned as it is

    """
    try:
        found = candidates(survey(Path(error.file)))
    except InputError:
        return error
    options = [
        f'{option} {" or ".join(found[role][:SHOWN])}'
        for role, option in (('odometry', '--odom'), ('wrench', '--wrench'))
        if found[role]
    ]
    missing = [role for role in ('odometry', 'wrench') if not found[role]]
    if 'odometry' in missing and found['pose'] and found['twist']:
        pair = [f'{role} {" or ".join(found[role][:SHOWN])}' for role in ('pose', 'twist')]
        options.insert(0, f'--map FILE with {" and ".join(pair)}')
        missing.remove('odometry')
    if 'wrench' in missing and found['thrusters']:
        options.append(f'--map FILE with thrusters {" or ".join(found["thrusters"][:SHOWN])}')
        missing.remove('wrench')
    lacking = f' (the bag has no {" and no ".join(missing)})' if missing else ''
    if found['setpoint']:
        options.append(f'--setpoint {" or ".join(found["setpoint"][:SHOWN])}')
    options += ['--frames ned_fsd or enu_flu', '--vehicle FILE']
    expected = f'{error.expected}, or of another system {", ".join(options)}{lacking}'
    return InputError(error.file, error.key, expected, error.found)
