"""A document as one HTML file that needs nothing but itself."""

import base64
from collections.abc import Sequence
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any

import jinja2
import markupsafe

from auv_analysis.output.text import fixed, join, number, plain, tied
from auv_analysis.report.document import (
    NUMBERS,
    Block,
    Gallery,
    Prose,
    Section,
    Sentence,
    Table,
    write_numbers,
)
from auv_analysis.report.figure_files import FigureRecord
from auv_analysis.report.interactive import Interactive
from auv_analysis.report.provenance import provenance
from auv_analysis.report.quantities import QUANTITIES, Maths

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
    quantities = Section('quantities', 'Quantities', [prose('quantities', entries=QUANTITIES)])
    sections = [section for section in (*sections, quantities) if section.blocks]
    text = (
        environment()
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
    path.write_text(text + '\n', encoding='utf-8')
    write_numbers(out / NUMBERS, [table for section in sections for table in section.of(Table)])
    return path


def names_of(sections: Sequence[Section]) -> dict[str, str]:
    """Anchor -> what it is called in the text: 'table 2', 'figure 5', 'section 3'."""
    names = {section.name: f'section {i}' for i, section in enumerate(sections, start=1)}
    tables = (f'table-{table.name}' for section in sections for table in section.of(Table))
    figures = (
        figure.name for section in sections for figure in section.of(FigureRecord) if figure.png
    )
    names |= {anchor: f'table {i}' for i, anchor in enumerate(tables, start=1)}
    return names | {anchor: f'figure {i}' for i, anchor in enumerate(figures, start=1)}


@cache
def environment() -> jinja2.Environment:
    """Where the report's templates are, with the filters that they use."""
    found = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    found.filters |= {
        'num': number, 'plain': plain, 'fixed': fixed, 'tied': tied, 'join_words': join,
        'maths': maths, 'symbols': lambda text: maths(Maths(text)),
        'by_kind': by_kind, 'data': data_of,
    }  # fmt: skip
    return found


def prose(name: str, **context: Any) -> Prose:
    """Paragraphs of a macro of `prose.html.j2`, without arguments, that sees the context."""
    module = environment().get_template('prose.html.j2').make_module(context)
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
