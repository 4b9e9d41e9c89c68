"""Texts that somebody has read and approved, beside the tests: all that a page or figure shows.

They say what changed, not whether it is right: that is what other tests compute. In words nothing
may differ. Numbers may by one part in a thousand or by half a unit of their last digit, so that
other processors and other versions of NumPy agree; they have as many digits as before, or as many
decimals, unless what differs is a unit of the last one. After a change that is meant,

    AUV_GVC_APPROVE=1 pytest <the test>

writes the texts anew; `git diff` shows what there is to read.
"""

import json
import os
import re
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import zip_longest
from pathlib import Path
from typing import Any

import pytest
from helpers import shown
from helpers.report_pages import value_of
from matplotlib.figure import Figure

from auv_analysis.driver.evidence import CheckResult
from auv_analysis.output.folder import MANIFEST, listed_in, paths_in
from auv_analysis.report import document, panels, plots, results

APPROVE = 'AUV_GVC_APPROVE' in os.environ and 'CI' not in os.environ
RELATIVE, NOISE = 1e-3, 1e-9
MOST = 12  # differences that are shown
NUMBER = re.compile(
    r'(?<![\w#.])[−+-]?\d[\d\u202f]*(?:\.\d+)?(?:e[+-]?\d+|·10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?(?!\w)'
)
FOLDERS = re.compile(
    f'(?:{re.escape(tempfile.gettempdir())}|{re.escape(str(Path(__file__).parents[2]))})'
    r'(?:/[\w.+-]+)*/'
)


def _digits(number: str) -> tuple[int, int]:
    """How many significant digits a number has, and how many decimals."""
    mantissa = re.split('[e·]', number)[0].lstrip('−+-').replace('\u202f', '')
    return len(mantissa.replace('.', '').lstrip('0')), len(mantissa.partition('.')[2])


def alike(one: str, other: str, within: float = RELATIVE) -> bool:
    """Whether two lines have the same words, and numbers that are near and as exact."""
    if one == other:
        return True
    if NUMBER.sub('#', one) != NUMBER.sub('#', other):
        return False
    for a, b in zip(NUMBER.findall(one), NUMBER.findall(other), strict=True):
        (x, half), (y, other_half) = value_of(a), value_of(b)
        apart, half = abs(x - y), min(half, other_half)
        if apart > max(within * max(abs(x), abs(y)), half, NOISE):
            return False
        as_exact = any(i == j for i, j in zip(_digits(a), _digits(b), strict=True))
        if not as_exact and apart > max(2 * half, NOISE):
            return False
    return True


def _differences(approved: list[str], found: list[str], within: float) -> list[str]:
    """Pairs of lines that differ, from the first on in which they do."""
    both = zip_longest(approved, found, fillvalue='')
    pairs = [(a, b) for a, b in both if not alike(a, b, within)]
    told = []
    for a, b in pairs[:MOST]:
        at = next((i for i, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), 0)
        told += [f'- {"…" * (at > 40)}{a[max(at - 40, 0) : at + 80]}',
                 f'+ {"…" * (at > 40)}{b[max(at - 40, 0) : at + 80]}']  # fmt: skip
    return told + [f'and {len(pairs) - MOST} more'] * (len(pairs) > MOST)


def check(path: Path, name: str, lines: Iterable[str], within: float = RELATIVE) -> None:
    """Hold lines against those approved under a name in a file, or approve them."""
    found = [line.rstrip() for text in lines for line in text.splitlines()]
    found = [FOLDERS.sub('<folder>/', line) for line in found]
    parts = _parts(path)
    known = parts.get(name, [])
    if _same(known, found, within):
        return
    if APPROVE:
        parts[name] = found
        path.parent.mkdir(exist_ok=True)
        texts = ('\n'.join([f'=== {key}', *parts[key], '']) for key in sorted(parts))
        path.write_text(''.join(texts), encoding='utf-8')
        return
    told = '\n'.join(_differences(known, found, within))
    pytest.fail(f'{path.name}, {name}: - approved, + found\n{told}\n{__doc__}', pytrace=False)


def _same(approved: list[str], found: list[str], within: float) -> bool:
    pairs = zip(approved, found, strict=False)
    return len(approved) == len(found) and all(alike(a, b, within) for a, b in pairs)


def _parts(path: Path) -> dict[str, list[str]]:
    if not path.exists():
        return {}
    _, *parts = re.split(r'^=== ', path.read_text(encoding='utf-8'), flags=re.MULTILINE)
    return {name: text.splitlines() for name, _, text in (part.partition('\n') for part in parts)}


def _check_line(one: CheckResult) -> Iterator[str]:
    """What a check of a driver says, once it has its name."""
    if one.id:
        known = {k: x for k, x in one.document()['numbers'].items() if x is not None}
        numbers = ', '.join(f'{name} {value:.4g}' for name, value in known.items())
        yield ' | '.join((one.id, one.verdict, one.expected, one.found, one.advice, numbers))


class Approved:
    """What a test shows: figures, tables and panels that it makes, and pages that it names.

    Where a search found its numbers, which ends elsewhere on another processor, they may be
    further apart than `RELATIVE`: `within`, that the test sets.
    """

    def __init__(self) -> None:
        self.within = RELATIVE
        self._made: list[Any] = []
        self._told: list[Iterable[str]] = []
        self._pages: list[str] = []

    def add(self, lines: Iterable[str]) -> None:
        """Lines to approve beside, such as what is printed; they may be made later."""
        self._told.append(lines)

    def folder(self, folder: Path, *, panels: bool = False) -> None:
        """What is in a folder: page, figures, composed by `artists.captured`, and documents."""
        listed = listed_in(folder)  # else it could not be replaced
        assert listed is None or {*paths_in(folder)} <= {*listed, MANIFEST}
        page, lines = folder / 'report.html', list[str]()
        if page.exists():
            lines += shown.page_lines(page.read_text(encoding='utf-8'), panels=panels)
        for path in sorted(folder.glob('figures/*.pdf')):
            lines += [f'figure {path.stem}', *path.read_text(encoding='utf-8').splitlines()]
        for path in sorted(folder.glob('*.json')):
            if path.name not in ('manifest.json', 'summary.json'):
                lines += [path.name, *shown.document_lines(json.loads(path.read_text()))]
        for path in sorted(folder.glob('*.parquet')):
            lines += shown.parquet_lines(path)
        self._pages += lines

    def lines(self) -> Iterator[str]:
        """The pages, else all that was made, in this order; then what was added."""
        yield from self._pages
        for one in [] if self._pages else self._made:
            if isinstance(one, Figure):
                yield 'figure'
                yield from shown.figure_lines(one)
            elif isinstance(one, plots.FigureRecord):
                yield f'{one.name}: {one.title}. {one.caption}'
            elif isinstance(one, results.Table):
                yield from shown.table_lines(one)
            elif isinstance(one, document.Sentence):
                yield f'{one.text} {one.source}'
            elif isinstance(one, CheckResult):
                yield from _check_line(one)
            else:
                yield from one
        for lines in self._told:
            yield from lines

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Collect what is made meanwhile."""
        compose = panels.document

        def kept(make: Any) -> Any:
            def made(one: Any, *args: Any, **about: Any) -> None:
                make(one, *args, **about)
                self._made.append(one)

            return made

        def panels_of(*args: Any) -> list[Any]:
            found = compose(*args)
            self._made.append([*shown.panel_lines(found)])
            return found

        with pytest.MonkeyPatch.context() as patch:
            for kind in (Figure, plots.FigureRecord, results.Table, document.Sentence, CheckResult):
                patch.setattr(kind, '__init__', kept(kind.__init__))
            patch.setattr(panels, 'document', panels_of)
            yield
