"""The benchmark of the graph runs as it is called; what it measures is no test's business."""

import json
import subprocess
import sys
from pathlib import Path

import keys
import pytest
from helpers.node_processes import environment, fresh_domain
from helpers.patience import patience

BENCHMARKS = Path(__file__).resolve().parents[2] / 'benchmarks'


# in a process of its own: the middleware reads its environment when it is loaded
SCRIPT = """
import json, sys
from dataclasses import asdict
from bench_nodes import against_pingpong
found = against_pingpong(steps=5000, trips_for=0.5, runs=1)
json.dump({name: asdict(measured) for name, measured in found.items()}, sys.stdout)
"""


@pytest.mark.long
def test_graph_measures_ping_pong_and_both_graphs() -> None:
    ended = subprocess.run(
        [sys.executable, '-c', SCRIPT], cwd=BENCHMARKS,
        env=environment(fresh_domain()), capture_output=True, text=True, timeout=patience(300),
        check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    measured = json.loads(ended.stdout)
    assert measured.keys() == set(keys.GROUPS['bench_nodes:against_pingpong'])
    assert all(entry['runs'] == 1 for entry in measured.values())
    assert all(entry['value'] > 0 and entry['reference'] > 0 for entry in measured.values())
