"""The notebooks run from their first cell to their last, and are kept without what they print."""

import json
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from helpers.doc_blocks import ROOT
from helpers.needs import need
from helpers.patience import patience

NOTEBOOKS = sorted((ROOT / 'docs' / 'notebooks').glob('*.ipynb'))


@pytest.mark.parametrize('path', NOTEBOOKS, ids=lambda path: path.stem)
def test_kept_without_outputs(path: Path) -> None:
    cells = [cell for cell in json.loads(path.read_text())['cells'] if cell['cell_type'] == 'code']
    assert cells
    for cell in cells:
        assert cell['outputs'] == []
        assert cell['execution_count'] is None


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
