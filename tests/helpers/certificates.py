"""Certificates of arrays and of whole runs, without blocks: what the library's are held against."""

import numpy as np

from auv_analysis.metrics.certificate import LAWS, certificate, integral_of
from auv_analysis.metrics.lyapunov import summary_of
from auv_gvc_controller.laws.law import make_gains


def certificate_of(run, model):
    """The certificate at every sample; None without law, gains, z or F that it could be of."""
    z = integral_of(run)
    if run.law not in LAWS or not run.gains or z is None or run.disturbance is None:
        return None
    F, f, gains = run.disturbance, run.disturbance_estimate, make_gains(run.law, run.gains)
    return certificate(run.t, run.nu, run.nu_d, z, F, f, run.law, gains, model)


def lyapunov_summary(
    t, nu, nu_d, z, F, f, law, gains, model, *, kinds, sensors=False, actuators=False, sampled=False
):
    """Figures of the certificate of arrays as `certificate` takes them; None: not known."""
    found = []
    if law in LAWS and gains is not None:
        unknown = np.full(np.shape(nu), np.nan)
        z, known_F = unknown if z is None else z, unknown if F is None else F
        found = [certificate(t, nu, nu_d, z, known_F, f, law, gains, model)]
    return summary_of(
        lambda: iter(found), float(t[0]), law, gains, model, knows_F=F is not None, kinds=kinds,
        sensors=sensors, actuators=actuators, sampled=sampled,
    )  # fmt: skip
