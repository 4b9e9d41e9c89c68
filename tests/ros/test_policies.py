"""The SROS 2 policy against the graph of running systems, exactly and both ways."""

import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
import yaml
from helpers import graph_runs, policies
from helpers.made_messages import Bag
from helpers.node_processes import PATIENCE, Peer, fresh_domain, parameters, start_auv, start_node
from rclpy.serialization import serialize_message
from std_srvs.srv import SetBool

from auv_analysis import load_scenario
from auv_analysis.graph.experiment import PACKAGES
from auv_analysis.graph.node_parameters import node_parameters, parameter_file
from auv_analysis.nodes.driver_check_node import RosDriverClient
from auv_dynamics.ros import interface, topics
from auv_dynamics.ros.interface import Frames
from auv_dynamics.ros.topics import message_class, type_name

LOOKS = {
    'publish': 'get_publisher_names_and_types_by_node',
    'subscribe': 'get_subscriber_names_and_types_by_node',
    'reply': 'get_service_names_and_types_by_node',
    'request': 'get_client_names_and_types_by_node',
}
SEPARATE = {f'/auv_gvc/{name}': {name} for name in (*PACKAGES, 'auv', 'auv_watch')}
COMPOSED = {'/auv_gvc/composed_graph': set(PACKAGES)}
LOOKING = {f'/auv_gvc/{name}': {name} for name in ('auv_watch', 'auv_check_driver')}
ALONE = {f'/auv_gvc/{name}': {name} for name in ('replay_node', 'frame_converter_node')}
# what a run does not have of the policy; both runs together have all of it
LOCK_STEP_LACKS = {
    'analysis_node': {('subscribe', '/odom')},
    'auv_watch': {('subscribe', '/clock')},
}
REAL_TIME_LACKS = {
    'plant_node': {('publish', '/auv1/wrench_applied'), ('publish', '/auv1/ground_truth/odom'),
                   ('subscribe', '/auv1/recorder/progress')},
    'setpoint_node': {('subscribe', '/clock')},
    'controller_node': {('subscribe', '/clock')},
    'analysis_node': {('subscribe', '/clock'), ('subscribe', '/auv1/ground_truth/odom')},
}  # fmt: skip
CHECKS = {  # what `auv check-driver` does of what `auv watch` may
    ('subscribe', '/clock'), ('subscribe', '/auv1/odom'),
    ('reply', '/auv1/auv_watch/get_type_description'),
}  # fmt: skip


def only(name: str) -> dict[str, set[str]]:
    """The enclave of one executable."""
    return {f'/auv_gvc/{name}': ALONE[f'/auv_gvc/{name}']}


def look(peer: Peer, seen: policies.Allowed, namespace: str) -> None:
    """Add what the nodes of a namespace do at this moment, by enclave."""
    for name, space, enclave in peer.node.get_node_names_and_namespaces_with_enclaves():
        if space == namespace and name != peer.node.get_name():
            entries = seen.setdefault(enclave, {}).setdefault(name, set())
            for rule, listed in LOOKS.items():
                entries |= {(rule, entry) for entry, _ in getattr(peer.node, listed)(name, space)}


def expected(
    enclaves: dict[str, set[str]], lacks: dict[str, set], namespace: str = '/'
) -> policies.Allowed:
    """What the policy allows, without what a run is known not to have."""
    listed = policies.allowed(policies.tree(namespace=namespace))
    return {
        enclave: {node: listed[enclave][node] - lacks.get(node, set()) for node in nodes}
        for enclave, nodes in enclaves.items()
    }


def assert_exact(domain: int, wanted: policies.Allowed, namespace: str = '/') -> None:
    """Wait for everything that the policy describes, and see that nothing else is done.

    Who misses something looks again as a newcomer: once, in 30 s, a participant did not hear of
    another of its own process.
    """
    seen: policies.Allowed = {}

    def sees_all() -> bool:
        limit = time.monotonic() + PATIENCE / 3
        with closing(Peer(domain)) as peer:

            def ends() -> bool:
                look(peer, seen, namespace)
                return seen == wanted or time.monotonic() > limit

            peer.until(ends)
            peer.spin(0.5)
            look(peer, seen, namespace)
        return seen == wanted

    try:
        for _ in range(6):
            if sees_all():
                break
    finally:
        for enclave in {*wanted, *seen}:
            ours, theirs = wanted.get(enclave, {}), seen.get(enclave, {})
            for node in {*ours, *theirs}:
                allowed, done = ours.get(node, set()), theirs.get(node, set())
                print(f'{enclave} {node}: not allowed {sorted(done - allowed)}, '
                      f'not seen {sorted(allowed - done)}')  # fmt: skip
    assert seen == wanted


@contextmanager
def ended(*processes: subprocess.Popen) -> Iterator[None]:
    """End processes after they have been looked at, as Ctrl-C does."""
    try:
        yield
    finally:
        for process in processes:
            process.send_signal(signal.SIGINT)
        for process in processes:
            print(*process.communicate(timeout=PATIENCE))


@pytest.fixture
def long(tmp_path: Path) -> Path:
    """Case 1 for a long time, with sensors and actuators."""
    data = dict(load_scenario('case1').data)
    data |= {
        'vehicle': 'herman2018',
        'duration': 3600.0,
        'sensors': {'velocity_noise': [1e-6] * 6},
        'actuators': {'limit': [1e6] * 6},
    }
    path = tmp_path / 'long.yaml'
    path.write_text(yaml.safe_dump(data))
    return path


def test_policy_is_that_of_a_run_in_lock_step_and_of_those_who_look_on(tmp_path, long) -> None:
    domain = fresh_domain()
    run = graph_runs.record(long, tmp_path / 'out', domain=domain)
    with ended(run, start_auv('watch', '--for', '120', domain=domain)):
        with closing(Peer(domain)) as peer:  # all are there, and need not compute
            peer.listen(topics.PROGRESS)
            peer.until(lambda: peer.heard[topics.PROGRESS.name], 'progress')
            assert peer.call(SetBool, 'plant_node/run', SetBool.Request(data=False)).success
        assert_exact(domain, expected(SEPARATE, LOCK_STEP_LACKS))


def test_policy_is_that_of_a_run_in_real_time_in_one_process_in_a_namespace(tmp_path) -> None:
    scenario = load_scenario('case1')
    path = tmp_path / 'params.yaml'
    nodes = node_parameters(
        scenario, 'gvc', bag=tmp_path / 'bag', lockstep=False, use_sim_time=False
    )
    nodes['controller_node']['limits.wrench'] = [1e4]
    path.write_text(parameter_file(nodes, 'real time'))
    domain = fresh_domain()
    enclave = ('--enclave', '/auv_gvc/composed_graph')
    names = ('--params-file', str(path), '-r', '__ns:=/auv1')
    here = {interface.ODOM: interface.ODOM, interface.WRENCH: interface.WRENCH}
    with (
        ended(start_node('composed_graph', domain, *names, *enclave)),
        closing(RosDriverClient(domain, '/auv1', here, Frames())),
        closing(RosDriverClient(domain, '/auv1', here, Frames(), commands=True)) as checks,
    ):
        checks.advertise()
        wanted = expected({**COMPOSED, **LOOKING}, REAL_TIME_LACKS, '/auv1')
        wanted['/auv_gvc/auv_watch']['auv_watch'] &= CHECKS
        assert_exact(domain, wanted, '/auv1')


def test_policy_is_that_of_a_replay_and_its_live_analysis(tmp_path) -> None:
    bag = Bag(tmp_path / 'bag.mcap')
    kinds = {topic.name: type_name(topic.type) for topic in topics.STEP_TOPICS}
    kinds['controller_node/transition_event'] = 'lifecycle_msgs/msg/TransitionEvent'
    for name, kind in kinds.items():
        bag.channel(f'/{name}', kind)
        bag.add(f'/{name}', kind, 0, serialize_message(message_class(kind)()))
    bag.close()
    domain = fresh_domain()
    replay = start_auv('replay', str(tmp_path), '--paused', '--loop', domain=domain)
    below = ('-r', '__ns:=/replay', *parameters(vehicle='herman2018'))
    with ended(start_node('analysis_node', domain, *below), replay):
        assert_exact(domain, expected(only('replay_node'), {}))


def test_policy_is_that_of_a_frame_converter() -> None:
    domain, name = fresh_domain(), 'frame_converter_node'
    arguments = (*parameters(use_sim_time=True), '--enclave', f'/auv_gvc/{name}')
    with ended(start_node(name, domain, *arguments)):
        assert_exact(domain, expected(only(name), {}))


def test_nothing_of_the_policy_is_in_no_run() -> None:
    first = {n: {(r, e) for r, e in v} for n, v in LOCK_STEP_LACKS.items()}
    second = {n: {(r, e.removeprefix('/auv1')) for r, e in v} for n, v in REAL_TIME_LACKS.items()}
    assert not [n for n in first if first[n] & second.get(n, set())]
    composed = {node for nodes in COMPOSED.values() for node in nodes}
    assert set(first) - {'auv_watch'} <= composed  # what lacks something runs the other way too
    assert first['auv_watch'] <= CHECKS
    assert set(second) <= {node for nodes in SEPARATE.values() for node in nodes}
    assert {*SEPARATE, *COMPOSED, *LOOKING, *ALONE} == set(policies.allowed(policies.tree()))
