"""The node graph against a bare rclpy ping-pong."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from measure import RUNS, Measured, interleaved

from auv_analysis.graph.domain import VARIABLE, chosen_domain
from auv_analysis.graph.experiment import environment
from auv_dynamics.ros.topics import TOPICS

ECHO = Path(__file__).with_name('echo.py')
OWN = len(TOPICS)
STEPS = 10_000  # of a run that is made once for each number of topics


def against_pingpong(
    steps: int = 12_000, trips_for: float = 3.0, runs: int = RUNS
) -> dict[str, Measured]:
    """Steps per second of five processes and of one process, every topic recorded.

    One process is measured on rclpy's own executors as well, with a tenth of the steps.

    Parameters
    ----------
    steps : of a run
    trips_for : s for which the ping-pong is counted
    runs : rounds at most

    """
    from graph import graph_rate, pingpong

    subjects = {
        'graph_vs_pingpong': lambda: graph_rate(steps),
        'composed_vs_pingpong': lambda: graph_rate(steps, composed=True),
        'composed_plain_vs_pingpong': lambda: graph_rate(
            steps // 10, composed=True, executor='plain'
        ),
        'composed_events_vs_pingpong': lambda: graph_rate(
            steps // 10, composed=True, executor='events'
        ),
    }
    # each call starts processes of its own, and counts when they have settled
    return interleaved(subjects, lambda: pingpong(trips_for), 'steps/s', runs, warm=False)


@contextmanager
def recorded_topics() -> Iterator[Callable[[float], float]]:
    """Time in s of a step with so many topics recorded: the graph's own and others beside them."""
    from graph import graph_rate

    def cost(count: float) -> float:
        with _echoing(round(count) - OWN):
            return 1.0 / graph_rate(STEPS)

    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = str(chosen_domain(None)[0])  # the same for the graph and for the echo
    try:
        yield cost
    finally:
        del os.environ[VARIABLE]
        if before is not None:
            os.environ[VARIABLE] = before


@contextmanager
def _echoing(count: int) -> Iterator[None]:
    if not count:
        yield
        return
    from graph import end

    command = [sys.executable, str(ECHO), str(count)]
    environ = environment(int(os.environ[VARIABLE]))
    with subprocess.Popen(command, env=environ, stdout=subprocess.PIPE) as echo:
        try:
            assert echo.stdout is not None
            echo.stdout.readline()  # it is there
            yield
        finally:
            end(echo)
