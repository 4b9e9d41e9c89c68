"""A headless Chromium of this machine, and what tests ask of a page in it."""

import io
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from helpers.needs import need
from helpers.patience import patience
from PIL import Image
from playwright.sync_api import sync_playwright

NAMES = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable')
SHOWN = """(name) => {
  const figure = Bokeh.documents.flatMap((doc) => doc.roots()).find((root) => root.name === name);
  const { start, end } = figure.x_range;
  const lines = figure.renderers.filter((line) => line.visible).map((line) => line.name);
  return { window: [start, end], lines };
}"""


@contextmanager
def chromium() -> Iterator[Any]:
    """The browser; the test that asks for it is skipped where there is none."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    need('chromium', found)
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=found, args=['--disable-gpu'])
        try:
            yield browser
        finally:
            browser.close()


class Watched:
    """A page of which every request and every complaint is kept."""

    def __init__(self, browser: Any, path: Path, anchor: str = '', **context: Any):
        self.path = path
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self.page = browser.new_context(
            viewport={'width': 1280, 'height': 900}, **context
        ).new_page()
        self.page.set_default_timeout(1000 * patience(20))
        self.page.on('request', lambda request: self.requests.append(request.url))
        self.page.on('pageerror', lambda error: self.complaints.append(str(error)))
        self.page.on('console', self._heard)
        self.page.goto(path.as_uri() + anchor)

    def _heard(self, message: Any) -> None:
        if message.type in ('error', 'warning'):
            self.complaints.append(message.text)

    def close(self) -> None:
        """Close the page, which asked for nothing but itself and complained of nothing."""
        self.page.context.close()
        assert self.complaints == []
        asked = {url.partition('#')[0] for url in self.requests if not url.startswith('blob:')}
        assert asked == {self.path.as_uri()}

    def panel(self, name: str) -> Any:
        """Element of a panel, in view and drawn."""
        self.page.wait_for_selector('.panel-controls[data-ready]', state='attached')
        panel = self.page.locator(f'[data-panel="{name}"]')
        panel.scroll_into_view_if_needed()
        panel.locator('.plot > *').first.wait_for()
        return panel

    def shown(self, name: str) -> dict[str, Any]:
        """What Bokeh's models of a panel say, after everything asked for has been done."""
        self.panel(name)
        return self.page.evaluate(SHOWN, name)

    def settle(self) -> None:
        """Wait for two frames: what is asked for is done in the first."""
        self.page.evaluate(
            '() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))'
        )


def pixels(element: Any) -> np.ndarray:
    """Screenshot of an element, (rows, columns, 3)."""
    with Image.open(io.BytesIO(element.screenshot())) as image:
        return np.asarray(image.convert('RGB')).astype(int)


def coloured(image: np.ndarray, colour: str) -> int:
    """Number of pixels of a colour, '#rrggbb', antialiased ones left out."""
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return int((np.abs(image - wanted).max(axis=2) < 12).sum())
