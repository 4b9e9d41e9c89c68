"""A document of sections, tables and figures, and the one HTML file that shows it."""

from __future__ import annotations

import base64
import platform
import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from itertools import groupby
from pathlib import Path
from typing import Any

import jinja2
import markupsafe
from markupsafe import Markup
from pyarrow import parquet

from auv_analysis.metrics.quantities import SIGNALS
from auv_analysis.output.arrow import pa
from auv_analysis.output.text import Maths, fixed, join, number, tied
from auv_analysis.report.panels import Interactive, PanelSet
from auv_analysis.report.plots import FigureRecord
from auv_analysis.report.results import Table, numbers_of
from auv_dynamics.kernel.compile import sources_digest

NUMBERS = 'numbers.parquet'  # beside the report: every number that its tables show


@dataclass(frozen=True)
class Sentence:
    """A sentence computed from numbers.

    Attributes
    ----------
    text : of the sentence, with its full stop
    source : anchor of the table, figure or section that carries its numbers

    """

    text: str
    source: str = ''


@dataclass(frozen=True)
class Prose:
    """Paragraphs that are HTML already: those of `prose.html.j2`."""

    html: Markup


@dataclass(frozen=True)
class Gallery:
    """Panels, and the still figures that stand for them on paper and where no script runs."""

    panels: PanelSet
    figures: Sequence[FigureRecord]


Block = str | Prose | Sentence | Table | FigureRecord | Gallery


@dataclass(frozen=True)
class Section:
    """A section: its anchor, its title, and what stands in it."""

    name: str
    title: str
    blocks: Sequence[Block]

    @property
    def tables(self) -> list[Table]:
        """Its tables."""
        return [block for block in self.blocks if isinstance(block, Table)]

    @property
    def figures(self) -> list[FigureRecord]:
        """Its figures, those in galleries too."""
        members = (b.figures if isinstance(b, Gallery) else (b,) for b in self.blocks)
        return [one for some in members for one in some if isinstance(one, FigureRecord)]


def write_numbers(path: Path, tables: Sequence[Table]) -> None:
    """Write a row for every number that some tables show.

    Parameters
    ----------
    path : of the Parquet file; columns table, row, column, text, value, unit, source
    tables : of one report

    """
    columns = ('table', 'row', 'column', 'text', 'value', 'unit', 'source')
    types = [(column, pa.float64() if column == 'value' else pa.string()) for column in columns]
    rows = list(numbers_of(tables))
    parquet.write_table(pa.Table.from_pylist(rows, schema=pa.schema(types)), path)


HERE = Path(__file__).parent
KINDS = {
    Prose: 'prose',
    Table: 'table',
    FigureRecord: 'picture',
    Gallery: 'gallery',
    Sentence: 'sentence',
    str: 'text',
    Maths: 'text',
}


def write_document(
    out: Path,
    title: str,
    about: str,
    findings: Sequence[Sentence],
    sections: Sequence[Section],
    listings: Sequence[tuple[str, str]] = (),
    interactive: Interactive | None = None,
) -> Path:
    """Write `report.html`, and beside it `numbers.parquet` with every number of its tables.

    Parameters
    ----------
    out : folder, existing
    title : of the page
    about : a line below it: vehicles, controllers, source
    findings : sentences of the summary, first on the page
    sections : in their order; those without blocks are left out, the list of quantities follows
    listings : name and text of files that are shown in full at the end
    interactive : what the panels of its galleries show; none: it has no galleries

    Returns
    -------
    path : of report.html

    """
    quantities = Section(
        'quantities', 'Quantities', [prose('quantities', entries=SIGNALS.values())]
    )
    sections = [section for section in (*sections, quantities) if section.blocks]
    text = (
        environment(HERE)
        .get_template('document.html.j2')
        .render(
            title=title,
            about=about,
            findings=findings,
            sections=sections,
            section_numbers={s.name: i for i, s in enumerate(sections, start=1)},
            names=names_of(sections),
            listings=listings,
            interactive=interactive,
            provenance=provenance(),
        )
    )
    path = out / 'report.html'
    path.write_text(text + '\n', encoding='utf-8', errors='replace')  # a name of a file may be none
    write_numbers(out / NUMBERS, [table for section in sections for table in section.tables])
    return path


def names_of(sections: Sequence[Section]) -> dict[str, str]:
    """Anchor -> what it is called in the text: 'table 2', 'figure 5', 'section 3'."""
    names = {section.name: f'section {i}' for i, section in enumerate(sections, start=1)}
    tables = (f'table-{table.name}' for section in sections for table in section.tables)
    figures = (figure.name for section in sections for figure in section.figures if figure.png)
    names |= {anchor: f'table {i}' for i, anchor in enumerate(tables, start=1)}
    return names | {f'figure-{name}': f'figure {i}' for i, name in enumerate(figures, start=1)}


@cache
def environment(folder: Path) -> jinja2.Environment:
    """Where the templates of a folder are, compiled once, with the filters that they use."""
    found = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        autoescape=True,
        trim_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    found.filters |= {
        'num': number, 'fixed': fixed, 'join_words': join, 'maths': maths,
        'symbols': lambda text: maths(Maths(text)), 'by_kind': by_kind, 'data': data_of,
    }  # fmt: skip
    return found


def prose(name: str, *, folder: Path = HERE, **context: Any) -> Prose:
    """Paragraphs of a macro of a folder's `prose.html.j2`, that sees the context."""
    module = environment(folder).get_template('prose.html.j2').make_module(context)
    return Prose(getattr(module, name)())


def by_kind(blocks: Sequence[Block]) -> list[tuple[str, list[Block]]]:
    """Consecutive blocks of one kind together, with the name of that kind."""
    return [(kind, list(run)) for kind, run in groupby(blocks, key=lambda b: KINDS[type(b)])]


def data_of(path: Path) -> str:
    """Contents of a PNG for a `src` attribute."""
    return f'data:image/png;base64,{base64.b64encode(path.read_bytes()).decode("ascii")}'


def maths(text: str) -> markupsafe.Markup:
    """Our own words with their symbols set, every other text as it stands; see `Maths`."""
    set_text = text.html() if isinstance(text, Maths) else markupsafe.escape(text)
    return markupsafe.Markup(tied(str(set_text)))


PACKAGES = ('auv_analysis', 'auv_gvc_controller', 'auv_dynamics', 'numpy', 'numba', 'scipy')
_version = cache(metadata.version)


def provenance() -> dict[str, Any]:
    """What made a report that is written now; the command is '' where it was none."""
    ours = Path(sys.argv[0]).stem == 'auv'
    versions = {'Python': platform.python_version()}
    for package in PACKAGES:
        try:
            versions[package] = _version(package)
        except metadata.PackageNotFoundError:
            continue
    return {
        'command': shlex.join(['auv', *sys.argv[1:]]) if ours else '',
        'versions': versions,
        'sources': sources_digest(),
        'written': f'{datetime.now(UTC):%Y-%m-%d %H:%M} UTC',
    }
