"""How Sphinx builds the site: `make docs`.

Sphinx and not MkDocs: equations have numbers that pages can refer to, `-n -W` refuses every dead
reference, also to Python names, and `linkcheck` lists the links that leave the site.
"""

import os
import subprocess
import sys
from pathlib import Path

import numba
from sphinx.application import Sphinx

HERE = Path(__file__).parent
numba.config.DISABLE_JIT = True  # autodoc wants functions; what is run has processes of its own
os.environ.setdefault('PYDEVD_DISABLE_FILE_VALIDATION', '1')  # else each kernel warns

project = 'auv_gvc'
copyright = 'the authors of auv_gvc, Apache 2.0'
extensions = [
    'myst_nb',
    'sphinx.ext.autodoc',
    'sphinx.ext.napoleon',
    'sphinx.ext.viewcode',
    'sphinx.ext.mathjax',
    'sphinx-mathjax-offline',
]
root_doc = 'index'
exclude_patterns = ['**.ipynb_checkpoints', 'images']

html_theme = 'furo'
html_title = 'auv_gvc'
html_static_path = ['_static']
html_css_files = ['site.css']
html_copy_source = False
html_show_sphinx = False

myst_enable_extensions = ['dollarmath', 'amsmath']
myst_heading_anchors = 4
# the scenario of a run is simulated with its kernels compiled; figures lie in the page
nb_execution_mode = 'cache'
nb_execution_cache_path = os.environ.get('AUV_GVC_NOTEBOOKS', '')
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_merge_streams = True

autodoc_default_options = {'members': True, 'undoc-members': False, 'member-order': 'bysource'}
autodoc_typehints = 'none'  # shapes and units stand in the text; the types say less
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_param = False
nitpicky = True

# an address is looked up by `make docs-links` alone: a build needs no network
linkcheck_anchors = False
linkcheck_timeout = 20

NAMED_LATER = '% further pages'


def add_further_pages(app: Sphinx, name: str, source: list[str]) -> None:
    """Put every page that no navigation names into the last one."""
    if name != root_doc:
        return
    listed = source[0].split()
    pages = sorted(path.stem for path in HERE.glob('*.md') if path.stem not in [*listed, root_doc])
    source[0] = source[0].replace(NAMED_LATER, '\n'.join(pages))


def draw_figures(app: Sphinx) -> None:
    """Draw the figures of the pages that are missing or older than what they show."""
    subprocess.run([sys.executable, HERE / 'figures.py'], check=True)


def setup(app: Sphinx) -> None:
    """Connect both."""
    app.connect('builder-inited', draw_figures)
    app.connect('source-read', add_further_pages)
