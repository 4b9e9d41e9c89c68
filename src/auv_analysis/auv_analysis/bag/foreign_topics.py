"""Topics of other systems: the mapping to their roles, and the candidates in a bag."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from auv_analysis.bag.any_bag import survey
from auv_analysis.bag.foreign_fields import (
    EULER,
    POSITION,
    RATES,
    VELOCITY,
    Paths,
    Units,
    check_fields,
    presets,
)
from auv_analysis.bag.metadata import is_log
from auv_analysis.bag.reading import BagContents
from auv_analysis.bag.step_topics import NotOursError, role_of
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import check, read_yaml
from auv_dynamics.ros.interface import GROUND_TRUTH, WRENCH

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
DERIVED = ('delta', 'disturbance', 'lumped')  # neither measured nor commanded
TURNS = {'roll': 0, 'phi': 0, 'pitch': 1, 'theta': 1, 'yaw': 2, 'psi': 2, 'heading': 2}
JOINED = {  # words that are two
    **{f'{kind}{axis}': (kind, axis) for kind in 'vfq' for axis in 'xyz'},
    **{f'{turn}{rate}': (turn, rate) for turn in TURNS for rate in ('rate', 'speed')},
    'qw': ('q', 'w'), 'angvel': ('angular', 'vel'),
}  # fmt: skip
FROM_ATTITUDE = 'from attitude'
SHOWN = 6  # topics of a role in one line
MOTION = (*POSITION, *EULER, *VELOCITY, *RATES)  # components of it


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
    fields : paths to its numbers, None: those of its message type
    units : of these numbers, '': SI
    stamp : path to its stamp and the unit of that, None: the stamp of the header

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
    fields: Paths | None = None
    units: Units = ''
    stamp: tuple[str, str] | None = None


@dataclass(frozen=True)
class TopicMap:
    """Options for reading a bag.

    Attributes
    ----------
    sources : role -> its topic, or role[0], role[1], ... -> those that make it together
    vehicle : file or shipped bare name
    name : of the run, '': that of the bag
    step, window : s, None: chosen by the data
    rates : 'from attitude', or '': the angular velocity is the one recorded
    unknown : of `MOTION` in NED and FSD, those whose numbers are no measurement
    origin : named in errors: the file, or 'options'

    """

    sources: Mapping[str, MappedTopic]
    vehicle: str | Path | None = None
    name: str = ''
    step: float | None = None
    window: float | None = None
    rates: str = ''
    unknown: frozenset[str] = frozenset()
    origin: object = field(default='options')

    @property
    def knows_wrench(self) -> bool:
        """Whether a wrench was mapped, or the thrusts that make it."""
        return any(one.role in FORCES for one in self.sources.values())


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
    data |= {role: _entry(data[role]) for role in ROLES if role in data}
    check(data, SCHEMA, origin)
    _check_roles(data, origin)
    keys = ('frames', 'gap', 'twist_frame', 'stamp')
    shared: dict[str, Any] = {key: data[key] for key in keys if key in data}
    return TopicMap(
        sources=dict(_sources(data, shared, origin)),
        vehicle=data.get('vehicle'),
        name=data.get('name', ''),
        step=data.get('step'),
        window=data.get('window'),
        rates=data.get('rates', ''),
        unknown=frozenset(data.get('unknown', ())) | _untold_angles(data),
        origin=origin,
    )


def _untold_angles(data: Mapping[str, Any]) -> set[str]:
    """Angles of an attitude that is mapped by some of them."""
    told = [data[role] for role in ('odometry', 'pose') if role in data]
    entries = [entry for one in told for entry in (one if isinstance(one, list) else [one])]
    paths = [set(EULER).intersection(entry.get('fields', ())) for entry in entries]
    return set().union(*(set(EULER) - some for some in paths if some))


def _entry(told: Any) -> Any:
    """Entry of a role in a mapping; a bare name becomes a mapping with `topic`."""
    if isinstance(told, list):
        return [_entry(part) for part in told]
    return {'topic': told} if isinstance(told, str) else told


def _sources(
    data: Mapping[str, Any], shared: Mapping[str, Any], origin: object
) -> Iterator[tuple[str, MappedTopic]]:
    """Key and topic of all entries of the roles."""
    for role in ROLES:
        told = data.get(role, ())
        if isinstance(told, dict):
            yield role, _source(role, told, shared, (role, origin))
            continue
        for i, entry in enumerate(told):
            key = f'{role}[{i}]'
            yield key, _source(role, entry, shared, (key, origin))


def _source(
    role: str, entry: Mapping[str, Any], shared: Mapping[str, Any], named: tuple[str, object]
) -> MappedTopic:
    apart = {'gap'} if role == 'setpoint' else set()  # a set-point holds until the next
    apart |= set() if role in MOVING else {'twist_frame'}
    common = {key: value for key, value in shared.items() if key not in apart}
    between = {'between': 'hold'} if role in HELD else {}
    told = {**common, **between, **entry}
    stamp = told.get('stamp')
    if isinstance(stamp, str):
        told['stamp'] = stamp, 's'
    elif stamp:
        told['stamp'] = stamp['field'], stamp.get('units', 's')
    check_fields(role, told.get('fields'), told.get('units', ''), *named)
    return MappedTopic(role, **told)


def _check_roles(data: Mapping[str, Any], origin: object) -> None:
    """Refuse what does not make a motion and a force, or makes them twice."""
    motion = [key for key in MEASURED if key in data]
    turning = ['pose'] if data.get('rates') == FROM_ATTITUDE else ['pose', 'twist']
    if motion not in (['odometry'], ['twist'], ['pose', 'twist'], turning):
        key = 'odometry' if not motion else motion[-1]
        found = ' and '.join(motion) or None
        raise InputError(origin, key, 'odometry (--odom), or both pose and twist', found)
    forces = [key for key in ('wrench', 'thrusters') if key in data]
    if len(forces) > 1 or ('wrench_applied' in data and not forces):
        expected = 'one of wrench (--wrench) and thrusters'
        raise InputError(origin, 'wrench', expected, ' and '.join(forces) or None)
    if 'wrench_applied' in data and data['wrench_applied'] == data.get('wrench'):
        topic = data['wrench'].get('topic') if isinstance(data['wrench'], dict) else data['wrench']
        raise InputError(origin, 'wrench_applied', 'another topic than wrench', topic)


def candidates(contents: BagContents) -> dict[str, list[str]]:
    """Role -> topics with messages of a type that fits, the likeliest first.

    An odometry is no candidate for pose and twist, a velocity whose name says that it is asked
    for is one for the set-point alone, and an array holds thrusts only where its name says so:
    states of filters come in arrays as well. What is called wrench is commanded, a disturbance not.
    """
    types = {topic: kind for topic, kind in contents.types.items()
             if contents.counts.get(topic) and not has_word(role_of(topic), DERIVED)}  # fmt: skip
    found = {role: _fitting(types, role) for role in CANDIDATES}
    whole = set(found['odometry'])
    for role in ('pose', 'twist', 'setpoint'):
        found[role] = [topic for topic in found[role] if topic not in whole]
    found['setpoint'] = [topic for topic in found['setpoint'] if has_word(topic, ASKED)]
    found['twist'] = [topic for topic in found['twist'] if not has_word(topic, ASKED)]
    found['thrusters'] = [topic for topic in found['thrusters'] if has_word(topic, THRUSTING)]
    counts = contents.counts
    return {
        role: sorted(
            topics, key=lambda t: (role_of(t) != WRENCH, -counts[t], not has_word(t, {role}), t)
        )
        for role, topics in found.items()
    }


def _fitting(types: Mapping[str, str], role: str) -> list[str]:
    return [topic for topic, kind in types.items() if kind in presets(role)]


def words_of(path: str) -> list[str]:
    """Words of a topic or path: 'linearVel_x [m/s]' is linear, vel, x."""
    plain = re.sub(r'\(.*?\)|\[[^\d\]].*?\]', ' ', path)
    found: list[str] = []
    for word in re.findall(r'[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+', plain):
        found += JOINED.get(word.lower(), (word.lower(),))
    return found


def has_word(name: str, words: Iterable[str]) -> bool:
    """Whether one of some words stands in the name of a topic or path."""
    return not set(words).isdisjoint(words_of(name))


def other_odometries(types: Mapping[str, str], topic: str) -> str:
    """How an expectation ends that an odometry disappoints: which others a bag has; '' of none."""
    found = [other for other in _fitting(types, 'odometry')
             if other != topic and not other.endswith(GROUND_TRUTH)]  # fmt: skip
    return f', or another odometry: --odom {" or ".join(found[:SHOWN])}' if found else ''


def with_candidates(error: NotOursError) -> InputError:
    """The refusal of a bag that is not ours, with the options that would map its topics.

    Parameters
    ----------
    error : what is missing; of a bag that cannot be looked through it is returned as it is

    """
    try:
        contents = survey(Path(error.file))
    except InputError as refused:
        return refused if is_log(Path(error.file)) else error
    if is_log(Path(error.file)):
        return InputError(
            error.file, '', f'--map FILE: auv info {error.file} proposes one', 'a log'
        )
    found = candidates(contents)
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
