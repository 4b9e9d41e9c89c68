"""What a node says while it lives, and the end of its process."""

import subprocess
import sys

import pytest
from helpers.node_processes import PATIENCE, environment, fresh_domain

from auv_dynamics.ros import node_interface

STUCK = """
import ctypes, sys
from auv_dynamics.ros import node_main
from auv_dynamics.ros.node_main import BulkNode

class Stuck(BulkNode):
    def __init__(self):
        super().__init__('stuck')
        self.exit_code = int(sys.argv[1])

    def destroy_node(self):
        ctypes.PyDLL(None).sleep(60)  # with the GIL held

node_main.TEARDOWN = 0.5
sys.exit(node_main.live([Stuck], args=[]))
"""


@pytest.mark.parametrize('code', [0, 1])
def test_a_teardown_without_end_does_not_change_the_exit_code(code: int) -> None:
    command = [sys.executable, '-c', STUCK, str(code)]
    ended = subprocess.run(command, env=environment(fresh_domain()), timeout=PATIENCE, check=False)
    assert ended.returncode == code


def test_what_lasts_is_logged_once_and_then_every_ten_seconds(monkeypatch) -> None:
    said: list[tuple[str, str]] = []

    class Logger:
        def __getattr__(self, level: str):
            return lambda text: said.append((level, text))

    lasting, now = node_interface.Lasting(Logger()), 0.0
    monkeypatch.setattr('time.monotonic', lambda: now)
    for now in range(100, 125):
        lasting.see(node_interface.WARN, f'no set-point for {now} s')
    assert said == [('warning', f'no set-point for {at} s') for at in (101, 111, 121)]
    lasting.see(node_interface.OK, '')
    assert said[3:] == [('info', 'over: no set-point for 124 s')]
    lasting.see(node_interface.ERROR, 'too short')
    lasting.see(node_interface.OK, '')
    assert len(said) == 4
