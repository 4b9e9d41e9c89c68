"""The benchmark of the graph runs as it is called; what it measures is no test's business."""

import json
import subprocess
import sys
from pathlib import Path

from harness import environment, fresh_domain

BENCHMARKS = Path(__file__).resolve().parents[2] / 'benchmarks'


def test_graph_measures_ping_pong_and_both_graphs() -> None:
    arguments = ['--runs', '1', '--steps', '3000', '--seconds', '0.5']
    ended = subprocess.run(
        [sys.executable, str(BENCHMARKS / 'graph.py'), *arguments],
        env=environment(fresh_domain()), capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    measured = json.loads(ended.stdout)
    assert measured.keys() == {'pingpong', 'five processes', 'composed'}
    assert len(measured['pingpong']['runs']) == 3
    assert all(entry['value'] > 0 for entry in measured.values())
