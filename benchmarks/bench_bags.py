"""Reading bags to arrays: against `mcap`'s raw reader and, for information, the usual decoders."""

from collections.abc import Callable
from pathlib import Path

from made_bags import BRIEF, made_bag
from mcap.reader import make_reader
from mcap_ros2.reader import read_ros2_messages
from measure import Measured, interleaved, speed
from rosbags.highlevel import AnyReader

from auv_analysis.bag.metadata import bag_files
from auv_analysis.bag.reading import read_bag

FEW = 2_000  # steps of 8 messages each, for those that decode message by message


def against_readers() -> dict[str, Measured]:
    """Messages per second to arrays; the raw reader only hands out records."""
    long, brief = made_bag(BRIEF), made_bag(FEW)
    messages = raw(long)
    if sum(read_bag(long).counts.values()) != messages:
        raise ArithmeticError(f'expected all {messages} messages, found others')
    ours, unit = speed(lambda: read_bag(long), messages), 'messages/s'
    found = interleaved({'bag_read_vs_raw_reader': ours}, _speed(raw, long), unit)
    for name, decoder in (('rosbags', rosbags), ('mcap_ros2_support', mcap_ros2_support)):
        found |= interleaved({f'bag_read_vs_{name}': ours}, _speed(decoder, brief), unit)
    return found


def _speed(read: Callable[[Path], int], bag: Path) -> Callable[[], float]:
    return speed(lambda: read(bag), read(bag))


def raw(bag: Path) -> int:
    """Number of messages that `mcap` hands out undecoded."""
    with bag_files(bag)[0].open('rb') as stream:
        return sum(1 for _ in make_reader(stream).iter_messages())


def rosbags(bag: Path) -> int:
    """Number of messages that rosbags decodes."""
    with AnyReader([bag]) as reader:
        messages = (reader.deserialize(data, c.msgtype) for c, _, data in reader.messages())
        return sum(1 for _ in messages)


def mcap_ros2_support(bag: Path) -> int:
    """Number of messages that mcap-ros2-support decodes."""
    return sum(1 for _ in read_ros2_messages(bag_files(bag)[0]))
