"""The samples of a run with what is computed from them, energy over time included, as Parquet."""

from pathlib import Path

import pyarrow as pa
from pyarrow import parquet

from auv_analysis.coupling import delta_pi, delta_xi
from auv_analysis.energy import kinetic_energy
from auv_analysis.run import AnyRun, Run
from auv_dynamics.signals import DOFS
from auv_gvc_controller.model import ControlModel, control_model


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
