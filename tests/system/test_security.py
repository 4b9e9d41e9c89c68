"""What a process is open to: DDS security as it was asked for, the loopback unless opened."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest
import yaml
from helpers import networks, policies
from helpers.fork_server import NODES, Process
from helpers.needs import need
from helpers.node_processes import PATIENCE, auv, environment, fork_server, fresh_domain, stop
from helpers.patience import patience

from auv_analysis import load_scenario
from auv_analysis.graph.supervisor import executable
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros.security import PROFILES, RANGE, asked, loopback, require, stay_local

TESTS = str(Path(__file__).resolve().parents[1])
NODE = 'frame_converter_node'  # of all nodes it loads least
ENFORCED = {'ROS_SECURITY_ENABLE': 'true', 'ROS_SECURITY_STRATEGY': 'Enforce'}
DDS_PORTS = range(7000, 32768)  # above them are those that the system hands out for sending


def bare(**extra: str) -> dict[str, str]:
    """Environment of somebody who has set nothing, in a domain of its own."""
    unset = (
        RANGE,
        *PROFILES,
        'ROS_SECURITY_ENABLE',
        'ROS_SECURITY_STRATEGY',
        'ROS_SECURITY_KEYSTORE',
    )
    environ = {name: value for name, value in os.environ.items() if name not in unset}
    return {**environ, 'ROS_DOMAIN_ID': str(fresh_domain()), 'PYTHONUNBUFFERED': '1', **extra}


@contextmanager
def node(environ: dict[str, str], *before: str) -> Iterator[subprocess.Popen | Process]:
    """A node; behind another command, the installed one."""
    if before:
        command = [*before, str(executable('auv_dynamics', NODE))]
        process = subprocess.Popen(
            command, env=environ, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
    else:
        process = fork_server().start([NODE], environ)
    try:
        yield process
    finally:
        print(stop(process))


def listening(process: subprocess.Popen | Process) -> set[str]:
    """Addresses at which a node that has begun waits for others."""
    assert any('begins: ' in line for line in process.stdout)  # all its sockets are bound by then
    listed = psutil.Process(process.pid).net_connections('inet')
    return {one.laddr.ip for one in listed if one.laddr and one.laddr.port in DDS_PORTS}


@pytest.mark.parametrize(
    ('name', 'value', 'words'),
    [
        ('ROS_SECURITY_ENABLE', '1', 'true or false'),
        ('ROS_SECURITY_ENABLE', 'True', 'true or false'),
        ('ROS_SECURITY_STRATEGY', 'enforce', 'Enforce or Permissive'),
    ],
)
def test_what_ros_would_take_for_a_no_is_refused(monkeypatch, name, value, words) -> None:
    monkeypatch.setenv(name, value)
    with pytest.raises(InputError, match=f'{name}: expected {words}, letter by letter, found'):
        asked()


def test_security_that_is_not_asked_for_is_not_looked_for(monkeypatch, capsys) -> None:
    monkeypatch.delenv('ROS_SECURITY_ENABLE', raising=False)
    require('auv')
    assert capsys.readouterr().err == ''


def test_security_that_is_not_enforced_is_said(monkeypatch, capsys) -> None:
    monkeypatch.setenv('ROS_SECURITY_ENABLE', 'true')
    monkeypatch.delenv('ROS_SECURITY_STRATEGY', raising=False)
    assert asked()
    assert 'not Enforce: a node without keys talks in the clear' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('command', 'keys', 'found'),
    [
        ('run', False, 'ROS_SECURITY_KEYSTORE: expected the folder of the keys'),
        ('run', True, 'the security libraries'),  # that the middleware of the wheels lacks
        ('watch', True, 'the security libraries'),
    ],
)
def test_auv_never_runs_without_the_security_that_is_enforced(
    tmp_path, command, keys, found
) -> None:
    need('plain middleware', 'security libraries' not in found or not shutil.which('ros2'))
    environ = dict(ENFORCED)
    if keys:
        environ['ROS_SECURITY_KEYSTORE'] = str(tmp_path / 'keys')
        for name in ('auv', 'auv_watch'):
            (tmp_path / 'keys/enclaves/auv_gvc' / name).mkdir(parents=True)
    out = str(tmp_path / 'out')
    arguments = ('run', 'case1', '--out', out) if command == 'run' else ('watch', '--once')
    ended = auv(*arguments, **environ)
    assert ended.returncode == 2, ended.stderr
    assert len(ended.stderr.splitlines()) == 1, ended.stderr
    for word in ('ROS_SECURITY_', 'expected', 'found', found):
        assert word in ended.stderr
    assert not os.path.exists(out)


@pytest.mark.parametrize('keys', [False, True])
def test_a_node_never_runs_without_the_security_that_is_enforced(tmp_path, keys) -> None:
    environ = bare(**ENFORCED)
    if keys:
        (tmp_path / 'enclaves/auv_gvc' / NODE).mkdir(parents=True)
        environ['ROS_SECURITY_KEYSTORE'] = str(tmp_path)
    command = [str(executable('auv_dynamics', NODE)), '--ros-args']
    command += ['--enclave', f'/auv_gvc/{NODE}']
    ended = subprocess.run(
        command, env=environ, capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert ended.returncode == 2, ended.stderr
    expected = 'error creating node' if keys else 'ROS_SECURITY_KEYSTORE: expected'
    assert ended.stderr.splitlines()[-1].startswith(expected)


@pytest.mark.parametrize('chosen', [{}, {RANGE: 'SUBNET'}])
def test_a_node_that_a_user_starts_is_heard_as_far_as_ros_lets_it(chosen) -> None:
    with node(bare(**chosen), *(() if chosen else ('env',))) as process:
        assert '0.0.0.0' in listening(process)


def test_in_the_environment_of_auv_run_a_node_listens_on_the_loopback_alone() -> None:
    with node({**bare(), **loopback()}) as process:
        assert listening(process) == {'127.0.0.1'}


@pytest.mark.parametrize('name', PROFILES)
def test_a_profile_of_the_user_stays_by_its_old_name_and_its_new_one(monkeypatch, name) -> None:
    for one in (RANGE, *PROFILES):
        monkeypatch.delenv(one, raising=False)
    monkeypatch.setenv(name, '/etc/own.xml')
    stay_local()
    assert os.environ[RANGE] == 'LOCALHOST'
    assert [os.environ.get(one) for one in PROFILES if one != name] == [None]
    assert os.environ[name] == '/etc/own.xml'
    # a run stays on the loopback under either name
    assert set(PROFILES) < set(loopback())


def test_who_has_said_nothing_stays_on_the_loopback(monkeypatch) -> None:
    for one in (RANGE, *PROFILES):
        monkeypatch.setenv(one, 'before')  # which is put back
        monkeypatch.delenv(one)
    stay_local()
    assert {one: os.environ[one] for one in (RANGE, *PROFILES)} == loopback()


@pytest.mark.parametrize('chosen', ['SUBNET', 'OFF'])
def test_what_the_user_has_chosen_stays(monkeypatch, chosen) -> None:
    monkeypatch.setenv(RANGE, chosen)
    for name in PROFILES:
        monkeypatch.delenv(name, raising=False)
    stay_local()
    assert os.environ[RANGE] == chosen
    assert not any(name in os.environ for name in PROFILES)


def found(machine: networks.Machine, environ: dict[str, str], seconds: float = PATIENCE) -> str:
    """Nodes that a participant finds on a machine within so long."""
    command = machine.command(sys.executable, '-m', 'helpers.discovery_probe', str(seconds))
    environ = {**environ, 'PYTHONPATH': TESTS, **({} if RANGE in environ else loopback())}
    return subprocess.run(
        command, env=environ, capture_output=True, text=True, timeout=2 * PATIENCE, check=True
    ).stdout.strip()


def test_nothing_leaves_the_machine_and_nobody_outside_gets_in() -> None:
    with networks.two_machines() as (inside, outside):
        environ = {**bare(), **loopback()}
        opened = bare(ROS_DOMAIN_ID=environ['ROS_DOMAIN_ID'], **{RANGE: 'SUBNET'})
        knows = {**opened, 'ROS_STATIC_PEERS': networks.INSIDE}
        with node(environ, *inside.command()):
            assert found(inside, environ) == NODE
            assert inside.sent() == 0
            assert found(outside, knows, patience(3.0)) == ''
        before = inside.sent()
        with node(opened, *inside.command()):
            assert found(outside, knows) == NODE
            assert inside.sent() > before


@pytest.mark.long
def test_nothing_of_a_run_leaves_the_machine(tmp_path) -> None:
    data = {**load_scenario('case1').data, 'vehicle': 'herman2018', 'duration': 0.2}
    path = tmp_path / 'short.yaml'
    path.write_text(yaml.safe_dump(data))
    with networks.two_machines() as (inside, _):
        command = inside.command(sys.executable, '-m', 'helpers.graph_runs', str(path))
        environ = environment(fresh_domain()) | {'PYTHONPATH': TESTS}
        command = [*command, str(tmp_path / 'out')]
        subprocess.run(command, env=environ, timeout=patience(120), check=True)
        assert inside.sent() == 0
    assert list(tmp_path.glob('out/*/*.mcap'))


def test_every_executable_has_an_enclave() -> None:
    listed = policies.allowed(policies.tree())
    assert {f'/auv_gvc/{name}' for name in NODES} <= set(listed)
