"""The Lyapunov certificate as metrics of a run: whether it applies, and its values."""

from collections.abc import Collection
from typing import Any

import numpy as np

from auv_analysis.metrics.certificate import (
    FIGURES,
    LAWS,
    ROUNDING,
    SHARES,
    Form,
    as_figures,
    certificate_blocks,
    form_of,
    why_unknown,
)
from auv_analysis.runs.run import Run
from auv_gvc_controller.laws.law import make_gains
from auv_gvc_controller.laws.model import ControlModel

OF_THE_MOTION = ('model_error', 'current')  # kinds of disturbance whose F depends on the motion


def applicability(law: str, gains: Any, model: ControlModel) -> str:
    """Why a law with its gains, None where not known, has no certificate; '' when it has one."""
    if law not in LAWS:
        return f'no certificate of the law {law} is known: (23) to (28) are those of gvc and cl'
    if gains is None:
        return 'the gains are not known'
    form = form_of(law, gains, model)
    return _no_identity(form) or _no_decrease(law, form)


def _no_identity(form: Form) -> str:
    """Why L is not positive definite, or (26) not its derivative."""
    for name in ('k_I', 'Lambda', 'Gamma'):
        matrix = getattr(form, name)
        if not _symmetric(matrix):
            return f'{name} is not symmetric: (26) is not L_dot'
        if name != 'Lambda' and not _positive(matrix):
            return f'{name} is not positive definite, nor is L of (23)'
    if not _symmetric(form.G):
        return 'Gamma is not diagonal and couples axes of different N: (26) is not L_dot'
    return ''


def _no_decrease(law: str, form: Form) -> str:
    """Why (26) may be positive even where F is constant."""
    k_D = 'k_D' if law == 'cl' else 'N k_D'
    for name, matrix in ((k_D, form.B), ('Lambda k_I', form.Lambda @ form.k_I)):
        if not _positive(matrix):
            return f'the symmetric part of {name} is not positive definite: (27) may fail for any F'
    return ''


def lyapunov(run: Run, model: ControlModel) -> dict[str, Any]:
    """Figures of the certificate of a run, ready for JSON.

    Parameters
    ----------
    run : of `simulate`, `load_run` or `open_bag`
    model : what the law knows of the vehicle

    Returns
    -------
    summary : None is what is not known
        applicable, reason : whether the certificate holds of this run, and if not, why
        identity_residual : max abs(L_dot - (26)) / max abs((26)), L_dot being the measured one
        identity_residual_rms : the same of root mean squares
        identity_residual_after_2s : the first, of the samples after the transient alone
        share_of_time_increasing : share of samples with (26) > 0; this and the next two are None
            where (26) is not the derivative of L
        share_condition_27 : share of samples where (27) holds
        share_bound_28 : share of samples with L_dot <= (28) + 1e-6 max abs((26))
        sup_s, sup_z, sup_w : largest Euclidean norms
        L_first, L_last : J
        rho_max : W
        sampled : zero-order hold; the residual then also has what sampling does, of the first
            order in the step

    """
    gains = make_gains(run.law, run.gains) if run.gains else None
    sensing = run.sensing or 'measured' in run.unrecorded
    acting = run.acting or 'applied' in run.unrecorded
    whole = run.knows_wrench and run.knows_setpoint and not run.unknown
    reasons = [
        applicability(run.law, gains, model),
        _against_15(run.knows_disturbance, run.kinds),
        'the law does not see the true velocity, so that (26) is not L_dot' if sensing else '',
        '' if whole else 'not all velocities, the wrench and the set-point were recorded',
        why_unknown(run),
        'the run has gaps, across which nothing has a rate' if run.gaps else '',
        'the wrench applied is not that of the law, so that (26) is not L_dot' if acting else '',
    ]
    reason = '; '.join(filter(None, reasons))
    summary = {'applicable': not reason, 'reason': reason, **dict.fromkeys(FIGURES)}
    if run.law in LAWS and gains is not None and not run.gaps and whole:
        summary |= as_figures(lambda: certificate_blocks(run, model), run.start)
        if sensing or acting or _no_identity(form_of(run.law, gains, model)):
            summary |= dict.fromkeys(SHARES)
    return summary | {'sampled': run.hold == 'zoh'}


def _against_15(known: bool, kinds: Collection[str] | None) -> str:
    """Why F may not be the bounded function of time that (15) takes it for."""
    if not known:
        return 'F is not known'
    if kinds is None:
        return 'what F consists of is not known: (15) cannot be assumed'
    errors = ' and '.join(kind for kind in OF_THE_MOTION if kind in kinds)
    if not errors:
        return ''
    return (
        f'F contains {errors} and so depends on the motion, nu_dot included: (15) cannot be '
        'assumed and no bound follows a priori, though (26) holds along solutions with that F'
    )


def _symmetric(matrix: np.ndarray) -> bool:
    return bool(np.abs(matrix - matrix.T).max() <= ROUNDING * np.abs(matrix).max())


def _positive(matrix: np.ndarray) -> bool:
    """Whether the symmetric part is positive definite."""
    values = np.linalg.eigvalsh((matrix + matrix.T) / 2)
    return bool(values[0] > ROUNDING * np.abs(values).max())
