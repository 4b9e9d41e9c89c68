"""The laws gvc, cl, pid and smc in the notation of docs/model.md, all states of one in one x."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from reference_vehicle import Array, coriolis, damping, decompose, square

# A law of the article maps (nu, nu_d, nu_d_dot, z, sigma, C, D, g) to (tau, s, f); sigma integrates
# s, and s, sigma are in the law's own frame (xi for gvc, body for cl); tau, f in the body frame.
Law = Callable[..., tuple[Array, Array, Array]]

# Gains of a law: those that it needs, and the values of the others.
GAINS: dict[str, tuple[set[str], dict[str, float]]] = {
    'gvc': ({'k_D', 'k_I', 'Lambda', 'Gamma'}, {}),
    'cl': ({'k_D', 'k_I', 'Lambda', 'Gamma'}, {}),
    'pid': ({'k_P', 'k_I', 'k_D'}, {'omega_f': 20.0, 'k_FF': 1.0}),
    'smc': ({'k_D', 'Lambda', 'Gamma'}, {'k_S': 0.0, 'phi': 0.1}),
}


def make_law(M: Array, gains: dict[str, Any]) -> Law:
    """GVC (16)-(21) in the xi frame, or CL (29), with constant matrices built once."""
    k_d, k_i, lam, gam = (square(gains[key]) for key in ('k_D', 'k_I', 'Lambda', 'Gamma'))
    u, n = decompose(M)
    ut, u_inv = u.T, np.linalg.inv(u)
    ut_inv = u_inv.T
    n_k_d, n_gam, ut_k_i = n @ k_d, n @ gam, ut @ k_i

    def gvc(nu, nu_d, nu_d_dot, z, sigma, c, d, g):
        e = nu_d - nu  # (17)
        xi = u_inv @ nu  # (4)
        xi_r = u_inv @ (nu_d + lam @ z)  # (18)
        xi_r_dot = u_inv @ (nu_d_dot + lam @ e)  # (20)
        s_xi = xi_r - xi  # (19)
        f_xi = n_gam @ sigma  # (21), integrated
        model_xi = ut @ ((c + d) @ (u @ xi_r) + g)  # C_xi xi_r + D_xi xi_r + g_xi, (10)-(12)
        pi_xi = n @ xi_r_dot + model_xi + n_k_d @ s_xi + ut_k_i @ z + f_xi
        return ut_inv @ pi_xi, s_xi, ut_inv @ f_xi  # (16), (14), (13)

    def cl(nu, nu_d, nu_d_dot, z, sigma, c, d, g):
        e = nu_d - nu
        nu_r = nu_d + lam @ z
        nu_r_dot = nu_d_dot + lam @ e
        s = nu_r - nu
        f = gam @ sigma
        tau = M @ nu_r_dot + (c + d) @ nu_r + g + k_d @ s + k_i @ z + f  # (29)
        return tau, s, f

    return {'gvc': gvc, 'cl': cl}[gains['law']]


# A control law for sampling: at(nu, nu_d, nu_d_dot, g) gives answer(x) -> (tau, x_dot, f).
Answer = Callable[[Array], tuple[Array, Array, Array]]


def control_law(mats: dict[str, Any], entry: dict[str, Any]) -> tuple[int, Callable[..., Answer]]:
    """(size of x, at) of a controller's entry in a scenario; x starts at zero.

    x is (z, integral of s) for gvc and cl, (z, x) for pid, (z, integral of z, integral of s) for
    smc, whose elements integrate x_dot; f is what `disturbance_estimate` carries.
    """
    law, m = entry['law'], mats['M']
    needed, values = GAINS[law]
    given = set(entry) - {'law', 'anti_windup'}
    if not needed <= given <= needed | set(values):
        raise ValueError(
            f'{law} takes {sorted(needed)} and {sorted(values)}, found {sorted(given)}'
        )
    k = {
        key: square(value) for key, value in (values | entry).items() if key in given | set(values)
    }

    def of_the_article(nu, nu_d, nu_d_dot, g):
        c, d, e = coriolis(m, nu), damping(mats, nu), nu_d - nu

        def answer(x):
            tau, s, f = formula(nu, nu_d, nu_d_dot, x[:6], x[6:], c, d, g)
            return tau, np.concatenate((e, s)), f

        return answer

    def pid(nu, nu_d, nu_d_dot, g):
        e = nu_d - nu
        ahead = m @ nu_d_dot + coriolis(m, nu_d) @ nu_d + damping(mats, nu_d) @ nu_d
        known = g + k['k_FF'] @ ahead + k['k_P'] @ e

        def answer(x):
            d = k['omega_f'] @ (e - x[6:])
            return known + k['k_I'] @ x[:6] + k['k_D'] @ d, np.concatenate((e, d)), np.zeros(6)

        return answer

    def smc(nu, nu_d, nu_d_dot, g):
        e = nu_d - nu
        c_and_d = coriolis(m, nu) + damping(mats, nu)
        lam, lam2 = k['Lambda'], k['Lambda'] @ k['Lambda']

        def answer(x):
            z, zz, sigma = x[:6], x[6:12], x[12:]
            s = e + 2.0 * lam @ z + lam2 @ zz
            nu_r_dot = nu_d_dot + 2.0 * lam @ e + lam2 @ z
            switching = k['k_S'] @ np.clip(s / np.diag(k['phi']), -1.0, 1.0)
            f = k['Gamma'] @ sigma
            tau = m @ nu_r_dot + c_and_d @ (nu + s) + g + k['k_D'] @ s + switching + f
            return tau, np.concatenate((e, z, s)), f

        return answer

    if law in ('gvc', 'cl'):
        formula = make_law(m, entry)
        return 12, of_the_article
    return {'pid': (12, pid), 'smc': (18, smc)}[law]
