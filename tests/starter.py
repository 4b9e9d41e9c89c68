"""A process in which nodes are started one after the other, to see what they refuse.

Each line of its input is a node and its arguments, each line of its output the exit code and what
was said. A node of its own process takes a second before it reads its first parameter.
"""

import json
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Sequence
from typing import Any

from auv_analysis.analysis_node import AnalysisNode
from auv_analysis.recorder_node import RecorderNode
from auv_analysis.replay_node import ReplayNode
from auv_dynamics.frame_converter_node import FrameConverterNode
from auv_dynamics.plant_node import PlantNode
from auv_dynamics.ros import life
from auv_dynamics.ros.life import SIGNALS, live
from auv_gvc_controller.controller_node import ControllerNode
from auv_gvc_controller.setpoint_node import SetpointNode

NODES: dict[str, Callable[[], Any]] = {
    'plant_node': PlantNode,
    'setpoint_node': SetpointNode,
    'controller_node': ControllerNode,
    'analysis_node': AnalysisNode,
    'recorder_node': RecorderNode,
    'frame_converter_node': FrameConverterNode,
    'replay_node': ReplayNode,
}
PATIENCE = 60.0  # s


def started(make: Callable[[], Any], arguments: Sequence[str]) -> tuple[int, str]:
    """Exit code of a node that is ended as soon as it stands, and what it said."""

    def made() -> Any:
        node = make()
        if node.exit_code is None:
            node.exit_code = 0
        return node

    life.TEARDOWN = PATIENCE  # a node that is torn down too slowly ends its process
    kept = {number: signal.getsignal(number) for number in SIGNALS}
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


def main() -> None:
    """Start what is asked for, until nothing more is."""
    answers = os.fdopen(os.dup(1), 'w')
    for line in sys.stdin:
        name, *arguments = json.loads(line)
        print(json.dumps(started(NODES[name], arguments)), file=answers, flush=True)


if __name__ == '__main__':
    main()
