"""Reading a bag: ours against the readers of others, per message and interleaved in one run.

`python benchmarks/bags.py` prints the table; a harness calls `measured`.
"""

import json
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

from made_bags import make_bag
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from auv_analysis.bag import read_bag

STEPS = 50_000  # of the bag, eight messages each
SHORT = 1_000  # of the one for readers that decode each message
RUNS = 7


def bulk_read(bag: Path) -> int:
    """Our reader, to arrays of every step topic, checksums verified; number of messages."""
    return sum(read_bag(bag).counts.values())


def mcap_raw_reader(bag: Path) -> int:
    """The `mcap` package: every message as bytes, nothing decoded, no checksums."""
    with _file(bag).open('rb') as stream:
        return sum(1 for _ in make_reader(stream).iter_messages())


def mcap_ros2_support(bag: Path) -> int:
    """The `mcap-ros2-support` package: every message decoded."""
    with _file(bag).open('rb') as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return sum(1 for _ in reader.iter_decoded_messages())


def rosbags(bag: Path) -> int:
    """The `rosbags` package: every message decoded."""
    with AnyReader([bag]) as reader:
        messages = (reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages())
        return sum(1 for _ in messages)


def measured(folder: Path, steps: int = STEPS, runs: int = RUNS) -> dict[str, dict[str, Any]]:
    """Ratios of speed by key, each against another reader.

    Parameters
    ----------
    folder : for the bags, made here
    steps : of the long bag
    runs : of each reader, interleaved

    Returns
    -------
    results : key -> value and reference in us per message, ratio: the median of the runs' gains

    """
    long, short = make_bag(folder / 'long', steps), make_bag(folder / 'short', SHORT)
    bulk_read(short)  # imports
    against: dict[str, tuple[Callable[[Path], int], Path]] = {
        'bag_read_vs_raw_reader': (mcap_raw_reader, long),
        'bag_read_vs_rosbags': (rosbags, short),
        'bag_read_vs_ros2_support': (mcap_ros2_support, short),
    }
    times: dict[str, list[tuple[float, float]]] = {key: [] for key in against}
    for _ in range(runs):
        ours = _per_message(bulk_read, long)
        for key, (reader, bag) in against.items():
            times[key].append((ours, _per_message(reader, bag)))
    return {
        key: {
            'value': median(ours for ours, _ in pairs),
            'unit': 'us/message',
            'ratio': median(theirs / ours for ours, theirs in pairs),
            'reference': median(theirs for _, theirs in pairs),
            'runs': runs,
        }
        for key, pairs in times.items()
    }


def _per_message(reader: Callable[[Path], int], bag: Path) -> float:
    begin = time.perf_counter()
    messages = reader(bag)
    return 1e6 * (time.perf_counter() - begin) / messages


def _file(bag: Path) -> Path:
    return next(bag.glob('*.mcap'))


def main() -> None:
    """Measure in a temporary folder and print what was found."""
    with tempfile.TemporaryDirectory() as folder:
        results = measured(Path(folder))
    json.dump(results, sys.stdout, indent=2)
    print()


if __name__ == '__main__':
    main()
