"""The body-frame gains that a law's gains amount to: step 1 of the paper's procedure."""

from typing import Any

import numpy as np

from auv_gvc_controller.laws.gvc import GVC
from auv_gvc_controller.model import ControlModel


def body_gains(gains: Any, model: ControlModel) -> tuple[np.ndarray, np.ndarray]:
    """K_D and K_f of tau = ... + K_D s + K_f integral(s).

    GVC: K_D = U^-T N k_D U^-1 and K_f = U^-T N Gamma U^-1; for scalar gains k M and Gamma M
    exactly. Any other law: its own k_D and Gamma, zero where it has none.

    Parameters
    ----------
    gains : named tuple of a law
    model : what the law knows of the vehicle

    Returns
    -------
    K_D, K_f : (6, 6) body frame

    """
    k_D, Gamma = (
        np.reshape(getattr(gains, name, np.zeros(36)), (6, 6)) for name in ('k_D', 'Gamma')
    )
    if not isinstance(gains, GVC):
        return k_D, Gamma
    U_inv, N = model.Upsilon_inv.reshape(6, 6), np.diag(model.N)
    return U_inv.T @ N @ k_D @ U_inv, U_inv.T @ N @ Gamma @ U_inv
