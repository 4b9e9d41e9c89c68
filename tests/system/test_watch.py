"""`auv watch` beside a run: it sees what happens, and nothing is otherwise for it, even stopped."""

import itertools
import json
import os
import pty
import re
import signal
import time
from pathlib import Path

import pytest
import yaml
from helpers.fork_server import Process
from helpers.graph_runs import every_message, record
from helpers.node_processes import (
    PATIENCE,
    Peer,
    auv,
    fresh_domain,
    start_auv,
    start_installed_auv,
)
from helpers.patience import patience

from auv_dynamics.ros import convert, interface, topics
from auv_dynamics.ros.interface import Frames

PACED = ('/diagnostics', '/recorder/progress', '/controller_node/transition_event')  # by the wall
SCENARIO = {
    'name': 'watched',
    'vehicle': 'herman2018',
    'duration': 40.0,
    'step': 0.01,
    'controllers': {'gvc': {'law': 'gvc', 'k_D': 12.0, 'k_I': 1.0, 'Lambda': 0.8, 'Gamma': 60.0}},
    'setpoint': {'surge': {'offset': 0.5}, 'yaw': {'offset': 0.1}},
    'disturbance': {'kind': 'herman2018'},
}


def first_look(watch: Process, run: Process) -> str:
    """Line in which a watch says how fast the run is that it sees."""
    for line in watch.stderr:
        if ' x real time' in line:
            return line
        assert run.poll() is None, 'the run is over, and the watch has not seen it'
    raise AssertionError('the watch has ended')


@pytest.fixture(scope='module')
def scenario(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp('watched') / 'watched.yaml'
    path.write_text(yaml.safe_dump(SCENARIO, sort_keys=False))
    return path


@pytest.mark.long
def test_a_run_is_the_same_beside_a_watch_that_is_even_stopped(scenario, tmp_path) -> None:
    domain = fresh_domain()
    beside = start_auv('watch', '--json', '--rate', '20', domain=domain)
    try:
        assert f'ROS_DOMAIN_ID={domain}' in beside.stderr.readline()
        run = record(scenario, tmp_path / 'watched', domain=domain)
        seen = first_look(beside, run)
        beside.send_signal(signal.SIGSTOP)  # while the run is under way
        assert float(re.search(r't = ([\d.]+) s', seen)[1]) < SCENARIO['duration']
        _, errors = run.communicate(timeout=patience(120))
        assert run.returncode == 0, errors
        beside.send_signal(signal.SIGCONT)
        beside.send_signal(signal.SIGINT)
        output, errors = beside.communicate(timeout=PATIENCE)
    finally:
        beside.kill()
    assert beside.returncode == 0, errors
    seen = {topic['name']: topic for topic in json.loads(output)['topics']}
    for topic in (interface.ODOM, interface.WRENCH, interface.CMD_VEL):
        assert seen[topic]['heard'] > 0, topic
        assert seen[topic]['gaps'] == seen[topic]['repeats'] == seen[topic]['refused'] == 0

    alone = record(scenario, tmp_path / 'alone')
    assert alone.wait(timeout=patience(120)) == 0
    bags = [every_message(tmp_path / name / 'gvc', *PACED) for name in ('watched', 'alone')]
    assert bags[0].keys() == bags[1].keys()
    for topic, messages in bags[0].items():
        assert messages == bags[1][topic], topic
    assert len(bags[0]['/odom']) == 4001


def test_without_a_graph_it_says_where_it_waits_and_ends_with_1() -> None:
    domain = fresh_domain()
    ended = auv('watch', '--domain-id', str(domain), '--for', '0.5', '--json')
    assert ended.returncode == 1
    assert ended.stdout == ''
    first, last = ended.stderr.splitlines()
    assert first.startswith(f'listens on ROS_DOMAIN_ID={domain}, this machine only')
    for word in ('nobody publishes odom, cmd_vel or wrench', f'={domain}', 'gave up after 0.5 s'):
        assert word in last


def test_it_listens_where_and_to_what_it_is_told() -> None:
    domain, steps = fresh_domain(), itertools.count()
    peer, state = Peer(domain), (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, *(0.1,) * 6)
    odometry = peer.node.create_publisher(topics.ODOM.type, '/auv1/odom', topics.every_step())

    def publish() -> None:
        stamp = next(steps) * 20_000_000
        odometry.publish(convert.odometry(stamp, state, Frames('map', 'body')))

    peer.node.create_timer(0.02, publish)
    options = ['--namespace', '/auv1', '--vehicle', 'herman2018', '--once', '--json']
    frames = ['--odom-frame', 'map', '--base-frame', 'body']
    watch = start_auv('watch', *options, *frames, domain=domain)
    try:
        peer.until(lambda: watch.poll() is not None, 'a snapshot')
        output, errors = watch.communicate(timeout=PATIENCE)
    finally:
        watch.kill()
        peer.close()
    assert watch.returncode == 0, errors
    found = json.loads(output)
    assert [found[key] for key in ('domain', 'namespace', 'vehicle', 'computed')] == [
        domain, '/auv1', 'herman2018', True
    ]  # fmt: skip
    assert found['nu'] == [0.1] * 6
    assert found['kinetic_energy']['total'] > 0.0
    assert sum(topic['refused'] for topic in found['topics']) == 0


def test_on_a_terminal_q_ends_it_and_the_terminal_is_given_back() -> None:
    ours, its = pty.openpty()
    process = start_installed_auv('watch', stdin=its, stdout=its)
    os.close(its)
    shown = b''
    limit = time.monotonic() + PATIENCE
    while b'nobody publishes' not in shown:  # the dashboard is up
        assert time.monotonic() < limit
        shown += os.read(ours, 4096)
    os.write(ours, b'xq')
    while True:
        assert time.monotonic() < limit
        try:
            shown += os.read(ours, 4096)
        except OSError:  # the other end is closed
            break
    assert process.wait(PATIENCE) == 0, process.stderr.read()
    assert b'\x1b[?1049h' in shown, 'a screen of its own'
    assert shown.rindex(b'\x1b[?1049l') > shown.rindex(b'\x1b[?1049h'), 'and the old one again'
    os.close(ours)
