"""Parameter files: a node starts with one, or ends with one line and exit code 2."""

import functools
import os
import signal
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from files import CrashError, bags, dumped
from helpers.patience import patience
from watchman import playground, watched

from auv_analysis.graph.node_parameters import node_parameters
from auv_analysis.nodes.analysis_node import AnalysisNode
from auv_analysis.nodes.recorder_node import RecorderNode
from auv_analysis.nodes.replay_node import ReplayNode
from auv_analysis.scenario.scenario import load_scenario
from auv_dynamics.files.errors import ENDING
from auv_dynamics.nodes.frame_converter_node import FrameConverterNode
from auv_dynamics.nodes.plant_node import PlantNode
from auv_dynamics.ros import node_main
from auv_dynamics.ros.node_main import live
from auv_gvc_controller.nodes.controller_node import ControllerNode
from auv_gvc_controller.nodes.setpoint_node import SetpointNode

NODES: dict[str, Callable[[], Any]] = {
    'plant_node': PlantNode,
    'setpoint_node': SetpointNode,
    'controller_node': ControllerNode,
    'analysis_node': AnalysisNode,
    'recorder_node': RecorderNode,
    'frame_converter_node': FrameConverterNode,
    'replay_node': ReplayNode,
}
PATIENCE = patience(60.0)  # s

BESIDE: dict[str, dict[str, Any]] = {  # nodes that are in no run
    'frame_converter_node': {
        'enu_frame': 'odom', 'flu_frame': 'base_link', 'odom_frame': 'odom_ned',
        'base_frame': 'base_link_fsd', 'twist_frame': 'world', 'lockstep': True,
    },
    'replay_node': {
        'bag': 'bag', 'namespace': 'replay', 'start': 0.01, 'duration': 0.1, 'rate': 2.0,
        'loop': True, 'start_paused': False, 'clock': True, 'topics': ['/odom', '/w*'],
        'command_topics': ['/remark'], 'expected_subscribers': ['/odom=1'], 'answers': '/wrench',
        'original_names': False, 'commands': False, 'all': True, 'skip_gaps': True,
    },
}  # fmt: skip


def originals() -> list[dict[str, Any]]:
    """Node name and parameters of each."""
    scenario = load_scenario('case1')
    found = node_parameters(scenario, 'gvc', bag=Path('bag'), vehicle='herman2018')
    found['recorder_node'] |= {'extra_topics': ['/imu', 'all'], 'exclude': '(a+)+b'}
    found = {**found, **BESIDE}
    return [{'node': name, 'parameters': dict(found[name])} for name in NODES]


@functools.cache
def good_bag() -> bytes:
    """What there is to be replayed."""
    return bags()[0]


def started(make: Callable[[], Any], arguments: Sequence[str]) -> tuple[int, str]:
    """Exit code of a node that is ended as soon as it stands, and what it said."""

    def made() -> Any:
        node = make()
        if node.exit_code is None:
            node.exit_code = 0
        return node

    node_main.TEARDOWN = PATIENCE  # a node that is torn down too slowly ends its process
    kept = {number: signal.getsignal(number) for number in ENDING}
    with tempfile.TemporaryFile(dir='.') as said:  # where the fuzzing lets files be written
        screens = os.dup(1), os.dup(2)
        try:
            os.dup2(said.fileno(), 1)
            os.dup2(said.fileno(), 2)
            code = live([made], ['--ros-args', *arguments])
        finally:
            for screen, number in zip(screens, (1, 2), strict=True):
                os.dup2(screen, number)
                os.close(screen)
            for number, handler in kept.items():
                signal.signal(number, handler)
        said.seek(0)
        return code, said.read().decode(errors='replace')


def try_parameters(data: Any) -> str:
    """Start a node with a parameter file and end it at once."""
    name = data.get('node') if isinstance(data, dict) else None
    values = data.get('parameters') if isinstance(data, dict) else None
    node = NODES.get(name if isinstance(name, str) else '', PlantNode)
    if isinstance(values, dict) and 'bag' in values:
        values = {**values, 'bag': 'bag'}  # where it is told to write, it may
    with playground() as folder:
        path = folder / 'params.yaml'
        if node is ReplayNode:
            (folder / 'bag').mkdir()
            (folder / 'bag' / 'bag_0.mcap').write_bytes(good_bag())
        path.write_bytes(dumped({'/**': {'ros__parameters': values}}))
        with watched(folder):
            code, said = started(node, ['--params-file', str(path)])
    lines = [line for line in said.splitlines() if line.strip()]
    if code == 1 and 'expected topics without any message' in said:
        code = 0  # a recorder that has heard nobody
    if code not in (0, 2) or 'Traceback' in said or (code == 2 and not lines):
        raise CrashError(f'{node.__name__}: exit code {code}, said {said[-2000:]}')
    return 'started' if code == 0 else 'refused'
