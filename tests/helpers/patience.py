"""Limits of waiting, scaled by one factor.

A test that works never reaches one. `AUV_GVC_PATIENCE=4` makes each four times as long, and with
them the watchdogs that tests give to nodes: for a machine that is busy with other things.
"""

import os

FACTOR = float(os.environ.get('AUV_GVC_PATIENCE', '1'))


def patience(seconds: float = 30.0) -> float:
    """How long to wait at most, s, for what takes less than `seconds` on an idle machine."""
    return FACTOR * seconds
