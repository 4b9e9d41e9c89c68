"""Comparisons, the atlas and sweeps as a user runs them, with their figures drawn."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image
from sweeps import run as run_sweep
from sweeps import write_files

AUV = [sys.executable, '-m', 'auv_analysis.cli']


def auv(folder: Path, *arguments: str) -> subprocess.CompletedProcess:
    command = [*AUV, *arguments]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=300, check=False
    )


def drawn(out: Path) -> set[str]:
    """Names of the figures, each a PNG with something on it and a PDF."""
    names = {path.stem for path in (out / 'figures').glob('*.png')}
    for name in names:
        assert (out / f'figures/{name}.pdf').read_bytes().startswith(b'%PDF')
        with Image.open(out / f'figures/{name}.png') as image:
            assert len(image.convert('RGB').getcolors(1 << 16)) > 10
    return names


def test_a_sweep_is_explored(tmp_path: Path) -> None:
    run_sweep(write_files(tmp_path), out='runs/small')
    ended = auv(tmp_path, 'analyze', 'runs/small', '--json')
    assert ended.returncode == 0, ended.stderr
    document = json.loads(ended.stdout)
    assert (document['rows'], document['planned_rows']) == (32, 32)
    out = tmp_path / 'runs/analyze_small'
    assert json.loads((out / 'analysis.json').read_text()) == document
    assert {'distributions', 'influence', 'dependence_1', 'together'} <= drawn(out)
    report = (out / 'report.html').read_text(encoding='utf-8')
    assert report.count('<figure') == len(drawn(out))
    assert 'Warning' not in ended.stderr
    again = auv(tmp_path, 'analyze', 'runs/small')
    assert (again.returncode, len(again.stderr.splitlines())) == (2, 1)
    (out / 'notes.md').write_text('mine')
    replaced = auv(tmp_path, 'analyze', 'runs/small', '--overwrite', '--by', 'kinetic_energy.mean')
    assert replaced.returncode == 0, replaced.stderr
    assert (out / 'notes.md').read_text() == 'mine'
    assert (tmp_path / 'runs/small/sweep.json').exists()


@pytest.mark.parametrize('vehicle', ['bluerov2'])
def test_the_atlas_is_drawn(tmp_path: Path, vehicle: str) -> None:
    ended = auv(tmp_path, 'atlas', vehicle, '--only', '--json')
    assert ended.returncode == 0, ended.stderr
    assert list(json.loads(ended.stdout)['vehicles']) == [vehicle]
    figures = {'strength', 'correlation', 'shares', 'case1_delta_xi', 'case1_delta_pi'}
    assert drawn(tmp_path / 'runs/atlas') == figures
    assert 'Warning' not in ended.stderr


def test_folders_of_results_are_compared(tmp_path: Path) -> None:
    (write_files(tmp_path) / 'scenario.yaml').rename(tmp_path / 'short.yaml')
    for out in ('runs/a', 'runs/b'):
        ended = auv(tmp_path, 'simulate', 'short.yaml', '--out', out, '--json')
        assert ended.returncode == 0, ended.stderr
    original = json.loads(ended.stdout)
    ended = auv(tmp_path, 'analyze', 'runs/a', 'runs/b', '--out', 'both', '--json')
    assert ended.returncode == 0, ended.stderr
    summaries = json.loads(ended.stdout)
    assert summaries == {f'runs/{folder}/{name}': original[name]
                         for folder in 'ab' for name in ('gvc', 'cl')}  # fmt: skip
    assert {'ranking', 'errors', 'kinetic_energy', 'delta_xi'} <= drawn(tmp_path / 'both')
    assert 'Warning' not in ended.stderr
