"""What the packages say of themselves: dependencies, metadata, files."""

import configparser
import re
import shlex
import sys
import tomllib
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import pytest
from helpers.sources import imports

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ('auv_dynamics', 'auv_gvc_controller', 'auv_analysis')
KEYS = {  # of rosdep, for imports of another name
    **{
        name: f'python3-{name}'
        for name in (
            'argcomplete',
            'defusedxml',
            'jsonschema',
            'matplotlib',
            'numpy',
            'packaging',
            'psutil',
            'rich',
            'setproctitle',
        )
    },
    'jinja2': 'python3-jinja2',
    'markupsafe': 'python3-jinja2',  # of which it is a part
    'PIL': 'python3-pil',
    'yaml': 'python3-yaml',
}
NAMES = {  # on PyPI
    'SALib': 'SALib', 'PIL': 'Pillow', 'jinja2': 'Jinja2', 'markupsafe': 'Jinja2',
    'mcap_ros2': 'mcap-ros2-support', 'yaml': 'PyYAML', 'rerun': 'rerun-sdk', 'llvmlite': 'numba',
    'fast_simplification': 'fast-simplification',
}  # fmt: skip
FROM_PYPI = {'SALib', 'bokeh', 'lz4', 'mcap', 'mcap_ros2', 'pyarrow', 'rosbags', 'scipy',
             'zstandard'}  # fmt: skip
OPTIONAL = {'numba', 'llvmlite', 'distributed', 'pandas', 'rerun', 'capytaine', 'trimesh',
            'manifold3d', 'fast_simplification', 'networkx', 'pymavlink'}  # fmt: skip


@cache
def imported(package: str) -> set[str]:
    """Top-level modules that a package imports, without its own and Python's."""
    folder = ROOT / 'src' / package
    paths = [*(folder / package).rglob('*.py'), *folder.glob('launch/*.py')]
    found = {module.split('.')[0] for path in paths for module, _ in imports(path)}
    return found - {package} - set(sys.stdlib_module_names)


def setup_text(package: str) -> str:
    return (ROOT / 'src' / package / 'setup.py').read_text()


@pytest.mark.parametrize('package', PACKAGES)
def test_colcon_test_finds_its_tests_as_make_test_does(package: str) -> None:
    """colcon runs pytest in the package's folder, which then is the root of all paths."""
    folder = ROOT / 'src' / package
    parsed = configparser.ConfigParser()
    parsed.read(folder / 'pytest.ini')
    own = parsed['pytest']
    ours = tomllib.loads((ROOT / 'pyproject.toml').read_text())['tool']['pytest']['ini_options']
    paths = [(folder / path).resolve() for path in own['pythonpath'].split()]
    assert paths == [ROOT / path for path in ours['pythonpath']]
    assert (folder / own['testpaths']).resolve().parent == ROOT / ours['testpaths'][0]
    assert shlex.split(own['addopts']) == shlex.split(ours['addopts'])
    for key in ('markers', 'filterwarnings'):
        assert own[key].strip().split('\n') == ours[key]


@pytest.mark.parametrize('package', PACKAGES)
def test_package_xml_names_what_is_imported_and_nothing_else(package: str) -> None:
    manifest = ElementTree.parse(ROOT / 'src' / package / 'package.xml')
    named = [entry.text for entry in manifest.iter('exec_depend')]
    assert len(named) == len(set(named))
    needed = {KEYS.get(name, name) for name in imported(package) - FROM_PYPI - OPTIONAL}
    assert set(named) == needed


@pytest.mark.parametrize('package', PACKAGES)
def test_what_has_no_key_is_named_in_a_comment(package: str) -> None:
    text = (ROOT / 'src' / package / 'package.xml').read_text()
    comments = ' '.join(re.findall(r'<!--(.*?)-->', text, re.S))
    for name in imported(package) & (FROM_PYPI | OPTIONAL - {'llvmlite'}):
        if not (name == 'numba' and package != 'auv_dynamics'):  # named where it compiles
            assert NAMES.get(name, name) in comments, name


@pytest.mark.parametrize('package', PACKAGES)
def test_setup_py_requires_what_is_imported(package: str) -> None:
    text = setup_text(package)
    required = text.partition('install_requires=[')[2].partition(']')[0]
    needed = {n for n in imported(package) - OPTIONAL if n in KEYS or n in FROM_PYPI}
    needed |= imported(package) & set(PACKAGES)
    names = {entry.lower() for entry in re.findall(r"'([\w-]+)", required)}
    assert names - {'setuptools'} == {NAMES.get(name, name).lower() for name in needed}


@pytest.mark.parametrize('package', PACKAGES)
def test_versions_and_licences_agree(package: str) -> None:
    manifest = ElementTree.parse(ROOT / 'src' / package / 'package.xml').getroot()
    text = setup_text(package)
    for key in ('name', 'version', 'license'):
        value = manifest.findtext(key)
        assert (f"NAME = '{value}'" if key == 'name' else f"{key}='{value}'") in text
    assert f'version: {manifest.findtext("version")}\n' in (ROOT / 'CITATION.cff').read_text()
    shared = re.compile(r'license=.*?(?=\n    maintainer=)', re.S)
    assert shared.findall(text) == shared.findall(setup_text(PACKAGES[0]))


@pytest.mark.parametrize('package', PACKAGES)
def test_packages_carry_licence_and_types(package: str) -> None:
    folder = ROOT / 'src' / package
    assert (folder / 'LICENSE').read_text() == (ROOT / 'LICENSE').read_text()
    assert (folder / package / 'py.typed').is_file()
    assert "'py.typed'" in setup_text(package)


@pytest.mark.parametrize('package', PACKAGES)
def test_every_shipped_folder_is_linked_and_installed(package: str) -> None:
    links = list((ROOT / 'src' / package).glob('config/*'))
    for link in links:
        assert link.is_symlink()
        assert link.resolve() == ROOT / 'config' / link.name
        assert f"/config/{link.name}'" in setup_text(package)


def test_every_folder_of_config_belongs_to_one_package() -> None:
    links = [path.name for path in (ROOT / 'src').glob('*/config/*')]
    assert sorted(links) == sorted(path.name for path in (ROOT / 'config').iterdir())
