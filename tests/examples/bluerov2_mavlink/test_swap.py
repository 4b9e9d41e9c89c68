"""Controller, recorder and analysis with the driver in the plant's place, under other names."""

import json
import signal
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.block_runs import joined
from helpers.mavlink_relay import EXAMPLE, fork_program, free_port
from helpers.node_processes import PATIENCE, Peer, auv, fresh_domain, parameters, start_node, stop
from numpy.testing import assert_array_equal
from std_srvs.srv import SetBool

from auv_analysis.bag.load import load_run, open_bag
from auv_analysis.cli.main import main
from auv_dynamics.ros import interface, topics
from auv_dynamics.ros.interface import NANOSECONDS, Frames
from auv_dynamics.ros.topics import Topic

FRAMES = Frames('map_ned', 'rov_frd')
NAMES = ['-r', 'odom:=/rov/nav/odometry', '-r', 'wrench:=/rov/thrust']
FRAME_IDS = parameters(odom_frame=FRAMES.odom, base_frame=FRAMES.base)
ODOM, WRENCH = (
    Topic('/rov/nav/odometry', topics.ODOM.type),
    Topic('/rov/thrust', topics.WRENCH.type),
)
SETPOINT = np.array([0.4, 0.0, 0.1, 0.0, 0.0, 0.2])
# removes in 3 s, not in 10, what the thrusters are off by, and keeps 15 dB and 45 deg
INTEGRAL = {'k_I': [1.0, 1.0, 1.0, 1.0, 1.0, 0.3], 'Lambda': 0.5}
NEAR = np.array([0.02, 0.02, 0.02, 0.03, 0.03, 0.03])  # m/s and rad/s, of the mean of a second


@pytest.fixture(scope='module')
def dive(tmp_path_factory):
    """A recorded dive: the folder of its bag, the odometry that was heard."""
    folder, domain = tmp_path_factory.mktemp('dive'), fresh_domain()
    port = free_port(domain)
    params, scenario = folder / 'params.yaml', folder / 'dive.yaml'
    data = yaml.safe_load((EXAMPLE / 'dive.yaml').read_text())
    data['controllers']['gvc'] |= INTEGRAL
    scenario.write_text(yaml.safe_dump(data))
    options = ['--controller', 'gvc', '--no-plant', '--out', str(params)]
    main(['params', str(scenario), *options])
    bag = folder / 'gvc'
    common = ['--params-file', str(params), *NAMES, '-r', '__ns:=/deck']
    started = {}
    with ExitStack() as stack:
        peer = Peer(domain)
        stack.callback(peer.close)
        peer.listen(ODOM, WRENCH, topics.DIAGNOSTICS)
        started['recorder_node'] = start_node(
            'recorder_node', domain, *common, *parameters(bag=bag)
        )
        for name in ('analysis_node', 'setpoint_node', 'controller_node'):
            started[name] = start_node(name, domain, *common, *FRAME_IDS)
        started['driver'] = fork_program(
            'driver.py', domain, '--ros-args', *NAMES, *FRAME_IDS, '-r', '__ns:=/rov',
            *parameters(connection=f'udpin:127.0.0.1:{port}', autoarm=True),
        )  # fmt: skip
        started['vehicle'] = fork_program(
            'ardusub_endpoint.py', domain, '--connection', f'udpout:127.0.0.1:{port}',
            '--position-after', '0.5', '--ready-after', '1',
            '--thrusters', 'measured', '--eta', '0', '0', '2', '0.1', '-0.1', '1.5',
        )  # fmt: skip
        for process in started.values():
            stack.callback(process.communicate, timeout=PATIENCE)
            stack.callback(process.kill)
        try:
            peer.until(lambda: peer.heard[WRENCH.name], 'the first wrench')

            speeds: list[np.ndarray] = []  # of the odometry

            def reached() -> bool:
                heard, said = peer.heard[topics.DIAGNOSTICS.name], peer.heard[ODOM.name]
                speeds.extend(
                    interface.read_odometry(m, FRAMES)[1][7:] for m in said[len(speeds) :]
                )
                if any('~/arm (' in one.message for array in heard for one in array.status):
                    heard.clear()  # the machine stood still, and the driver let go
                    peer.call(SetBool, '/rov/bluerov2_driver/arm', SetBool.Request(data=True))
                return tracks(speeds)

            peer.until(reached, 'the set-point reached')
        finally:
            codes = {name: stop(process, signal.SIGTERM) for name, process in started.items()}
            print(codes)
        assert {name: code for name, (code, _) in codes.items()} == dict.fromkeys(started, 0)
        yield bag, peer.heard


def tracks(speeds: list) -> bool:
    """Whether the last second's mean velocity is that of the set-point."""
    return len(speeds) > 200 and bool((np.abs(np.mean(speeds[-50:], 0) - SETPOINT) < NEAR).all())


def test_the_bag_is_complete_and_tells_its_run(dive) -> None:
    bag, heard = dive
    run = load_run(bag)
    assert run.vehicle.name == 'bluerov2_heavy'
    assert (run.law, run.controller) == ('gvc', 'gvc')
    stamps = [interface.nanoseconds(m.header.stamp) for m in heard[WRENCH.name]]
    last = round(stamps[0] + run.t[-1] * NANOSECONDS)  # behind it are those of letting go
    assert len(run.t) > 0.9 * sum(stamp <= last for stamp in stamps)
    assert run.t[-1] > 2.0
    means = np.lib.stride_tricks.sliding_window_view(run.nu, 50, axis=0).mean(-1)
    assert np.abs(means - SETPOINT).max(1).min() < 0.05, 'as `tracks` has seen; then it may stall'
    assert np.all(run.nu_d == SETPOINT)
    assert np.all(run.nu_d_dot == 0.0)
    assert run.step == pytest.approx(0.02, abs=0.003)
    assert np.diff(run.t).std() > 1e-4, 'the steps of a driver are not all of one length'
    assert run.disturbance is None
    assert not [note for note in run.notes if 'not finished' in note]


def test_reading_it_in_blocks_gives_the_same(dive) -> None:
    bag, _ = dive
    whole, long = load_run(bag), open_bag(bag, whole=50).run
    found = joined([*long.blocks(64)])
    assert (found.notes, found.step) == (whole.notes, whole.step)
    for name, values in whole.arrays().items():
        assert_array_equal(found.arrays()[name], values, err_msg=name)


def test_the_stamps_of_the_wrench_are_those_of_the_odometry(dive) -> None:
    _, heard = dive
    asked, answers = (
        np.unique([interface.nanoseconds(m.header.stamp) for m in heard[topic.name]])
        for topic in (ODOM, WRENCH)
    )
    at = np.searchsorted(asked, answers).clip(1, len(asked) - 1)
    missed = asked[at] - asked[at - 1] > 1.5 * np.median(np.diff(asked))  # what we did not hear
    heard_then = (answers >= asked[0]) & (answers <= asked[-1])
    assert (np.isin(answers, asked) | missed)[heard_then].all()
    assert np.isin(answers, asked).mean() > 0.5
    assert {m.header.frame_id for m in heard[WRENCH.name]} == {FRAMES.base}


def test_auv_analyze_reads_it(dive, tmp_path: Path) -> None:
    bag, _ = dive
    ended = auv('analyze', str(bag), '--out', str(tmp_path / 'out'), '--json', '--no-report')
    assert ended.returncode == 0, ended.stderr
    figures = json.loads(ended.stdout)['gvc']
    assert figures['source'] == 'bag'
    assert figures['step'] == pytest.approx(0.02, abs=0.003)
    assert figures['kinetic_energy']['mean'] > 0.5
    assert figures['velocity_error']['rms'][0] < 0.4
    assert figures['lumped_error']['rms'] is None, 'nobody knows the true disturbance'
