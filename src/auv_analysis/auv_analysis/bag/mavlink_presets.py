"""Mappings of ArduSub's logs, in the words of a mapping file."""

import re
from collections.abc import Mapping
from typing import Any

from auv_analysis.bag.reading import BagContents
from auv_dynamics.files.yaml_files import yaml_text

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
