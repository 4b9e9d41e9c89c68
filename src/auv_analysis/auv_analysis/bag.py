"""Reading a recorded run: every MCAP bag of the graph, finished or not, becomes a `Run`."""

import os
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Attachment, Channel, Footer, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory

from auv_analysis.run import Run
from auv_analysis.simulation import unwrapped_eta
from auv_dynamics import interface
from auv_dynamics.files import InputError, parse_yaml
from auv_dynamics.vehicle import Vehicle
from auv_dynamics.vehicle_file import load_vehicle, vehicle_from_dict
from auv_gvc_controller.laws import make_gains

NAME = re.compile('[A-Za-z0-9][A-Za-z0-9_.+-]{0,99}')
MAGIC = b'\x89MCAP0\r\n'
READERS = {
    interface.ODOM: interface.read_odometry,
    interface.CMD_VEL: lambda m, frames: interface.read_twist(m, frames, interface.CMD_VEL),
    interface.CMD_ACCEL: lambda m, frames: interface.read_accel(m, frames, interface.CMD_ACCEL),
    interface.WRENCH: lambda m, frames: interface.read_wrench(m, frames, interface.WRENCH),
    interface.WRENCH_APPLIED: lambda m, frames: interface.read_wrench(
        m, frames, interface.WRENCH_APPLIED
    ),
    interface.GROUND_TRUTH: lambda m, frames: interface.read_odometry(
        m, frames, interface.GROUND_TRUTH
    ),
    interface.DISTURBANCE: lambda m, frames: interface.read_wrench(
        m, frames, interface.DISTURBANCE
    ),
    interface.DISTURBANCE_ESTIMATE: lambda m, frames: interface.read_wrench(
        m, frames, interface.DISTURBANCE_ESTIMATE
    ),
}
KINDS = {
    interface.ODOM: 'nav_msgs/msg/Odometry',
    interface.CMD_VEL: 'geometry_msgs/msg/TwistStamped',
    interface.CMD_ACCEL: 'geometry_msgs/msg/AccelStamped',
    interface.WRENCH: 'geometry_msgs/msg/WrenchStamped',
    interface.WRENCH_APPLIED: 'geometry_msgs/msg/WrenchStamped',
    interface.GROUND_TRUTH: 'nav_msgs/msg/Odometry',
    interface.DISTURBANCE: 'geometry_msgs/msg/WrenchStamped',
    interface.DISTURBANCE_ESTIMATE: 'geometry_msgs/msg/WrenchStamped',
}
UNKNOWN = 'unknown'  # law of a bag without params.yaml
REQUIRED = (interface.ODOM, interface.WRENCH)


@dataclass
class Contents:
    """What lies in a bag, before anything is made of it.

    Attributes
    ----------
    attachments : name -> text
    metadata : name -> mapping
    types : topic -> message type
    counts : topic -> number of messages
    first, last : ns, None when the bag is empty
    messages : topic -> stamps in ns and values, of the topics that were asked for
    notes : what is odd, one line each

    """

    attachments: dict[str, str] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    types: dict[str, str] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    first: int | None = None
    last: int | None = None
    messages: dict[str, tuple[list[int], list[tuple]]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def bag_files(bag: str | Path) -> list[Path]:
    """MCAP files of a bag, in order; InputError when there are none."""
    path = Path(bag)
    is_folder = os.path.isdir(path)  # Path.is_dir raises for a name that is too long
    files = sorted(path.glob('*.mcap'), key=_split_order) if is_folder else [path]
    if not files or not os.path.isfile(files[0]):
        found = 'a folder without .mcap files' if is_folder else 'no such file or folder'
        raise InputError(path, '', 'a bag folder or an .mcap file', found)
    return files


def _head(path: Path) -> bytes:
    with path.open('rb') as stream:
        return stream.read(len(MAGIC))


def _split_order(path: Path) -> tuple[int, str]:
    number = path.stem.rpartition('_')[2]
    return (int(number) if number.isdigit() else 0, path.name)


def _records(path: Path, notes: list[str]) -> Iterator[Any]:
    finished = False
    with path.open('rb') as stream:
        try:
            for record in StreamReader(stream, validate_crcs=True).records:
                finished = finished or isinstance(record, Footer)
                yield record
        except (EndOfFile, struct.error):  # the reader unpacks a record that is cut without asking
            if 0 < stream.tell() < len(MAGIC) or not MAGIC.startswith(_head(path)):
                raise InputError(path, '', 'an MCAP file', 'another beginning') from None
        except (McapError, ValueError, KeyError, OverflowError, RuntimeError) as error:
            if stream.tell() <= 64:
                found = str(error).splitlines()[0]
                raise InputError(path, '', 'an MCAP file', found) from None
            notes.append(f'{path.name}: damaged from byte {stream.tell()}, read up to there')
            finished = True
    if not finished:
        notes.append(f'{path.name}: was not finished, its writer was killed; read to the end')


def read_bag(bag: str | Path, *, decode: bool = True) -> Contents:
    """Read a bag.

    Parameters
    ----------
    bag : folder or .mcap file
    decode : decode the step topics; else only count

    Raises
    ------
    InputError : not a bag, or a message that must not be used

    """
    contents = Contents()
    frames: dict[str, interface.Frames] = {}
    for path in bag_files(bag):
        schemas: dict[int, Schema] = {}
        channels: dict[int, Channel] = {}
        decoders: dict[int, Any] = {}
        for record in _records(path, contents.notes):
            if isinstance(record, Message):
                topic = channels[record.channel_id].topic
                contents.counts[topic] = contents.counts.get(topic, 0) + 1
                first, last = contents.first, contents.last
                contents.first = record.log_time if first is None else min(first, record.log_time)
                contents.last = record.log_time if last is None else max(last, record.log_time)
                if decode and record.channel_id in decoders:
                    decoder = decoders[record.channel_id]
                    message = _decoded(decoder, record.data, path, topic)
                    _keep(contents, path, topic, message, frames)
            elif isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                if record.id in channels:
                    continue
                channels[record.id] = record
                schema = schemas.get(record.schema_id)
                contents.types[record.topic] = schema.name if schema else ''
                if decode and _role(record.topic) in READERS:
                    _check_type(path, record.topic, contents.types[record.topic])
                    # a factory of its own per file: schema ids are only unique within one
                    decoder = DecoderFactory().decoder_for(record.message_encoding, schema)
                    if decoder is not None:
                        decoders[record.id] = decoder
            elif isinstance(record, Attachment):
                contents.attachments[record.name] = record.data.decode('utf-8', 'replace')
            elif isinstance(record, Metadata):
                contents.metadata[record.name] = dict(record.metadata)
    return contents


def _decoded(decoder: Any, data: bytes, path: Path, topic: str) -> Any:
    try:
        return decoder(data)
    except (struct.error, ValueError, EOFError) as error:
        raise InputError(path, topic, 'messages of its type', str(error)) from None


def _check_type(path: Path, topic: str, found: str) -> None:
    expected = KINDS[_role(topic)]
    if found != expected:
        raise InputError(path, topic, expected, found)


def _role(topic: str) -> str:
    """Our name of a topic, whatever its namespace."""
    if topic.endswith(f'/{interface.GROUND_TRUTH}'):
        return interface.GROUND_TRUTH
    return topic.rpartition('/')[2]


def _keep(contents: Contents, path: Path, topic: str, message: Any, frames: dict) -> None:
    role = _role(topic)
    namespace = topic.removesuffix(role)
    if role in (interface.ODOM, interface.GROUND_TRUTH):
        frames.setdefault(
            namespace, interface.Frames(message.header.frame_id, message.child_frame_id)
        )
    known = frames.get(namespace) or interface.Frames(base=message.header.frame_id)
    try:
        ns, values = READERS[role](message, known)
    except interface.BadMessageError as error:
        raise InputError(path, topic, 'usable messages', str(error)) from None
    stamps, rows = contents.messages.setdefault(topic, ([], []))
    stamps.append(ns)
    rows.append(values)


def load_run(bag: str | Path, vehicle: str | Path | None = None) -> Run:
    """Run of a recorded bag.

    Parameters
    ----------
    bag : folder or .mcap file
    vehicle : vehicle file for a bag that does not carry its own

    Returns
    -------
    run : Run that ends at the last step complete on all step topics; `run.notes` says what was
        dropped and whether the recording was finished

    Raises
    ------
    InputError : no bag, no vehicle, or topics missing

    """
    contents = read_bag(bag)
    by_role = _one_graph(contents, Path(bag))
    ns, series, dropped = _complete(by_role, Path(bag))
    notes = [*contents.notes, *dropped]
    parameters = _parameters(contents, Path(bag))
    controller, step = parameters.get('controller_node', {}), _step(parameters, ns, Path(bag))
    law, gains = _law_and_gains(controller, Path(bag))
    x = series.get(interface.GROUND_TRUTH, series[interface.ODOM])
    sensing = interface.GROUND_TRUTH in series
    nu_d = series.get(interface.CMD_VEL, np.zeros((len(ns), 6)))
    return Run(
        t=(ns - ns[0]) / interface.NANOSECONDS,
        eta=unwrapped_eta(x),
        nu=x[:, 7:],
        nu_d=nu_d,
        nu_d_dot=series.get(interface.CMD_ACCEL, np.gradient(nu_d, step, axis=0)),
        tau=series[interface.WRENCH],
        disturbance=series.get(interface.DISTURBANCE),
        disturbance_estimate=series.get(interface.DISTURBANCE_ESTIMATE, np.zeros((len(ns), 6))),
        vehicle=_vehicle(contents, Path(bag), vehicle),
        scenario=_scenario_name(contents, Path(bag)),
        controller=_controller_name(parameters, Path(bag)),
        law=law,
        gains=gains,
        step=step,
        source='bag',
        measured=series[interface.ODOM][:, 7:] if sensing else None,
        applied=series.get(interface.WRENCH_APPLIED),
        kinds=_kinds(contents, Path(bag)),
        notes=tuple(notes),
    )


def _one_graph(contents: Contents, bag: Path) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Stamps and values by role, of the first namespace that has an odometry."""
    spaces = sorted(
        {t.removesuffix(_role(t)) for t in contents.messages if _role(t) == interface.ODOM}
    )
    found = ', '.join(sorted(contents.types)) or 'no topics'
    if not spaces:
        raise InputError(bag, interface.ODOM, 'messages', found)
    if len(spaces) > 1:
        contents.notes.append(f'several vehicles in the bag: read {spaces[0]}, left {spaces[1:]}')
    by_role = {}
    for role in READERS:
        stamps, rows = contents.messages.get(f'{spaces[0]}{role}', ([], []))
        if stamps:
            by_role[role] = (np.array(stamps, np.int64), np.array(rows, float))
        elif role in REQUIRED:
            raise InputError(bag, role, 'messages', found)
    return by_role


def _complete(
    by_role: dict[str, tuple[np.ndarray, np.ndarray]], bag: Path
) -> tuple[np.ndarray, dict[str, np.ndarray], list[str]]:
    """Stamps that are on every step topic, the values there, and what was dropped."""
    stamps = None
    for ns, _ in by_role.values():
        stamps = ns if stamps is None else np.intersect1d(stamps, ns)
    if stamps is None or len(stamps) < 2:
        raise InputError(bag, '', 'at least two steps that are complete on all step topics', '0')
    stamps = np.unique(stamps)
    series, notes = {}, []
    for role, (ns, rows) in by_role.items():
        order = np.argsort(ns, kind='stable')
        index = order[np.searchsorted(ns[order], stamps)]
        series[role] = rows[index]
        extra = len(ns) - len(stamps)
        if extra:
            notes.append(f'{role}: {extra} of {len(ns)} messages are not complete on all topics')
    return stamps, series, notes


def _parameters(contents: Contents, bag: Path) -> dict[str, dict[str, Any]]:
    """Node name -> its parameters, from the attached parameter file."""
    text = contents.attachments.get('params.yaml')
    if text is None:
        return {}
    file = f'{bag}: params.yaml'
    found: dict[str, dict[str, Any]] = {}
    for name, entry in parse_yaml(text, file, 'parameter').items():
        values = entry.get('ros__parameters') if isinstance(entry, dict) else None
        if not isinstance(values, dict):
            raise InputError(file, name, 'a mapping with ros__parameters', entry)
        found[name.rpartition('/')[2]] = values
    return found


def _step(parameters: dict[str, dict[str, Any]], ns: np.ndarray, bag: Path) -> float:
    step = parameters.get('plant_node', {}).get('step')
    if step is None:
        return float(np.median(np.diff(ns))) / interface.NANOSECONDS
    if not (isinstance(step, int | float) and 0 < step < np.inf):
        raise InputError(f'{bag}: params.yaml', 'plant_node: step', 'a positive number (s)', step)
    return float(step)


def _controller_name(parameters: dict[str, dict[str, Any]], bag: Path) -> str:
    recorded = parameters.get('recorder_node', {}).get('bag', str(bag))
    if not isinstance(recorded, str):
        raise InputError(f'{bag}: params.yaml', 'recorder_node: bag', 'a folder', recorded)
    return Path(recorded).name


def _law_and_gains(controller: dict[str, Any], bag: Path) -> tuple[str, dict[str, Any]]:
    gains = {}
    for key, value in controller.items():
        if key.startswith('gains.'):
            one = isinstance(value, list) and len(value) == 1
            gains[key.removeprefix('gains.')] = value[0] if one else value
    law = controller.get('law')
    file = f'{bag}: params.yaml'
    if law is None:
        return UNKNOWN, {}  # a bag that somebody else recorded says nothing of it
    try:
        make_gains(law, gains)
    except ValueError as error:
        raise InputError(file, 'controller_node', str(error), 'another law or gain') from None
    return law, gains


def _vehicle(contents: Contents, bag: Path, vehicle: str | Path | None) -> Vehicle:
    if vehicle is not None:
        return load_vehicle(vehicle)
    text = contents.attachments.get('vehicle.yaml')
    if text is None:
        raise InputError(bag, 'vehicle.yaml', 'an attachment, or --vehicle FILE', None)
    file = f'{bag}: vehicle.yaml'
    return vehicle_from_dict(parse_yaml(text, file, 'vehicle'), file)


def _kinds(contents: Contents, bag: Path) -> frozenset[str] | None:
    """Kinds of the disturbances, None where the bag does not say."""
    text, file = contents.attachments.get('scenario.yaml'), f'{bag}: scenario.yaml'
    if text is None:
        return None
    listed = parse_yaml(text, file, 'scenario').get('disturbance', [])
    specs = listed if isinstance(listed, list) else [listed]
    return frozenset(
        str(spec['kind']) for spec in specs if isinstance(spec, dict) and 'kind' in spec
    )


def _scenario_name(contents: Contents, bag: Path) -> str:
    text, file = contents.attachments.get('scenario.yaml'), f'{bag}: scenario.yaml'
    if text is None:
        return bag.resolve().parent.name
    name = parse_yaml(text, file, 'scenario').get('name')
    if not (isinstance(name, str) and NAME.fullmatch(name)):
        raise InputError(file, 'name', 'a word without blanks or slashes', name)
    return name
