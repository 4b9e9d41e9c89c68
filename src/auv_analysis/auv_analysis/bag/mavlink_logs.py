"""ArduPilot's logs as messages of topics: telemetry logs (.tlog) and on-board logs (.BIN)."""

import mmap
import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from auv_analysis.bag.dataflash_log import DataFlashLog
from auv_analysis.bag.metadata import BAG, LOGS, TopicExtent
from auv_analysis.bag.reading import BagContents
from auv_analysis.bag.telemetry_log import Message, TelemetryLog
from auv_dynamics.files.errors import InputError, refusing

SLOW = 9.0  # Hz, from which what should come at 10 Hz is too slow
FAST = 'bit 0 (ATTITUDE_FAST) of LOG_BITMASK, 25 Hz'
HINTS = {
    'ATTITUDE': 'SR0_EXTRA1', 'SERVO_OUTPUT_RAW': 'SR0_RC_CHAN',
    'LOCAL_POSITION_NED': 'SR0_POSITION', 'ATT': FAST, 'RATE': FAST, 'XKF1[0]': FAST,
    'RCOU': 'bit 10 (RCOUT) of LOG_BITMASK, 10 Hz and no more',
}  # fmt: skip


def survey_of_log(path: Path) -> BagContents:
    """Topics, counts, span and parameters of a log."""
    contents = BagContents()
    with _opened(path) as log:
        for topic, tally in log.tallies(contents.notes).items():
            contents.types[topic] = f'{log.kind}/{topic.partition("[")[0]}'
            contents.add(topic, tally.first, tally.last, tally.count)
            contents.notes += too_slow(topic, tally)
        contents.parameters = log.parameters
    return contents


def messages_of_log(path: Path, topics: Collection[str], notes: list[str]) -> Iterator[Message]:
    """Messages of some topics, in the order of the log; `notes` gets what was damaged."""
    with _opened(path) as log:
        tallies = log.tallies([])
        yield from log.messages(topics, notes)
    for topic, tally in tallies.items():
        notes += too_slow(topic, tally) if topic in topics else []


def too_slow(topic: str, tally: TopicExtent) -> list[str]:
    """A note where a topic comes too seldom to identify a vehicle from, and what raises it."""
    if topic not in HINTS or tally.rate >= SLOW or tally.count < 2:
        return []
    raised = HINTS[topic]
    if raised.startswith('SR'):
        raised += ' (SR1_ and so on of other ports) or MAV_CMD_SET_MESSAGE_INTERVAL'
    return [
        f'{topic}: {tally.rate:.3g} Hz; identification wants 10 Hz and more of attitude and servo '
        f'outputs: raise {raised}'
    ]


@contextmanager
def _opened(path: Path) -> 'Iterator[TelemetryLog | DataFlashLog]':
    if not os.path.isfile(path):
        raise InputError(path, '', BAG, 'no such file')
    _library()
    kind = TelemetryLog if path.suffix.lower() == LOGS[0] else DataFlashLog
    with refusing(path, '', 'a file that can be read'), path.open('rb') as file:
        size = file.seek(0, 2)
        if not size:
            raise InputError(path, '', f'a {path.suffix} log', 'an empty file')
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            yield kind(path, data)


def _library() -> None:
    try:
        import pymavlink  # noqa: F401
    except ImportError:
        expected = 'pymavlink installed: pip install -r requirements-mavlink.txt'
        raise InputError('pymavlink', '', expected, 'no such module') from None
