"""What the workspace promises of itself: layers, one place per fact, shipped files that load."""

import ast
import importlib
import pydoc
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
import yaml
from helpers.sources import imports

from auv_analysis import load_scenario
from auv_analysis.cli.main import main
from auv_analysis.studies.sweep.campaign import load_campaign
from auv_dynamics import load_vehicle
from auv_dynamics.ros import interface

ROOT = Path(__file__).resolve().parents[2]
SOURCES = sorted((ROOT / 'src').glob('*/auv_*/**/*.py'))
ROS = ('rclpy', 'rcl_interfaces', 'launch', 'launch_ros', 'builtin_interfaces', 'lifecycle_msgs',
       'rosgraph_msgs', 'ament_index_python')  # fmt: skip
ORDER = ('auv_dynamics', 'auv_gvc_controller', 'auv_analysis')


@cache
def imported(path: Path) -> set[str]:
    """Modules that a file imports at its top level or inside functions."""
    return {
        name
        for module, taken in imports(path)
        for name in (module, *(f'{module}.{each}' for each in taken))
    }


SLOW = {'numba', 'jsonschema', 'scipy', 'matplotlib', 'bokeh', 'pyarrow', 'jinja2', 'rich', 'PIL'}


def is_ros(module: str) -> bool:
    first = module.split('.', maxsplit=1)[0]
    return first in ROS or first.endswith(('_msgs', '_srvs'))


def test_there_are_sources() -> None:
    assert len(SOURCES) > 50


def test_modules_are_short() -> None:
    lengths = {str(path): len(path.read_text().splitlines()) for path in SOURCES}
    assert not {path: length for path, length in lengths.items() if length > 500}


def test_mathematics_never_imports_ros() -> None:
    for path in SOURCES:
        if path.parent.name not in ('nodes', 'ros'):
            assert not [m for m in imported(path) if is_ros(m)], path


def loaded(module: str) -> set[str]:
    """Top-level packages that a new interpreter has loaded once it has imported a module."""
    script = f'import sys, {module}; print(*{{name.split(".")[0] for name in sys.modules}})'
    done = subprocess.run([sys.executable, '-c', script], capture_output=True, check=True)
    return set(done.stdout.decode().split())


@pytest.mark.parametrize(
    'module',
    [
        'auv_dynamics.nodes.frame_converter_node',
        'auv_analysis.nodes.composed_graph',  # it imports the five of a graph
    ],
)
def test_a_node_loads_numba_for_a_kernel_alone_and_nothing_that_only_commands_need(
    module: str,
) -> None:
    assert not loaded(module) & SLOW


def test_topic_names_stand_in_one_module() -> None:
    # twist, wrench, disturbance and disturbance_estimate are words of other things as well
    names = [n for n in interface.STEP_TOPICS if '_' in n and n != 'disturbance_estimate']
    names += ['odom', 'analysis/', 'recorder/progress', '/diagnostics', '/clock']
    pattern = re.compile(
        '|'.join(rf"'{re.escape(n)}" + ("'" if n[-1] != '/' else '') for n in names)
    )
    found = {p.name for p in SOURCES if pattern.search(p.read_text())}
    assert found == {'interface.py'}


def test_private_names_of_rclpy_stand_in_one_file() -> None:
    wired = [path for path in SOURCES if any(map(is_ros, imported(path)))]
    pattern = re.compile(r'rclpy\.impl|noqa: SLF001')
    assert {path.name for path in wired if pattern.search(path.read_text())} == {
        'rclpy_internals.py'
    }


@pytest.mark.parametrize('path', sorted((ROOT / 'config').glob('*/*.yaml')), ids=lambda p: p.stem)
def test_every_shipped_file_loads(path: Path) -> None:
    if path.parent.name == 'vehicles':
        assert load_vehicle(path).name == path.stem
        assert load_vehicle(path.stem).name == path.stem
    elif path.parent.name == 'scenarios':
        assert load_scenario(path).name == path.stem
        assert load_scenario(path.stem).name == path.stem
    elif path.parent.name == 'campaigns':
        assert load_campaign(path).name == path.stem
        assert load_campaign(path.stem).name == path.stem
    else:
        assert yaml.safe_load(path.read_text())


@pytest.mark.parametrize(
    'path', sorted((ROOT / 'config/params').glob('*.yaml')), ids=lambda p: p.stem
)
def test_shipped_parameter_files_are_those_that_auv_params_writes(path: Path, capsys) -> None:
    scenario, _, controller = path.stem.partition('_')
    main(['params', scenario, '--controller', controller])
    assert capsys.readouterr().out == path.read_text()


def test_no_machine_stands_in_the_shipped_files() -> None:
    for path in (ROOT / 'config').rglob('*.yaml'):
        assert not re.search(r'(^|[^\w.])/(home|root|work|tmp)/', path.read_text()), path


def test_public_functions_say_what_they_take_and_give() -> None:
    """Every public function, class and method has a docstring."""
    for path in SOURCES:
        tree = ast.parse(path.read_text())
        classes = [n for n in tree.body if isinstance(n, ast.ClassDef) and n.name[0] != '_']
        nodes = [*tree.body, *(node for cls in classes for node in cls.body)]
        for node in nodes:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name[0] != '_':
                text = ast.get_docstring(node)
                assert text, f'{path.name}: {node.name}'


@pytest.mark.parametrize('package', ORDER)
def test_help_of_a_package_lists_its_public_names(package: str) -> None:
    text = pydoc.plain(pydoc.render_doc(importlib.import_module(package)))
    names = importlib.import_module(package).__all__
    assert names
    for name in names:
        assert f'`{name}' in text.partition('PACKAGE CONTENTS')[0], name
        assert re.search(rf'^    (class )?{name}\(', text, re.M), name
