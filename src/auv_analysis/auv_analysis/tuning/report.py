"""The report of a tuning."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from auv_analysis.report.document import Block, Section, Sentence
from auv_analysis.report.figure_files import FigureRecord
from auv_analysis.report.quantities import Maths
from auv_analysis.report.rendering import write_document
from auv_analysis.tuning import tables
from auv_analysis.tuning.rivals import POINTS
from auv_analysis.tuning.search import FINALISTS, LONG, SHORT, STARTS

MEASURES = (
    'Error and effort are weighted by the inertia, so that metres and radians, newtons and newton '
    'metres add up without chosen weights, and both are the same in every body frame. The '
    'time-weighted error is what the search makes small unless --index says otherwise: the plain '
    'mean is decided by the first moments, in which a law has its gain and nothing else.'
)
FAIR = (
    'Every law was given the same search: the reference’s gains in the units of the law, the '
    f'middle of the bounds and {POINTS} Sobol points over all its gains (of six numbers per gain, '
    'the best multiple of the inertia instead), then sequential quadratic programming with the '
    'equality as a constraint, '
    f'{SHORT} gradients from each of the best {STARTS} points and {LONG} from the best {FINALISTS} '
    'of these at most; a gradient of a law with more gains takes more loops. '
    'The reference’s own law takes part, '
    'since its gains in the scenario were not searched: against it, what is left is the law’s.'
)
PERIOD = Maths(
    'No velocity loop may be faster than the control period carries: lambda_max(M^-1 K_D) times '
    'the step stays at or below 1, or at the reference’s own value where that is above.'
)
SAME_LAW = (
    'With gains that are multiples of the full M (--structure inertia), CL and GVC are one and the '
    'same law: what tells them apart is the off-diagonal part of their gains alone.'
)


def write_report(
    out: Path,
    document: Mapping[str, Any],
    findings: Sequence[Sentence],
    pairs: Sequence[Sentence],
    figures: Sequence[FigureRecord],
    listings: Sequence[tuple[str, str]],
) -> Path:
    """Write `report.html`.

    Parameters
    ----------
    out : folder
    document : contents of `tune.json`
    findings : of `verdict`
    pairs : of `paired_sentences`
    figures : of `pictures`
    listings : name and text of the files that are shown in full

    Returns
    -------
    path : of report.html

    """
    drawn = {figure.name: figure for figure in figures}
    deviation = document['validation']['largest_relative_deviation']
    checked = (
        'Single runs of scenario.yaml by auv simulate’s kernel give the same numbers: the largest '
        f'relative deviation is {deviation:.1g}.'
    )
    tuned: list[Block] = [
        FAIR,
        tables.tuned_table(document),
        drawn['trade_off'],
        tables.gains_table(document),
        checked,
    ]
    draws: list[Block] = []
    if document['monte_carlo']:
        draws = [
            tables.spread_table(document),
            drawn['draws'],
            drawn['paired'],
            tables.draws_table(document),
            *pairs,
            tables.paired_table(document),
        ]
    sections = [
        Section('tuned', 'Tuned alike', tuned),
        Section('random', 'The same random changes for all', draws),
        Section('basis', 'What this rests on', [
            MEASURES, PERIOD, SAME_LAW, tables.allowed_table(document),
        ]),
    ]  # fmt: skip
    about = (
        f'{document["vehicle"]}, reference {document["reference"]}, equal {document["equal"]} '
        f'within {100 * document["tolerance"]:g} %, hold {document["hold"]}, '
        f'seed {document["seed"]}'
    )
    title = f'Tuning of {document["scenario"]}'
    return write_document(out, title, about, findings, sections, listings)
