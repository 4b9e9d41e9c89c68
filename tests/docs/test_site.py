"""The site builds without a warning, asks no other host for anything and fits a phone."""

import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from helpers.browser import chromium
from helpers.doc_blocks import ROOT
from helpers.needs import need

FOREIGN = re.compile(r'<(?:script|link|img|iframe)[^>]+(?:src|href)="(?:https?:)?//[^"]*"')
WIDTHS = (390, 1280)  # a phone and a desk
MATHS = 'mjx-container'


@pytest.fixture(scope='module')
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    need('sphinx', find_spec('sphinx'))
    out = tmp_path_factory.mktemp('site')
    binaries = Path(sys.executable).parent
    ended = subprocess.run(
        [binaries / 'sphinx-build', '-n', '-W', '--keep-going', '-d', out / 'doctrees',
         ROOT / 'docs', out / 'html'],
        env={**os.environ, 'AUV_GVC_NOTEBOOKS': str(out / 'notebooks'),
             'PATH': f'{binaries}:{os.environ["PATH"]}'},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    return out / 'html'


@pytest.mark.long
def test_asks_nobody(site: Path) -> None:
    pages = list(site.rglob('*.html'))
    assert len(pages) > 20
    for page in pages:
        found = FOREIGN.findall(page.read_text(encoding='utf-8'))
        assert found == [], page


@pytest.mark.long
@pytest.mark.parametrize('width', WIDTHS)
def test_fits_and_shows_equations(site: Path, width: int) -> None:
    with chromium() as browser:
        asked: list[str] = []
        context = browser.new_context(viewport={'width': width, 'height': 900})
        page = context.new_page()
        page.on('request', lambda request: asked.append(request.url))
        for path in sorted(site.glob('*.html')):
            page.goto(path.as_uri())
            assert page.evaluate('document.documentElement.scrollWidth') <= width, path.name
        page.goto((site / 'theory.html').as_uri())
        page.wait_for_selector(MATHS)
        assert page.locator(MATHS).count() > 60
        assert all(url.startswith(('file:', 'data:', 'blob:')) for url in asked)
