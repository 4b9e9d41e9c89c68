"""The notebooks run from their first cell to their last, and are kept without what they print."""

import ast
import json
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from helpers.doc_blocks import ROOT
from helpers.needs import need
from helpers.patience import patience

NOTEBOOKS = sorted((ROOT / 'docs' / 'notebooks').glob('*.ipynb'))


def code_cells(path: Path) -> list[dict[str, Any]]:
    return [cell for cell in json.loads(path.read_text())['cells'] if cell['cell_type'] == 'code']


@pytest.mark.parametrize('path', NOTEBOOKS, ids=lambda path: path.stem)
def test_kept_without_outputs(path: Path) -> None:
    cells = code_cells(path)
    assert cells
    for cell in cells:
        assert cell['outputs'] == []
        assert cell['execution_count'] is None


@pytest.mark.parametrize('path', NOTEBOOKS, ids=lambda path: path.stem)
def test_takes_only_names_of_ours_that_exist(path: Path) -> None:
    """Each is run by `make docs` alone, and would be found broken late."""
    nodes = [
        node for cell in code_cells(path) for node in ast.walk(ast.parse(''.join(cell['source'])))
    ]
    taken = [ast.unparse(node) for node in nodes if isinstance(node, ast.ImportFrom)]
    taken = [line for line in taken if line.startswith('from auv_')]
    assert taken
    exec('\n'.join(taken), {})


@pytest.mark.long
@pytest.mark.parametrize('path', NOTEBOOKS, ids=lambda path: path.stem)
def test_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    need('sphinx', find_spec('nbclient'))
    import nbclient
    import nbformat

    monkeypatch.setenv('PATH', str(Path(sys.executable).parent), prepend=':')
    copied = shutil.copy(path, tmp_path)
    notebook = nbformat.read(copied, as_version=4)
    nbformat.validate(notebook)
    client = nbclient.NotebookClient(
        notebook, timeout=patience(580), resources={'metadata': {'path': tmp_path}}
    )
    client.execute()
    shown = [output for cell in notebook.cells for output in cell.get('outputs', [])]
    assert any('image/png' in output.get('data', {}) for output in shown)
