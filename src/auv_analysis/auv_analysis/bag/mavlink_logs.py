"""ArduPilot's logs, telemetry (.tlog) and on-board (.BIN), as messages of topics; their mapping."""

import mmap
import os
import re
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from auv_analysis.bag.dataflash_log import DataFlashLog
from auv_analysis.bag.metadata import BAG, LOGS, TopicExtent
from auv_analysis.bag.reading import BagContents
from auv_analysis.bag.telemetry_log import Message, TelemetryLog
from auv_dynamics.files.errors import InputError, refusing
from auv_dynamics.files.yaml_files import yaml_text

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


MOTOR = 33  # SERVOn_FUNCTION of motor 1
MOTORS = {'0': 6, '1': 6, '2': 8, '3': 8, '4': 3, '5': 4, '6': 5}  # by FRAME_CONFIG
EIGHT = 8
CURVE = 't200_16v'  # of a thruster that many have
ESTIMATORS = ('XKF1[0]', 'XKF1', 'NKF1[0]', 'NKF1')  # newest first; of several cores the first
GYROS = ('IMU[0]', 'IMU')


def preset(contents: BagContents) -> str:
    """Text of a mapping file of a log of ArduSub; '' for anything else.

    Axes are those of ArduPilot, NED and FSD. Radians in telemetry, degrees on board.

    Parameters
    ----------
    contents : survey of the log, with its parameters where it has them

    """
    have = set(contents.types)
    if contents.types.get('ATTITUDE') == 'mavlink/ATTITUDE':
        stamp = {'stamp': {'field': 'time_usec', 'units': 'us'}}
        found = {'stamp': {'field': 'time_boot_ms', 'units': 'ms'}} | _telemetry(have)
        found |= _thrusters(contents, 'SERVO_OUTPUT_RAW', stamp)
    elif contents.types.get('ATT') == 'dataflash/ATT':
        found = {'stamp': {'field': 'TimeUS', 'units': 'us'}} | _onboard(have)
        found |= _thrusters(contents, 'RCOU', {})
    else:
        return ''
    return HEAD + yaml_text(found)


HEAD = """# proposed for a log of ArduSub: check the curve and its voltage
format: 1
# vehicle: my_auv.yaml    # with thrusters in the order of the motors; or --vehicle
frames: ned_fsd
"""
OUTPUTS = {'SERVO_OUTPUT_RAW': 'servo{}_raw', 'RCOU': 'C{}'}


def _entry(topic: str, names: str, fields: str, **more: Any) -> dict[str, Any]:
    pairs = zip(names.split(), fields.split(), strict=True)
    return {'topic': topic, 'fields': dict(pairs), **more}


def _telemetry(have: set[str]) -> dict[str, Any]:
    pose = [_entry('ATTITUDE', 'phi theta psi', 'roll pitch yaw')]
    twist = [_entry('ATTITUDE', 'p q r', 'rollspeed pitchspeed yawspeed')]
    if (local := 'LOCAL_POSITION_NED') in have:
        pose.append(_entry(local, 'x y z', 'x y z'))
        twist.append(_entry(local, 'u v w', 'vx vy vz', twist_frame='world'))
    return {'pose': pose, 'twist': twist}


def _onboard(have: set[str]) -> dict[str, Any]:
    pose = [_entry('ATT', 'phi theta psi', 'Roll Pitch Yaw', units='deg')]
    twist, more = [], {}
    estimator = next((topic for topic in ESTIMATORS if topic in have), None)
    gyro = next((topic for topic in GYROS if topic in have), None)
    if estimator:
        pose.append(_entry(estimator, 'x y z', 'PN PE PD'))
        twist.append(_entry(estimator, 'u v w', 'VN VE VD', twist_frame='world'))
    if 'RATE' in have:
        twist.append(_entry('RATE', 'p q r', 'R P Y', units='deg/s'))
    elif gyro:
        twist.append(_entry(gyro, 'p q r', 'GyrX GyrY GyrZ'))
    else:
        more['rates'] = 'from attitude'
    return {'pose': pose, 'twist': twist, **more}


def _thrusters(contents: BagContents, topic: str, stamp: Mapping[str, Any]) -> dict[str, Any]:
    """Outputs in the order of the motors, as parameters tell; else the first eight."""
    if topic not in contents.types:
        return {}
    told = contents.parameters
    servos = ((re.fullmatch(r'SERVO(\d+)_FUNCTION', name), told[name]) for name in told)
    outputs = {float(value) - MOTOR: int(servo[1]) for servo, value in servos if servo}
    count = MOTORS.get(told.get('FRAME_CONFIG', ''), EIGHT)
    order = [outputs.get(motor, motor + 1) for motor in range(count)]
    mirrored = [i + 1 for i in range(count) if told.get(f'MOT_{i + 1}_DIRECTION') == '-1']
    fields = [OUTPUTS[topic].format(output) for output in order]
    reverse = {'reversed': mirrored} if mirrored else {}
    return {'thrusters': {'topic': topic, **stamp, 'fields': fields, 'curve': CURVE, **reverse}}
