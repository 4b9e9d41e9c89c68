"""Comparisons, the atlas and sweeps as a user runs them, with their figures drawn."""

import json
from pathlib import Path

import pytest
from helpers.node_processes import auv
from helpers.sweeps import run as run_sweep
from helpers.sweeps import write_files
from PIL import Image

from auv_analysis import load_scenario, simulate
from auv_analysis.runs.samples import write_samples
from auv_analysis.scenario.scenario import write_inputs


def drawn(out: Path) -> set[str]:
    """Names of the figures, each a PNG with something on it and a PDF."""
    names = {path.stem for path in (out / 'figures').glob('*.png')}
    for name in names:
        assert (out / f'figures/{name}.pdf').read_bytes().startswith(b'%PDF')
        with Image.open(out / f'figures/{name}.png') as image:
            assert len(image.convert('RGB').getcolors(1 << 16)) > 10
    return names


@pytest.mark.long
def test_a_sweep_is_explored(tmp_path: Path) -> None:
    run_sweep(write_files(tmp_path), out='runs/small')
    ended = auv('analyze', 'runs/small', '--json', cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr
    document = json.loads(ended.stdout)
    assert (document['rows'], document['planned_rows']) == (32, 32)
    out = tmp_path / 'runs/analyze_small'
    assert json.loads((out / 'analysis.json').read_text()) == document
    assert {'distributions', 'influence', 'dependence_1', 'together'} <= drawn(out)
    report = (out / 'report.html').read_text(encoding='utf-8')
    assert report.count('<figure') == len(drawn(out))
    assert 'Warning' not in ended.stderr


@pytest.mark.long
def test_the_atlas_is_drawn(tmp_path: Path) -> None:
    ended = auv('atlas', 'bluerov2', '--only', '--json', cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr
    assert list(json.loads(ended.stdout)['vehicles']) == ['bluerov2']
    figures = {'strength', 'correlation', 'shares'}
    assert drawn(tmp_path / 'runs/atlas') == figures
    assert 'Warning' not in ended.stderr


@pytest.mark.long
def test_results_and_scenarios_are_compared(tmp_path: Path) -> None:
    write_files(tmp_path)
    scenario, out = load_scenario(tmp_path / 'scenario.yaml'), tmp_path / 'runs/a'
    out.mkdir(parents=True)
    write_inputs(scenario, out)
    for name in scenario.controllers:
        write_samples(simulate(scenario, name), out / f'{name}.npz')
    ended = auv('analyze', 'runs/a', 'scenario.yaml', '--out', 'both', '--json', cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr
    summaries = json.loads(ended.stdout)
    places = 'a', 'simulated/scenario'
    assert list(summaries) == [f'{place}/{name}' for place in places for name in ('gvc', 'cl')]
    assert summaries['a/gvc'] == summaries['simulated/scenario/gvc']
    assert {'ranking', 'errors', 'kinetic_energy'} <= drawn(tmp_path / 'both')
    assert 'Warning' not in ended.stderr
