"""The part of a report that is about faults, with its file and its figure written."""

from collections.abc import Mapping
from pathlib import Path

from auv_analysis.metrics.fault_response import Response, responses, write_responses
from auv_analysis.report.document import Block, Section, Sentence
from auv_analysis.report.fault_figure import fault_figure
from auv_analysis.report.fault_sentences import fault_overview, fault_sentences
from auv_analysis.report.sketching import sketches
from auv_analysis.report.tables.faults import fault_tables
from auv_analysis.runs.run import AnyRun

ABOUT = (
    'The simulated vehicle has faults that the controllers do not know of. Each is held against '
    'the times before and behind it.'
)
TITLE = 'Faults: what each law does under them'
NO_ERROR = 'No set-point of these runs is known, and so no error.'


def fault_part(out: Path, runs: Mapping[str, AnyRun]) -> tuple[Section, list[Sentence]] | None:
    """Section on the faults of some runs; writes `faults.parquet` and the figure.

    Parameters
    ----------
    out : folder of the results
    runs : name -> run

    Returns
    -------
    section, sentences : and what the summary says; None where the runs have no faults, or not the
        same ones

    """
    if len({run.faults for run in runs.values()}) != 1 or not next(iter(runs.values())).faults:
        return None
    found: dict[str, list[Response]] = {name: responses(run) for name, run in runs.items()}
    if not all(found.values()):
        return Section('faults', TITLE, [NO_ERROR]), []
    write_responses(out, found)
    figure = fault_figure(sketches(runs), out / 'figures')
    blocks: list[Block] = [ABOUT, *fault_sentences(found), figure, *fault_tables(found)]
    return Section('faults', TITLE, blocks), [*fault_overview(found)]
