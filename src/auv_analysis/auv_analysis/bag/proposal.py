"""A mapping file proposed for a log of another system, by types, names and values of its fields.

It is a start: what it cannot know (axes, signs, the vehicle) it says in comments.
"""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from auv_analysis.bag.any_bag import messages
from auv_analysis.bag.csv_logs import CSV, Span, Table, column_spans, csv_files
from auv_analysis.bag.foreign_fields import (
    COMPONENTS,
    EULER,
    POSITION,
    PRESETS,
    QUATERNION,
    SI,
    TIMES,
    UNITS,
    numbers,
    presets,
)
from auv_analysis.bag.foreign_topics import (
    ASKED,
    DERIVED,
    THRUSTING,
    TURNS,
    candidates,
    has_word,
    words_of,
)
from auv_analysis.bag.mavlink_logs import CURVE
from auv_analysis.bag.reading import BagContents
from auv_analysis.bag.step_topics import role_of
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import yaml_text
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.vehicle.frames import ENU_FLU, NED_FSD, named_axes

LOOKED = 50_000  # messages of a log whose numbers are looked at
OF_TOPIC = 997  # of a topic; a prime keeps step with nothing that comes in turn
HEAVY = ('Image', 'CompressedImage', 'PointCloud2', 'PointCloud', 'CameraInfo')  # not looked at
LARGEST_ANGLE, LARGEST_RATE = 6.5, 20.0  # rad, rad/s: more is meant in degrees
KINDS = {  # what a word says of the x, y and z, or 0, 1 and 2, behind it
    'pos': POSITION, 'position': POSITION, 'pose': POSITION, 'usbl': POSITION,
    'point': POSITION, 'local': POSITION, 'location': POSITION,
    'vel': tuple('uvw'), 'velocity': tuple('uvw'), 'linear': tuple('uvw'), 'dvl': tuple('uvw'),
    'speed': tuple('uvw'), 'v': tuple('uvw'),
    'gyro': tuple('pqr'), 'angular': tuple('pqr'), 'rate': tuple('pqr'), 'rates': tuple('pqr'),
    'omega': tuple('pqr'), 'gyroscope': tuple('pqr'),
    'force': tuple('XYZ'), 'f': tuple('XYZ'), 'torque': tuple('KMN'), 'moment': tuple('KMN'),
    'rpy': EULER, 'euler': EULER, 'orientation': QUATERNION[1:], 'quaternion': QUATERNION[1:],
    'quat': QUATERNION[1:], 'q': QUATERNION[1:], 'accel': (), 'acceleration': (), 'acc': (),
    'mag': (), 'magnetic': (), 'bias': (),
}  # fmt: skip
AXES = {'x': 0, 'y': 1, 'z': 2, 'north': 0, 'east': 1, 'down': 2, '0': 0, '1': 1, '2': 2}
ALONG = {'surge': 0, 'sway': 1, 'heave': 2}
TURNING = ('rate', 'rates', 'speed', 'vel', 'velocity', 'dot', 'gyro', 'angular')
FORCING = ('force', 'torque', 'moment', 'tau', 'wrench')
PULSES = (800.0, 2200.0)  # us, of servos
NOT_MEASURED = {'cov', 'covariance', 'std', 'stddev', 'var', 'variance', 'err', 'error', 'sigma'}
NAMED = {'degs': 'deg/s', 'dps': 'deg/s', 'degrees': 'deg', 'rads': 'rad/s', 'mms': 'mm/s'}
STAMP_UNITS = {'ms': 'ms', 'us': 'us', 'usec': 'us', 'ns': 'ns', 'nsec': 'ns', 's': 's', 'sec': 's'}
TIME_WORDS = ('t', 'time', 'timestamp', 'stamp', 'sec', 'secs', 'seconds', 'clock')
STEPS = ((5e6, 'ns'), (5e3, 'us'), (5.0, 'ms'), (0.0, 's'))  # mean step above which it is in them


@dataclass
class Looked:
    """Contents found in the messages of a topic.

    Attributes
    ----------
    kind : message type
    ids : frame ids of the first message
    stamped : whether it has a header
    spans : path -> its numbers
    units : path -> unit that the file says
    count : messages that were looked at
    share : of its messages that are looked at

    """

    kind: str
    ids: tuple[str, ...] = ()
    stamped: bool = False
    spans: dict[str, Span] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    count: int = 0
    share: float = 1.0

    def take(self, message: Any) -> None:
        """Widen the spans by a message."""
        header = getattr(message, 'header', None)
        ids = getattr(header, 'frame_id', ''), getattr(message, 'child_frame_id', '')
        if not self.count:
            self.ids, self.stamped = tuple(filter(None, ids)), header is not None
        self.count += 1
        for path, value in numbers(message):
            known, low, high = self.spans.get(path, (0, math.inf, -math.inf))
            if math.isfinite(value):
                known, low, high = known + 1, min(low, float(value)), max(high, float(value))
            self.spans[path] = Span(known, low, high)

    @property
    def table(self) -> dict[str, dict[str, float | None]]:
        """Path -> numbers, least and largest, of types whose fields nobody knows."""
        spans = {} if self.kind in PRESETS else self.spans
        return {
            path: {'values': span.filled, 'least': span.low if span.filled else None,
                   'largest': span.high if span.filled else None}
            for path, span in spans.items() if not path.startswith('header.')
        }  # fmt: skip

    @property
    def stamp(self) -> tuple[str, str]:
        """Path to the time of messages without header, and its unit; '' where there is none."""
        for path, span in () if self.stamped or self.kind in PRESETS else self.spans.items():
            own = [word for word in words_of(path) if word not in (*STAMP_UNITS, 'boot')]
            words = own or words_of(path)  # `sec` is a unit, and a time by itself
            if words and words[0] in TIME_WORDS and span.filled > 1:
                told = [*re.findall('[a-z]+', path.lower()), self.units.get(path, '')]
                step = (span.high - span.low) / (span.filled - 1) * self.share
                by_size = next(unit for least, unit in STEPS if step >= least)
                return path, next(
                    (STAMP_UNITS[text] for text in told if text in STAMP_UNITS), by_size
                )
        return '', ''

    @property
    def duration(self) -> float | None:
        """Time in s from the first to the last stamp of its own; None: it has none."""
        path, unit = self.stamp
        span = self.spans.get(path)
        return (span.high - span.low) * TIMES[unit] / NANOSECONDS if span else None

    def is_dead(self, paths: Iterable[str]) -> bool:
        """Whether there is no number but zero behind some paths."""
        found = [self.spans[path] for path in paths if path in self.spans]
        return all(not span.filled or span.low == span.high == 0.0 for span in found)


def looked_through(bag: Path, contents: BagContents) -> dict[str, Looked]:
    """Topic -> what its messages hold; of tables all lines, else some of each topic, evenly.

    Parameters
    ----------
    bag : folder or file
    contents : its survey; `notes` gets what is odd, and topics that cannot be decoded

    """
    found = {topic: Looked(kind) for topic, kind in contents.types.items()}
    if CSV in contents.types.values():
        for topic, file in csv_files(bag).items():
            found[topic].count = contents.counts[topic]
            with Table(file) as table:
                found[topic].units = table.units
                found[topic].spans = column_spans(table, contents.notes)
        return found
    left = {topic for topic, kind in contents.types.items() if not kind.endswith(HEAVY)}
    most = min(OF_TOPIC, LOOKED // max(len(left), 1))
    shares = {topic: min(most / max(contents.counts.get(topic, 0), 1), 1.0) for topic in left}
    while left:
        found = {
            topic: Looked(kind, share=shares.get(topic, 1.0))
            for topic, kind in contents.types.items()
        }
        try:
            for topic, _, message in messages(bag, left, [], shares):
                found[topic].take(message)
            break
        except InputError as error:  # a topic without a definition of its type
            if error.key not in left:
                break
            left.discard(error.key)
            contents.notes.append(f'fields not looked at: {error}')
    return found


def component_of(topic: str, path: str, *, forces: bool = False) -> str:
    """Component that a path in a topic is named after; '' where that is not clear.

    `forces`: whether capitals are components of a wrench.
    """
    own = [word for word in words_of(path) if word not in UNITS and word not in NAMED]
    own = own or words_of(path)
    words, exact = [*words_of(topic), *own], path.rpartition('.')[2]
    if not own or {*NOT_MEASURED, *THRUSTING}.intersection(words) or {*DERIVED}.intersection(own):
        return ''
    forced, last = bool(set(FORCING) & set(words)), own[-1]
    capital = (forced or forces) and exact in COMPONENTS['wrench']
    turn, along = (next((places[word] for word in own[-2:] if word in places), None)
                   for places in (TURNS, ALONG))  # fmt: skip
    kinds = [word for word, before in zip(words[:-1], ['', *words], strict=False)
             if word in KINDS and before != 'angular']  # fmt: skip
    kind = KINDS[kinds[-1]] if kinds else None
    found = ''
    if last == 'w' and kind == QUATERNION[1:]:
        found = 'qw'
    elif capital or (exact in COMPONENTS['twist'] and (kind is None or exact in kind)):
        found = exact
    elif turn is not None:
        rated = set(words) & set(TURNING)
        found = 'KMN'[turn] if forced else 'pqr'[turn] if rated else EULER[turn]
    elif along is not None:
        found = ('XYZ' if forced else 'uvw')[along]
    elif last == 'depth':
        found = 'z'
    elif kind and last in AXES:
        found = kind[AXES[last]]
    elif kind in (tuple('XYZ'), tuple('uvw')) and last in ('3', '4', '5'):
        found = ('KMN' if kind[0] == 'X' else 'pqr')[int(last) - 3]
    elif kind is None and exact in POSITION:
        found = exact
    return found


def unit_of(component: str, path: str, looked: Looked) -> str:
    """Unit of a component by what the file or the path says, else by its range; '': SI."""
    si, span = SI.get(component, ''), looked.spans[path]
    bracket = re.search(r'[\[(]([^\d\])][^\])]*)[\])]', path)
    told = [looked.units.get(path, ''), bracket.group(1) if bracket else '', *words_of(path)]
    for text in told:
        name = NAMED.get(text, text)
        for unit in (name, f'{name}/s'):
            if unit in UNITS and UNITS[unit][0] == si:
                return '' if UNITS[unit][1] == 1.0 else unit
    size = max(abs(span.low), abs(span.high)) if span.filled else 0.0
    if si == 'rad' and size > LARGEST_ANGLE:
        return 'deg'
    return 'deg/s' if si == 'rad/s' and size > LARGEST_RATE else ''


def offered(role: str, topic: str, looked: Looked) -> dict[str, str]:
    """Component of a role -> path: those of the type, else by names; an attitude whole or not.

    Attitude, velocity and angular velocity of zeros alone are none.
    """
    told = presets(role).get(looked.kind)
    found: dict[str, str] = {}
    if isinstance(told, Mapping):
        found = {name: str(path) for name, path in told.items()}
    usable = (*COMPONENTS[role], *(EULER if role == 'pose' else ()))
    forces = {*'KMN'} <= set(looked.spans)
    for path, span in () if found else looked.spans.items():
        component = component_of(topic, path, forces=forces) if span.filled else ''
        if component in usable:
            found.setdefault(component, path)
    for names in (EULER, QUATERNION, tuple('uvw'), tuple('pqr'), ('x',), ('y',), ('z',)):
        paths = [found[name] for name in names if name in found]
        whole = len(paths) == len(names) or names not in (EULER, QUATERNION)
        twice = names == EULER and 'qw' in found
        if not whole or twice or (looked.count and looked.is_dead(paths)):
            found = {name: path for name, path in found.items() if name not in names}
    return found


def proposal(bag: Path, contents: BagContents, looked: Mapping[str, Looked]) -> str:
    """Text of a mapping file for a log.

    Parameters
    ----------
    bag : folder or file
    contents, looked : its survey and what its messages were found to hold

    """
    known = candidates(contents)
    least = {'qw', 'u', 'p'}  # of an odometry that has its three halves
    whole = [topic for topic in known['odometry']
             if least <= {*offered('pose', topic, looked[topic]),
                          *offered('twist', topic, looked[topic])}]  # fmt: skip
    left_out = [f'{topic}: no attitude or no velocity in it but zeros'
                for topic in known['odometry'] if topic not in whole]  # fmt: skip
    left_out += [f'{topic}: an odometry as well' for topic in whole[1:]]
    roles: dict[str, Any] = {}
    if whole:
        roles['odometry'] = [{'topic': whole[0]}]
    else:
        roles |= {role: _entries(role, looked) for role in ('pose', 'twist')}
    roles['wrench'] = [{'topic': topic} for topic in known['wrench'][:1]]
    roles['wrench'] = roles['wrench'] or _entries('wrench', looked)
    if not roles['wrench']:
        roles['thrusters'] = _thrusters(known['thrusters'], looked)
    roles['setpoint'] = [{'topic': topic} for topic in known['setpoint'][:1]]
    return _text(bag, roles, looked, left_out)


def _entries(role: str, looked: Mapping[str, Looked]) -> list[dict[str, Any]]:
    """Topics that together have the components of a role, those with most of them first."""
    asked = ASKED if role != 'wrench' else ()
    offers = {topic: offered(role, topic, one) for topic, one in looked.items()
              if len(looked) == 1
              or not (has_word(topic, asked) or has_word(role_of(topic), DERIVED))}  # fmt: skip
    missing = {name for offer in offers.values() for name in offer}
    chosen: list[dict[str, Any]] = []
    while missing:
        topic = max(offers, key=lambda topic: len(missing.intersection(offers[topic])))
        taken = {name: path for name, path in offers[topic].items() if name in missing}
        missing -= set(taken)
        if 'phi' in taken or 'qw' in taken:
            missing -= {*EULER, *QUATERNION}
        whole = taken == presets(role).get(looked[topic].kind)
        fields = {} if whole else {'fields': taken}
        chosen.append({'topic': topic, **fields, **_units(taken, looked[topic])})
    return chosen


def _units(taken: Mapping[str, str], looked: Looked) -> dict[str, Any]:
    """`units` of an entry; one word where that says it all."""
    units = {
        name: unit_of(name, path, looked) for name, path in taken.items() if path in looked.spans
    }
    kinds = {SI.get(name, ''): unit for name, unit in units.items() if unit}
    if not kinds:
        return {}
    ((kind, unit), *others) = kinds.items()
    same = all(said == unit for name, said in units.items() if SI.get(name, '') == kind)
    if same and not others:
        return {'units': unit}
    return {'units': {name: unit for name, unit in units.items() if unit}}


def _thrusters(known: Sequence[str], looked: Mapping[str, Looked]) -> list[dict[str, Any]]:
    """The topic with most fields that are named after thrusters and numbered."""
    best: list[str] = []
    where = ''
    for topic, one in looked.items():
        if topic in known:
            return [{'topic': topic}]
        paths = [path for path in one.spans
                 if has_word(f'{topic} {path}', THRUSTING)
                 and re.search(r'\d', path) and not one.is_dead([path])]  # fmt: skip
        if len(paths) > len(best):
            best, where = paths, topic
    if not best:
        return []
    spans = [looked[where].spans[path] for path in best]
    pulses = all(PULSES[0] <= span.low <= span.high <= PULSES[1] for span in spans)
    return [{'topic': where, 'fields': best, **({'curve': CURVE} if pulses else {})}]


def _text(
    bag: Path, roles: Mapping[str, Any], looked: Mapping[str, Looked], left_out: Sequence[str]
) -> str:
    """The mapping file; what it lacks as comments."""
    lines = [
        f'# proposed for {bag.name}: check axes, signs and units', 'format: 1',
        '# vehicle: my_auv.yaml    # beside this file, a shipped name, or --vehicle',
    ]  # fmt: skip
    every = [entry for role, entries in roles.items() for entry in entries if role != 'thrusters']
    axes = [_axes(entry, looked[entry['topic']]) for entry in every]
    usual = max((frames for frames, _ in axes), key=[f for f, _ in axes].count, default='')
    if usual:
        why = next((why for frames, why in axes if frames == usual and why), '')
        lines.append(f'frames: {usual}' + (f'    # {why}' if why else ''))
    for role, entries in roles.items():
        shown = []
        for entry in entries:
            one = looked[entry['topic']]
            frames, why = _axes(entry, one)
            own = {'frames': frames} if frames != usual and role != 'thrusters' else {}
            path, unit = one.stamp
            timed = (
                {'stamp': {'field': path, 'units': unit} if unit != 's' else path} if path else {}
            )
            shown.append((entry | own | timed, why if own else ''))
        lines += _role(role, shown)
    lines += _lacking(roles, looked)
    return '\n'.join([*lines, *(f'# {line}' for line in left_out)]) + '\n'


def _role(role: str, shown: Sequence[tuple[dict[str, Any], str]]) -> list[str]:
    """Lines of a role."""
    if not shown:
        lacking = {'thrusters': 'wrench or thrusters', 'setpoint': '', 'wrench': ''}.get(role, role)
        return [f'# {lacking}: no topic was found'] if lacking else []
    flow = [yaml_text(entry, default_flow_style=True, width=10**6).strip()
            for entry, _ in shown]  # fmt: skip
    comments = [f'    # {why}' if why else '' for _, why in shown]
    if len(flow) == 1:
        return [f'{role}: {flow[0]}{comments[0]}']
    return [f'{role}:', *(f'  - {text}{why}' for text, why in zip(flow, comments, strict=True))]


def _lacking(roles: Mapping[str, Any], looked: Mapping[str, Looked]) -> list[str]:
    """Components that no topic has, and the angular velocity by the attitude."""
    lines = []
    for role in ('pose', 'twist', 'wrench'):
        names = {
            name for entry in roles.get(role, ())
            for name in entry.get('fields') or presets(role)[looked[entry['topic']].kind]
        }  # fmt: skip
        names |= set(QUATERNION) if 'phi' in names else set()
        lost = [name for name in COMPONENTS[role] if name not in names]
        lost = [name for name in lost if name not in QUATERNION] + [*EULER] * ('qw' in lost)
        if role == 'twist' and {*'pqr'} <= set(lost) < {*COMPONENTS['twist']} and roles.get('pose'):
            lines.append('rates: from attitude')
            lost = [name for name in lost if name not in 'pqr']
        if lost and names:
            more = ': write 0 for those without actuator' if role == 'wrench' else ''
            lines.append(f'# {role}: no topic was found with {", ".join(lost)}{more}')
    return lines


def _axes(entry: Mapping[str, Any], one: Looked) -> tuple[str, str]:
    """Axes of a topic, and why they are a guess; '' where its names say them."""
    topic, fields = entry['topic'], entry.get('fields')
    named = {axes for axes in map(named_axes, [*one.ids, topic]) if axes}
    ids = f'the frame ids {", ".join(one.ids)} of {topic}' if one.ids else f'the names of {topic}'
    if len(named) == 1:
        return named.pop(), ''
    if named:
        return ENU_FLU, f'{ids} contradict each other'
    if isinstance(fields, dict) and 'depth' in words_of(str(fields.get('z', ''))):
        return NED_FSD, 'depth grows downwards'
    return ENU_FLU if one.kind in PRESETS else NED_FSD, f'{ids} do not say: a guess'
