"""`auv tune` as a program: `auv simulate` repeats what it left."""

import json
from pathlib import Path

import pytest
from helpers.node_processes import auv
from helpers.tunings import GVC, SAME_CL, write


def tuned(folder: Path, *arguments: str) -> dict:
    done = auv(*arguments, '--json', cwd=folder)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.long
def test_simulate_repeats_what_was_tuned(tmp_path: Path) -> None:
    write(tmp_path, {'gvc': GVC, 'cl': SAME_CL | {'k_D': 300.0}}, duration=0.2)
    arguments = ('tune', 's.yaml', '--law', 'cl', '--structure', 'mass', '--samples', '10')
    document = tuned(tmp_path, *arguments, '--out', 'a')
    effort = {n: e['measures']['effort'] for n, e in document['controllers'].items()}
    assert effort['cl_tuned'] == pytest.approx(effort['gvc'], rel=1e-3)
    summary = tuned(tmp_path, 'simulate', 'a/scenario.yaml', '--out', 'c', '--no-report')
    M = [120.0, 160.0, 180.0, 13.0, 17.0, 18.0]  # diagonal: the forms are sums of rms values
    for name, entry in document['controllers'].items():
        rms = summary[name]['velocity_error']['rms'], summary[name]['effort']['rms']
        error = sum(0.5 * m * e**2 for m, e in zip(M, rms[0], strict=True))
        expected = sum(0.5 * tau**2 / m for m, tau in zip(M, rms[1], strict=True))
        assert entry['measures']['error'] == pytest.approx(error, rel=1e-9)
        assert entry['measures']['effort'] == pytest.approx(expected, rel=1e-9)
