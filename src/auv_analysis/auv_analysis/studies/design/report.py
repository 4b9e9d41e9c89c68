"""The report of a design, as one HTML file."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from auv_analysis.output.text import Maths, number
from auv_analysis.report.document import Block, Section, Sentence, write_document
from auv_analysis.report.plots import FigureRecord
from auv_analysis.studies.design import tables
from auv_analysis.studies.design.plots import draw_design
from auv_analysis.studies.design.prediction import AT_REST, OTHERS, SIZE
from auv_analysis.studies.design.printed import print_design
from auv_analysis.studies.design.results import Design
from auv_analysis.studies.design.search import PART

__all__ = ['print_design', 'write_report']
METHOD = tuple(
    map(
        Maths,
        (
            'Every coupling is judged by its share in the motion. A deformed velocity counts by '
            'the kinetic energy, Σ N_i ξ_i^2 = ν^T M ν, a deformed input by the dual of it, '
            'Σ π_i^2 / N_i = τ^T M^-1 τ; both are free of units. Unless a coupling is asked for, '
            'the one with the largest share is reduced.',
            'A change adds to M, to the restoring moment and to the damping; Υ follows from M. The '
            'search takes the motion of the simulated vehicle as it was and computes by (1) what '
            'input the changed vehicle would need for it. It makes small r² + '
            f'{OTHERS:g} (o² + e²) + {AT_REST:g} b + {SIZE:g} s, where r is the largest magnitude '
            'of the coupling (in place of it the mean of eighth powers, which is smooth), o the '
            'root sum square of the shares of the other couplings, e the root of the mean of '
            'τ^T M^-1 τ, each after by before, b what turns the vehicle from level at rest or '
            'rights it less, in proportion to what rights it, and s the size of the change. '
            'The search is SLSQP with central differences, within the bounds from several '
            'starts.',
            'Every change in the tables was then simulated with its own vehicle. Of those that '
            'halve the coupling the one with the lowest score is proposed, where every part that '
            f'is changed costs {PART:g}; where none does, the one that lowers it most.',
        ),
    )
)


def write_report(result: Design, out: Path) -> Path:
    """Write report.html with its figures and numbers.parquet; returns the report's path.

    Parameters
    ----------
    result : of `concluded`
    out : its folder

    """
    document = result.document
    figures = draw_design(result, out / 'figures')
    listings = [
        (name, (out / name).read_text(encoding='utf-8'))
        for name in ('vehicle.yaml', 'vehicle_before.yaml', 'scenario.yaml')
    ]
    about = (
        f'{document["vehicle"]} in {document["scenario"]}, simulated with '
        f'{document["controller"]} ({document["hold"]})'
    )
    title = f'Design of {document["vehicle"]}'
    return write_document(
        out, title, about, [*_findings(result)], _sections(result, figures), listings
    )


def _findings(result: Design) -> Iterator[Sentence]:
    document = result.document
    source = 'table-measures' if document['measures'] else ''
    yield Sentence(document['statement'], source)
    if not document['measures']:
        return
    first, *rest = document['ranking']
    yield Sentence(_largest(first, rest), 'table-ranking')
    for warning in document['warnings']:
        yield Sentence(f'{warning[:1].upper()}{warning[1:]}.', 'proposal')


def _largest(first: dict[str, Any], rest: Sequence[dict[str, Any]]) -> str:
    share = number(100 * first['share']['before'], 2)
    name = first['coupling']
    text = f'The largest coupling of the vehicle as it was is {name}, {share} % of the motion'
    if rest:
        other = number(100 * rest[0]['share']['before'], 2)
        text += f'; the next, {rest[0]["coupling"]}, {other} %'
    return f'{text}.'


def _sections(result: Design, figures: Sequence[FigureRecord]) -> list[Section]:
    document = result.document
    if not document['measures']:
        return []
    drawn = {figure.name: figure for figure in figures}
    proposal: list[Block] = [
        *(f'{words[:1].upper()}{words[1:]}.' for words in document['proposal']['words']),
        tables.parameters_table(document),
        drawn['Upsilon'],
        tables.rest_table(document),
    ]
    effect: list[Block] = [
        drawn['couplings'],
        tables.ranking_table(document),
        drawn['reduced'],
        tables.measures_table(document),
    ]
    others = tables.controllers_table(document)
    effect += [] if others is None else [others]
    failures = [
        f'Under {name}: {one["failure"]}.'
        for name, one in document['controllers'].items()
        if one['failure']
    ]
    choice = [tables.matrix_table(document), tables.alternatives_table(document)]
    return [
        Section('proposal', 'The change', proposal),
        Section('effect', 'What it does', [*effect, *failures]),
        Section('choice', 'Which change removes which coupling', choice),
        Section('method', 'How it was found', [*METHOD, *document['assumptions']]),
    ]
