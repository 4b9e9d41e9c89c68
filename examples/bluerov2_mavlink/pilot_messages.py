"""Pilot's axes as messages that ArduSub takes from its ground station."""

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink
from wrench_mapping import PilotAxes

OVERRIDE, MANUAL_CONTROL = 'rc_override', 'manual_control'
NEUTRAL_PWM, HALF = 1500, 400  # microseconds
KEEP = 65535  # a channel that is left as it is
FULL, MIDDLE = 1000, 500  # of MANUAL_CONTROL; its z runs from 0 to 1000 in ArduSub
FOUR = (0, 1, 2, 5)  # surge, sway, heave, yaw: what MANUAL_CONTROL has for all versions


def rc_override(axes: PilotAxes, system: int, component: int) -> Any:
    """RC_CHANNELS_OVERRIDE: pitch, roll, throttle, yaw, forward, lateral, in this order."""
    ordered = (axes.pitch, axes.roll, axes.throttle, axes.yaw, axes.forward, axes.lateral)
    channels = [NEUTRAL_PWM + round(HALF * axis) for axis in ordered]
    return mavlink.MAVLink_rc_channels_override_message(system, component, *channels, KEEP, KEEP)


def manual_control(axes: PilotAxes, system: int, gain: float) -> Any:
    """MANUAL_CONTROL of four axes; ArduSub multiplies what it gets by the pilot gain."""
    x, y, z, r = (
        max(-FULL, min(FULL, round(FULL * axis / gain)))
        for axis in (axes.forward, axes.lateral, axes.throttle, axes.yaw)
    )
    return mavlink.MAVLink_manual_control_message(system, x, y, MIDDLE + round(z / 2), r, 0)
