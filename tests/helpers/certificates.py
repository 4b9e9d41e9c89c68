"""Certificates of arrays and of whole runs, without blocks: what the library's are held against."""

from auv_analysis.metrics.certificate import LAWS, certificate, integral_of
from auv_analysis.metrics.lyapunov import lyapunov
from auv_analysis.runs.run import Run
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
    run = Run(
        vehicle=None, scenario='', controller='', law=law, step=0.01, source='', kinds=kinds,
        gains=gains._asdict() if gains and law in LAWS else {},
        hold='zoh' if sampled else 'continuous', t=t, eta=nu, nu=nu, nu_d=nu_d, nu_d_dot=nu_d,
        tau=nu, disturbance=F, disturbance_estimate=f, law_state=z,
        measured=nu if sensors else None, applied=nu if actuators else None,
    )  # fmt: skip
    return lyapunov(run, model)
