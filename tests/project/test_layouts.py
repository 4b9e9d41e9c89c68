"""The layouts for Foxglove, Lichtblick and PlotJuggler fit our topics, messages and colours."""

import json
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from sensor_msgs.msg import JointState

from auv_analysis.report.plots import COLOURS, GREY, RUNS
from auv_dynamics.ros import topics
from auv_dynamics.vehicle import DOFS

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / 'config' / 'layouts'
FOXGLOVE = json.loads((FOLDER / 'foxglove.json').read_text())
PLOTJUGGLER = {path.name: ElementTree.parse(path) for path in FOLDER.glob('*.xml')}
TYPES = {f'/{topic.name}'.replace('//', '/'): topic.type for topic in topics.TOPICS}
ALWAYS = {f'/{topic.name}' for topic in topics.ANALYSIS_TOPICS} | {
    f'/{topic.name}' for topic in topics.STEP_TOPICS
    if topic not in (topics.WRENCH_APPLIED, topics.GROUND_TRUTH)
}  # fmt: skip


def number_in(topic: str, fields: list[str]) -> Any:
    """What stands there in a message of a topic."""
    value = TYPES[topic]()
    for field in fields:
        name, _, index = field.partition('[')
        value = getattr(value, name)
        if index:  # of the degrees of freedom
            value = 0.0 if int(index.rstrip(']')) < len(DOFS) else None
    return value


def in_foxglove() -> Iterator[tuple[str, dict[str, Any]]]:
    """Panel and line of every plot."""
    for panel, config in FOXGLOVE['configById'].items():
        for line in config.get('paths', []):
            yield panel, line


def panels(node: Any) -> Iterator[str]:
    """Panels of a part of the screen, and of the tabs in it."""
    if isinstance(node, str):
        yield node
        for tab in FOXGLOVE['configById'][node].get('tabs', []):
            yield from panels(tab['layout'])
    else:
        assert node['direction'] in ('row', 'column')
        yield from (*panels(node['first']), *panels(node['second']))


def test_every_panel_of_foxglove_is_shown_once_and_configured() -> None:
    assert sorted(panels(FOXGLOVE['layout'])) == sorted(FOXGLOVE['configById'])
    kinds = {name.split('!')[0] for name in FOXGLOVE['configById']}
    assert kinds == {'Plot', 'Tab', 'DiagnosticSummary'}


def test_lines_of_foxglove_are_numbers_of_topics_that_are_always_there() -> None:
    lines = list(in_foxglove())
    assert len(lines) > 40
    for _, line in lines:
        topic, *fields = line['value'].split('.')
        assert topic in ALWAYS
        assert isinstance(number_in(topic, fields), float), line
        assert line['timestampMethod'] in ('headerStamp', 'receiveTime')
    health = FOXGLOVE['configById']['DiagnosticSummary!health']
    assert TYPES[health['topicToRender']] is topics.DIAGNOSTICS.type


def test_colours_of_foxglove_are_those_of_reports() -> None:
    colours = dict(zip(DOFS, COLOURS, strict=True)) | {'set-point': GREY}
    assert all(colours[line['label']] == line['color'] for _, line in in_foxglove())


def test_energies_of_foxglove_are_those_of_the_named_dof() -> None:
    lines = [line for _, line in in_foxglove() if '[' in line['value']]
    assert len(lines) == 12
    for line in lines:
        assert int(line['value'][-2]) == DOFS.index(line['label'])


def test_curves_of_foxglove_are_those_of_the_named_dof() -> None:
    for panel, line in in_foxglove():
        topic, *fields = line['value'].split('.')
        if '[' not in line['value']:
            is_setpoint = line['label'] == 'set-point'
            assert dof_of(topic, fields) == (
                panel.partition('_')[2] if is_setpoint else line['label']
            ), line


def series(name: str) -> tuple[str, str, list[str]]:
    """Prefix, topic and fields of a curve of PlotJuggler."""
    prefix, _, rest = name.partition('/')
    topic = max((t for t in TYPES if f'/{rest}'.startswith(f'{t}/')), key=len)
    return prefix, topic, f'/{rest}'.removeprefix(f'{topic}/').split('/')


def dof_of(topic: str, fields: list[str]) -> str:
    if TYPES[topic] is JointState:
        return fields[0]
    axis, angular = 'xyz'.index(fields[-1]), fields[-2] in ('angular', 'torque')
    return DOFS[axis + 3 * angular]


@pytest.mark.parametrize('name', PLOTJUGGLER)
def test_curves_of_plotjuggler_are_numbers_that_are_loaded(name: str) -> None:
    loaded = {
        file.get('prefix'): file.find('plugin/parameters').get('selected_topics').split(';')
        for file in PLOTJUGGLER[name].iter('fileInfo')
    }
    curves = list(PLOTJUGGLER[name].iter('curve'))
    assert len(curves) > 20
    for curve in curves:
        prefix, topic, fields = series(curve.get('name'))
        assert topic in loaded[prefix]
        assert topic in ALWAYS
        if TYPES[topic] is JointState:  # PlotJuggler takes the name in the message
            assert fields[0] in DOFS
            assert fields[1:] == ['effort']
        else:
            assert isinstance(number_in(topic, fields), float)


@pytest.mark.parametrize('name', PLOTJUGGLER)
def test_colours_of_plotjuggler_are_those_of_reports(name: str) -> None:
    runs = {'gvc': RUNS[0], 'cl': RUNS[1]}
    for curve in PLOTJUGGLER[name].iter('curve'):
        prefix, topic, fields = series(curve.get('name'))
        of_dof = COLOURS[DOFS.index(dof_of(topic, fields))]
        expected = GREY if topic == '/cmd_vel' else runs.get(prefix, of_dof)
        assert curve.get('color') == expected, curve.get('name')


@pytest.mark.parametrize('name', PLOTJUGGLER)
def test_splitters_of_plotjuggler_are_what_they_count(name: str) -> None:
    splitters = list(PLOTJUGGLER[name].iter('DockSplitter'))
    assert splitters
    for splitter in splitters:
        sizes = [float(size) for size in splitter.get('sizes').split(';')]
        assert len(splitter) == len(sizes) == int(splitter.get('count'))
        assert sum(sizes) == pytest.approx(1.0, abs=1e-4)


def test_the_command_for_a_namespace_changes_every_topic() -> None:
    script = re.search(r"sed -E '(.+?)'", (ROOT / 'docs/viewers.md').read_text())[1]
    ours = r'/(?:odom|cmd_vel|wrench|disturbance(?:_estimate)?|analysis/\w+)[./;"]'
    for path in FOLDER.iterdir():
        changed = subprocess.run(
            ['sed', '-E', script, path], capture_output=True, text=True, check=True
        ).stdout
        assert len(re.findall(ours, path.read_text())) > 20
        assert re.findall(ours, changed) == re.findall(ours, path.read_text())
        assert len(re.findall(f'/auv1{ours}', changed)) == len(re.findall(ours, changed))
