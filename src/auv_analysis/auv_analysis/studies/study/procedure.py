"""The parts of a study as sections of its report, with their files and figures written."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import pyarrow as pa
from pyarrow import parquet

from auv_analysis.herman2018.cases import PaperClaims
from auv_analysis.metrics.coupling import delta_pi, delta_xi
from auv_analysis.metrics.energy import kinetic_energy
from auv_analysis.report.document import Block, Section, Sentence
from auv_analysis.runs.run import AnyRun, Run
from auv_analysis.studies.study.sensitivity import Sensitivity
from auv_analysis.studies.study.sensitivity_report import (
    left_out_table,
    sensitivity_plot,
    sensitivity_sentences,
    sensitivity_table,
    write_sensitivities,
)
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.laws.model import ControlModel, control_model

Part = tuple[Section, list[Sentence]]
GAINS = (
    'Every gain is multiplied by a number of its own, drawn log-uniformly; each KPI of the run '
    'is taken by its logarithm, so that its standard deviation is about a relative change. '
    'Sensitive is what has a large one. The index of a gain is the share of the variance that it '
    'makes.'
)


def sensitivity_section(out: Path, found: Sequence[Sensitivity]) -> Part:
    """Section on the gains; writes `sensitivity.parquet` and the figures.

    Parameters
    ----------
    out : folder of the study
    found : one of each controller

    Returns
    -------
    section, sentences : the section, and what the summary says

    """
    write_sensitivities(out, found)
    sentences = sensitivity_sentences(found)
    blocks = [GAINS, *sentences, *_of_controllers(out, found)]
    return Section('sensitivity', 'Step 3: what a change of the gains does', blocks), sentences


def _of_controllers(out: Path, found: Sequence[Sensitivity]) -> Iterator[Block]:
    for of in found:
        if not of.refusal:
            yield sensitivity_plot(of, out / 'figures')
            yield sensitivity_table(found, of.controller)
    left_out = left_out_table(found)
    if left_out is not None:
        yield left_out


def claims_sentences(found: PaperClaims) -> list[Sentence]:
    """What a reader of the claims table must know of the scenario; nothing for a shipped one."""
    if found.reason:
        return [Sentence(f'The paper’s claims are not judged: {found.reason}.')]
    changes = [f'{path} = {ours} (shipped: {theirs})' for path, ours, theirs in found.departures]
    if not changes:
        return []
    text = 'The claims are judged on a changed scenario, either case with the same changes'
    return [Sentence(f'{text}: {"; ".join(changes)}.', 'table-claims')]


def write_samples(run: AnyRun, path: Path) -> Path:
    """Write a row for every sample, block by block.

    Parameters
    ----------
    run : of `simulate` or of a bag, of any length
    path : of the Parquet file; the columns of the run, and `xi.surge` and so on for xi,
        kinetic_energy (½ N_i xi_i² of (30), J), delta_xi (33), delta_pi (34)

    Returns
    -------
    path : the same

    """
    model = control_model(run.vehicle)
    writer: parquet.ParquetWriter | None = None
    try:
        for block in run.blocks():
            rows = _table(block, model)
            if writer is None:
                writer = parquet.ParquetWriter(path, rows.schema, compression='zstd')
            writer.write_table(rows)
    finally:
        if writer is not None:
            writer.close()
    return path


def _table(run: Run, model: ControlModel) -> pa.Table:
    Upsilon, inverse = model.Upsilon.reshape(6, 6), model.Upsilon_inv.reshape(6, 6)
    signals = {
        'kinetic_energy': kinetic_energy(inverse, model.N, run.nu),
        'xi': run.nu @ inverse.T,
        'delta_xi': delta_xi(inverse, run.nu),
        'delta_pi': delta_pi(Upsilon, run.tau),
    }
    columns = run.columns()
    for name, values in signals.items():
        columns |= {f'{name}.{dof}': values[:, i] for i, dof in enumerate(DOFS)}
    return pa.table(columns)
