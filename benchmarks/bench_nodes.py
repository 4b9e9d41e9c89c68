"""The node graph against a bare rclpy ping-pong."""

from graph import graph_rate, pingpong
from measure import Measured, interleaved


def against_pingpong() -> dict[str, Measured]:
    """Steps per second of five processes and of one process, every topic recorded."""
    subjects = {
        'graph_vs_pingpong': graph_rate,
        'composed_vs_pingpong': lambda: graph_rate(composed=True),
    }
    return interleaved(subjects, pingpong, 'steps/s')
