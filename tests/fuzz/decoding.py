"""Serialized messages into the controller, in this process: refused, or a wrench within limits."""

import math

import numpy as np
from rclpy.serialization import serialize_message

from auv_dynamics import load_vehicle
from auv_dynamics.ros import convert, topics
from auv_dynamics.ros.codec import Codec, first_stamp
from auv_dynamics.ros.interface import BadMessageError, Frames
from auv_gvc_controller.control.controller import OutputStage, Timeouts, VelocityController
from auv_gvc_controller.control.odometry_guard import Limits, Now, OdometryGuard, StampAge
from auv_gvc_controller.control.sampled_law import SampledLaw
from auv_gvc_controller.control.setpoint_buffer import DIFFERENCE, SetpointBuffer
from auv_gvc_controller.laws.law import make_gains
from auv_gvc_controller.laws.model import control_model

X = np.array([0, 0, 0, 1, 0, 0, 0, 0.1, 0, 0, 0, 0, 0], float)
LIMIT = (500.0,) * 6
TOPICS = (topics.ODOM, topics.CMD_VEL, topics.CMD_ACCEL, topics.WRENCH)
CODECS = {topic: Codec(topic.type, Frames(), topic.name) for topic in TOPICS}
SECOND = 10**9
_gains = make_gains('gvc', {'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0})
_law = SampledLaw(_gains, control_model(load_vehicle('herman2018')))


def messages() -> list[bytes]:
    """Good ones: a byte that says which topic, then the message."""
    made = (
        convert.odometry(SECOND, X, Frames()),
        convert.twist(SECOND, (0.5, 0, 0, 0, 0, 0), Frames()),
        convert.accel(SECOND, (0.1, 0, 0, 0, 0, 0), Frames()),
        convert.wrench(SECOND, (9.0, 0, 0, 0, 0, 0), Frames()),
    )
    return [bytes([i]) + bytes(serialize_message(message)) for i, message in enumerate(made)]


def try_messages(data: bytes) -> str:
    """One message after a good odometry and set-point, then good ones again."""
    if not data:
        return 'empty'
    pairing = SetpointBuffer(exact=False, acceleration=DIFFERENCE, limits=Limits(20.0, 20.0, 100.0))
    guard = OdometryGuard(
        SECOND, Limits(20.0, 20.0, 100.0), lockstep=False, patience=0.5,
        age=StampAge('auto', 0.5),
    )  # fmt: skip
    _law.reset()
    controller = VelocityController(
        _law, pairing, guard, OutputStage(LIMIT, ramp=0.2), timeouts=Timeouts(0.5, 0.5)
    )
    good = [CODECS[TOPICS[i]].decode(message[1:]) for i, message in enumerate(messages())]
    topic = TOPICS[data[0] % len(TOPICS)]
    pairing.setpoint(SECOND, good[1][1], 0.0)
    _judged(controller.odometry(SECOND, good[0][1], Now(0.0)))
    verdict = 'refused'
    try:
        first_stamp(data[1:], topic.name)
        ns, values = CODECS[topic].decode(data[1:])
        if topic is topics.ODOM:
            _judged(controller.odometry(ns, values, Now(0.01)))
        elif topic is topics.CMD_VEL:
            pairing.setpoint(ns, values, 0.01)
        elif topic is topics.CMD_ACCEL:
            pairing.derivative(ns, values)
        verdict = 'taken'
    except (BadMessageError, ValueError):
        pass
    for i in range(1, 100):  # whatever it was: later the good ones are followed again
        ns, steady = SECOND + i * 20_000_000, 0.6 + 0.02 * i
        try:
            pairing.setpoint(ns, good[1][1], steady)
            _judged(controller.odometry(ns, good[0][1], Now(steady)))
        except ValueError:
            continue
    if controller.watchdog:
        raise AssertionError(f'it does not come back: {controller.watchdog}')
    return verdict


def _judged(answer: object) -> None:
    tau = getattr(answer, 'tau', (0.0,) * 6)
    if not all(math.isfinite(value) and abs(value) <= 500.0 for value in tau):
        raise AssertionError(f'a wrench of {tau}')
