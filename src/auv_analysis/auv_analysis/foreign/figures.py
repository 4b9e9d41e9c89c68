"""What summary.json says of gaps and of the wrench that the model leaves unexplained."""

from typing import Any

import numpy as np

from auv_analysis.runs.run import AnyRun, Facts, LongRun


def gap_figures(run: Facts) -> dict[str, Any]:
    """Share of the run's length that has samples, and where there are none."""
    spans = [{'window': list(span)} for span in run.gaps]
    return {'valid_share': run.valid_share, 'spans': spans}


def unexplained_figures(run: AnyRun) -> dict[str, list[float]] | None:
    """Figures of F as estimated from measurements, N and N m; None where it is not."""
    if isinstance(run, LongRun) or run.unexplained is None or run.unexplained_error is None:
        return None
    F, error = run.unexplained, run.unexplained_error
    found = {
        'mean': F.mean(axis=0),
        'rms': np.sqrt((F**2).mean(axis=0)),
        'max': np.abs(F).max(axis=0),
        'error_rms': np.sqrt((error**2).mean(axis=0)),
    }
    return {name: values.tolist() for name, values in found.items()}
