"""Steps per second of the node graph, and round trips per second of a bare rclpy ping-pong.

The reference is what rclpy itself offers: two processes, Odometry one way, WrenchStamped the other,
message objects, one callback each, SingleThreadedExecutor, reliable with depth 10. The graph is
Case 1 as `auv run` starts it, every topic recorded. Only its steady part counts, from 10 % to 90 %
of the steps as the recorder reports them complete: start-up, discovery and the closing of the bag
are not in the number. Both run on the loopback with the same middleware profile.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import yaml
from loops import CONTROLLER

from auv_analysis.graph.domain import chosen_domain
from auv_analysis.graph.experiment import environment, run_controller
from auv_analysis.scenario.scenario import load_scenario
from auv_analysis.simulation.simulate import warm_up
from auv_dynamics.ros.security import loopback

SETTLE = 1.0  # s of ping-pong before it is counted
PATIENCE = 30.0  # s for the other end to appear
ON_EXECUTOR = Path(__file__).with_name('on_executor.py')
STEADY = (0.1, 0.9)  # part of a run that is counted


def end(process: subprocess.Popen[bytes]) -> None:
    """SIGTERM until it has ended: rclpy's wait does not wake at each of them."""
    while process.poll() is None:
        process.terminate()
        psutil.wait_procs([process], timeout=1.0)


def pingpong(seconds: float) -> float:
    """Round trips per second of a bare rclpy ping-pong between two processes."""
    environ = environment(chosen_domain(None)[0])
    command = [sys.executable, __file__, 'pong']
    pong = subprocess.Popen(command, env=environ)
    command[-1] = 'ping'
    try:
        ping = subprocess.run(
            [*command, '--seconds', str(seconds)], env=environ, stdout=subprocess.PIPE, check=True
        )
    finally:
        end(pong)
    return float(ping.stdout)


def _ping(seconds: float) -> float:
    """Count round trips with the other process."""
    import rclpy
    from geometry_msgs.msg import WrenchStamped
    from nav_msgs.msg import Odometry
    from rclpy.utilities import try_shutdown

    rclpy.init()
    node = rclpy.create_node('ping')
    executor = rclpy.executors.SingleThreadedExecutor()
    executor.add_node(node)
    output = node.create_publisher(Odometry, 'ping', 10)
    trips = 0

    def back(_: WrenchStamped) -> None:
        nonlocal trips
        trips += 1
        output.publish(Odometry())

    node.create_subscription(WrenchStamped, 'pong', back, 10)
    until = time.monotonic() + PATIENCE
    while not (output.get_subscription_count() and node.count_publishers('pong')):
        executor.spin_once(timeout_sec=0.05)
        assert time.monotonic() < until, 'no other end'
    while not trips:  # the way back may match a little later
        output.publish(Odometry())
        executor.spin_once(timeout_sec=0.2)
        assert time.monotonic() < until, 'no answer'
    begin = time.monotonic()
    while time.monotonic() - begin < SETTLE:
        executor.spin_once(timeout_sec=1.0)
    first, begin = trips, time.monotonic()
    while time.monotonic() - begin < seconds:
        executor.spin_once(timeout_sec=1.0)
    rate = (trips - first) / (time.monotonic() - begin)
    try_shutdown()
    return rate


def _pong() -> None:
    """Answer until SIGTERM."""
    import rclpy
    from geometry_msgs.msg import WrenchStamped
    from nav_msgs.msg import Odometry
    from rclpy.utilities import try_shutdown

    rclpy.init()
    node = rclpy.create_node('pong')
    output = node.create_publisher(WrenchStamped, 'pong', 10)
    node.create_subscription(Odometry, 'ping', lambda _: output.publish(WrenchStamped()), 10)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        try_shutdown()


def starter(executor: str) -> Callable[..., psutil.Popen]:
    """What starts nodes on one of rclpy's executors, 'plain' or 'events'; '': as lock-step does."""
    wrapper = [sys.executable, str(ON_EXECUTOR), executor] if executor else []
    return lambda command, **how: psutil.Popen([*wrapper, *command], **how)


def graph_rate(steps: int, *, composed: bool = False, executor: str = '') -> float:
    """Lock-steps per second of Case 1 on the node graph, every topic recorded.

    Parameters
    ----------
    steps : length of the run
    composed : all nodes in one process, else one process each
    executor : of rclpy, 'plain' or 'events'; '': that of lock-step

    Returns
    -------
    rate : steps per second of the steady part, 10 % to 90 % of the run

    """
    domain = chosen_domain(None)[0]
    os.environ.update(loopback())
    # the middleware reads its environment when it is loaded
    from auv_dynamics.ros.participant import Watcher

    progress: list[tuple[float, int]] = []
    with tempfile.TemporaryDirectory() as folder:
        scenario = load_scenario(_case1(Path(folder), steps))
        warm_up(scenario, [CONTROLLER])
        graph = Watcher(domain)
        try:
            run_controller(
                scenario, CONTROLLER, Path(folder) / 'out', domain, graph, starter(executor),
                lambda step: progress.append((time.monotonic(), step)), composed=composed,
            )  # fmt: skip
        finally:
            graph.close()
    low, high = (part * steps for part in STEADY)
    steady = [(at, step) for at, step in progress if low <= step <= high]
    if len(steady) < 2:
        raise ValueError(f'steps: expected a run of some seconds, found {steps} steps')
    (begin, first), (end, last) = steady[0], steady[-1]
    return (last - first) / (end - begin)


def _case1(folder: Path, steps: int) -> Path:
    """Case 1 of another length, in a folder."""
    case1 = load_scenario('case1')
    data = {**case1.data, 'vehicle': str(case1.vehicle_path), 'duration': steps * case1.step}
    path = folder / 'case1_long.yaml'
    path.write_text(yaml.safe_dump(data, sort_keys=False), encoding='utf-8')
    (folder / 'out').mkdir()
    return path


def main() -> None:
    """One end of a ping-pong, as `pingpong` starts it."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument('end', choices=('ping', 'pong'))
    parser.add_argument('--seconds', type=float)
    options = parser.parse_args()
    if options.end == 'pong':
        _pong()
    else:
        print(_ping(options.seconds))


if __name__ == '__main__':
    main()
