"""The notebooks run from their first cell to their last, and are kept without what they print."""

import shutil
import sys
from pathlib import Path

import pytest
from helpers.doc_blocks import ROOT

nbformat = pytest.importorskip('nbformat', reason='make docs-tools installs it')
NOTEBOOKS = sorted((ROOT / 'docs' / 'notebooks').glob('*.ipynb'))


@pytest.mark.parametrize('path', NOTEBOOKS, ids=lambda path: path.stem)
def test_kept_without_outputs(path: Path) -> None:
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    for cell in notebook.cells:
        if cell.cell_type == 'code':
            assert cell.outputs == []
            assert cell.execution_count is None


@pytest.mark.long
@pytest.mark.parametrize('path', NOTEBOOKS, ids=lambda path: path.stem)
def test_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nbclient = pytest.importorskip('nbclient', reason='make docs-tools installs it')
    monkeypatch.setenv('PATH', str(Path(sys.executable).parent), prepend=':')
    copied = shutil.copy(path, tmp_path)
    notebook = nbformat.read(copied, as_version=4)
    client = nbclient.NotebookClient(
        notebook, timeout=580, resources={'metadata': {'path': tmp_path}}
    )
    client.execute()
    shown = [output for cell in notebook.cells for output in cell.get('outputs', [])]
    assert any('image/png' in output.get('data', {}) for output in shown)
