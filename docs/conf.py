"""How Sphinx builds the site: `make docs`.

Sphinx and not MkDocs: equations have numbers that pages can refer to, `-n -W` refuses every dead
reference, also to Python names, and `linkcheck` lists the links that leave the site.
"""

import os
import re
import subprocess
import sys
from functools import cached_property
from pathlib import Path
from types import FunctionType

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

autodoc_default_options = {'members': True, 'member-order': 'bysource'}
autodoc_typehints = 'none'  # shapes and units stand in the text; the types say less
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_param = False
napoleon_custom_sections = [('Attributes', 'params_style')]
nitpicky = True
# types of annotations and names of errors are texts; what a page refers to is a py:obj or py:mod
nitpick_ignore_regex = [('py:(class|exc)', '.*')]

# an address is looked up by `make docs-links` alone: a build needs no network
linkcheck_anchors = False
linkcheck_timeout = 20

SECTION = re.compile(r'(Parameters|Attributes|Returns|Raises)$')
ENTRY = re.compile(r'(\S.*?) : (.*)$')
NAMED_LATER = '% further pages'


def add_further_pages(app: Sphinx, name: str, source: list[str]) -> None:
    """Put every page that no navigation names into the last one."""
    if name != root_doc:
        return
    listed = source[0].split()
    pages = sorted(path.stem for path in HERE.glob('*.md') if path.stem not in [*listed, root_doc])
    source[0] = source[0].replace(NAMED_LATER, '\n'.join(pages))


def describe(
    app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]
) -> None:
    """Take what stands behind the colon of an entry for its description, as the sources mean it.

    Napoleon takes it for a type, whose words it would look up.
    """
    inside, result = False, ['']
    for line, below in zip(lines, [*lines, ''][1:], strict=True):
        if below.startswith('---'):
            inside = SECTION.match(line) is not None
        entry = ENTRY.match(line) if inside else None
        ends = inside and not entry and result[-1] == '' and line[:1] not in ('', ' ')
        if ends and not below.startswith('---'):
            inside = False
            result.append('')  # a second empty line ends the section
        result += [entry[1], f'    {entry[2]}'] if entry else [line]
    lines[:] = result[1:]


def is_field(
    app: Sphinx, what: str, name: str, obj: object, skip: bool, options: object
) -> bool | None:
    """Leave out fields: the section of attributes has them, with shapes and units."""
    known = (FunctionType, staticmethod, property, cached_property)
    return None if skip or what != 'class' or isinstance(obj, known) else True


def draw_figures(app: Sphinx) -> None:
    """Draw the figures of the pages that are missing or older than what they show."""
    subprocess.run([sys.executable, HERE / 'figures.py'], check=True)


def setup(app: Sphinx) -> None:
    """Connect them."""
    app.connect('builder-inited', draw_figures)
    app.connect('source-read', add_further_pages)
    app.connect('autodoc-skip-member', is_field)
    app.connect('autodoc-process-docstring', describe, priority=400)  # before napoleon's 500
