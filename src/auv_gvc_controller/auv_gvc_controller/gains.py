"""The body-frame gains that a law's gains amount to: step 1 of the paper's procedure."""

from typing import Any

import numpy as np

from auv_gvc_controller.model import ControlModel


def body_gains(gains: Any, model: ControlModel) -> tuple[np.ndarray, np.ndarray]:
    """K_D and K_f of tau = ... + K_D s + K_f integral(s).

    A law says it in a static method `body_gains(gains, model)`; one without it is taken by its own
    k_D and Gamma, zero where it has none.

    Parameters
    ----------
    gains : named tuple of a law
    model : what the law knows of the vehicle

    Returns
    -------
    K_D, K_f : (6, 6) body frame; of GVC k M and Gamma M exactly where the gains are scalar

    """
    law = type(gains)
    if hasattr(law, 'body_gains'):
        K_D, K_f = law.body_gains(gains, model)
    else:
        K_D, K_f = (getattr(gains, name, np.zeros(36)) for name in ('k_D', 'Gamma'))
    return np.reshape(K_D, (6, 6)), np.reshape(K_f, (6, 6))
