"""What runs code or commands from data stands nowhere in the sources, but for what is listed."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCES = sorted(
    path
    for folder in ('src', 'examples', 'config', 'docs')
    for path in (ROOT / folder).rglob('*.py')
    if 'build' not in path.parts
)
PACKAGES = ('auv_dynamics', 'auv_gvc_controller', 'auv_analysis')
MODULES = {  # their files or answers run code when they are read, or they talk to the network
    *('pickle', '_pickle', 'cPickle', 'dill', 'cloudpickle', 'shelve', 'marshal', 'joblib'),
    *('code', 'codeop', 'imp', 'runpy', 'telnetlib', 'ftplib', 'smtplib', 'xmlrpc', 'requests'),
    *('urllib.request', 'http', 'httpx', 'socket', 'socketserver', 'asyncio'),
}
CALLS = {
    *('eval', 'exec', 'compile', '__import__', 'input'),
    *('os.system', 'os.popen', 'subprocess.getoutput', 'subprocess.getstatusoutput'),
    *('yaml.load', 'yaml.load_all', 'yaml.unsafe_load', 'yaml.unsafe_load_all'),
    *('yaml.full_load', 'yaml.full_load_all'),
    *('tempfile.mktemp', 'importlib.import_module', 'shutil.unpack_archive'),
    *('markupsafe.Markup', 'numpy.fromfile', 'logging.config.listen'),
}
NAMES = {'yaml.Loader', 'yaml.FullLoader', 'yaml.UnsafeLoader', 'yaml.CLoader'}
METHODS = {'extractall', 'unsafe_load'}  # of archives: a member may lie outside the folder
EXPRESSIONS = (ast.Name, ast.Attribute)
KEYWORDS = {('shell', True), ('allow_pickle', True), ('autoescape', False)}
LISTED = {
    ('auv_gvc_controller/laws/law.py', 'importlib.import_module'),  # a user's own law
    ('auv_dynamics/ros/topics.py', 'importlib.import_module'),  # installed messages
    ('auv_analysis/cli/main.py', 'importlib.import_module'),  # names of ours, as below
    ('auv_dynamics/files/lazy.py', 'importlib.import_module'),  # likewise
    ('auv_dynamics/kernel/jit.py', 'importlib.import_module'),  # a module of numba
    ('auv_analysis/output/parallel.py', 'pickle'),  # what a forked copy of the process computed
    ('auv_analysis/graph/domain.py', 'socket'),  # which ports are free
    ('auv_analysis/graph/fork_server.py', 'socket'),  # a pair, of the process and its copy
    ('auv_analysis/graph/fork_server.py', 'importlib.import_module'),  # names of ours
    ('udp.py', 'socket'),  # of the example's driver
    ('json_backend.py', 'socket'),  # of the example that is ArduSub's physics
    ('auv_analysis/report/document.py', 'markupsafe.Markup'),  # of text that was escaped before
    ('auv_analysis/output/text.py', 'markupsafe.Markup'),  # of words of ours, and escaped
}


def dotted(node: ast.AST, names: dict[str, str]) -> str:
    """Full name of an expression such as `np.load`, '' where it is no name."""
    if isinstance(node, ast.Name):
        return names.get(node.id, node.id)
    if isinstance(node, ast.Attribute):
        above = dotted(node.value, names)
        return f'{above}.{node.attr}' if above else ''
    return ''


def dangers(text: str) -> Iterator[str]:
    """What a source does that it should not."""
    nodes, names = list(ast.walk(ast.parse(text))), {}
    for node in nodes:
        found = []
        if isinstance(node, ast.Import):
            names |= {
                alias.asname or alias.name: alias.name for alias in node.names if alias.asname
            }
            found = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            full = {
                alias.asname or alias.name: f'{node.module}.{alias.name}' for alias in node.names
            }
            names |= full
            found = [node.module, *full.values()]
        yield from (name for name in found if {name, name.split('.')[0]} & MODULES)
    for node in nodes:
        if isinstance(node, ast.Call):
            name = dotted(node.func, names)
            if name in CALLS:
                yield name
            if isinstance(node.func, ast.Attribute) and node.func.attr in METHODS:
                yield node.func.attr
            for keyword in node.keywords:
                value = keyword.value.value if isinstance(keyword.value, ast.Constant) else None
                if (keyword.arg, value) in KEYWORDS:
                    yield f'{keyword.arg}={value}'
        elif isinstance(node, EXPRESSIONS) and dotted(node, names) in NAMES:
            yield dotted(node, names)


def test_sources_run_nothing_that_they_read() -> None:
    assert len(SOURCES) > 250
    found = {
        ('/'.join(path.relative_to(ROOT).parts[2:]), danger)
        for path in SOURCES
        for danger in dangers(path.read_text(encoding='utf-8'))
    }
    assert found == LISTED


@pytest.mark.parametrize(
    ('text', 'found'),
    [
        ('import yaml\nyaml.load(x, Loader=yaml.SafeLoader)', 'yaml.load'),
        ('import yaml as y\nclass A(y.UnsafeLoader): pass', 'yaml.UnsafeLoader'),
        ('from yaml import full_load as read\nread(x)', 'yaml.full_load'),
        ('import pickle', 'pickle'),
        ('def f():\n    from pickle import loads', 'pickle'),
        ('eval(x)', 'eval'),
        ('exec(x)', 'exec'),
        ('import os\nos.system(x)', 'os.system'),
        ('from os import popen\npopen(x)', 'os.popen'),
        ('import subprocess\nsubprocess.run(x, shell=True)', 'shell=True'),
        ('import tempfile\ntempfile.mktemp()', 'tempfile.mktemp'),
        ('import numpy as np\nnp.load(x, allow_pickle=True)', 'allow_pickle=True'),
        ('import importlib as i\ni.import_module(x)', 'importlib.import_module'),
        ('import zipfile\nzipfile.ZipFile(x).extractall()', 'extractall'),
        ('import jinja2\njinja2.Environment(autoescape=False)', 'autoescape=False'),
        ('import urllib.request', 'urllib.request'),
    ],
)
def test_what_runs_data_is_found(text: str, found: str) -> None:
    assert found in set(dangers(text))


@pytest.mark.parametrize(
    'text',
    [
        'import yaml\nyaml.safe_load(x)',
        'import yaml\nclass A(yaml.SafeLoader): pass',
        'import re\nre.compile(x)',
        'import subprocess\nsubprocess.run([x])',
        'import numpy as np\nnp.load(x, allow_pickle=False)',
        'model.eval(x)',
    ],
)
def test_what_is_safe_is_not(text: str) -> None:
    assert not set(dangers(text))


def test_only_our_own_scripts_are_put_into_a_report_unescaped() -> None:
    templates = [*(ROOT / 'src').rglob('*.j2')]
    text = '\n'.join(path.read_text() for path in templates)
    assert len(templates) > 3
    assert 'autoescape' not in text
    unescaped = set(re.findall(r'[^{ ]+(?= *\|\s*safe)', text))
    ours = {'interactive.library', 'interactive.script'}
    assert ours < unescaped
    assert all(entry.startswith("'") or entry.endswith("'") for entry in unescaped - ours)
