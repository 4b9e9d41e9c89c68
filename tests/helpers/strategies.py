"""Hypothesis strategies of physical vehicles, states and gains, as the files give them.

Each is made once: to make one anew, and to see that it is valid, takes as long as to draw from it.
"""

import os
from functools import cache
from typing import Any

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from auv_dynamics.files.yaml_files import matrix6
from auv_dynamics.vehicle import DOFS


def examples(count: int, **options: Any) -> settings:
    """So many examples of a property in `make test`, as many as it is told in `make properties`."""
    return settings(max_examples=int(os.environ.get('AUV_GVC_EXAMPLES', count)), **options)


QUICK = examples(10)


@cache
def vectors(n: int = 6, largest: float = 3.0) -> st.SearchStrategy[np.ndarray]:
    """(n,) finite numbers within +-largest."""
    elements = st.floats(-largest, largest, allow_subnormal=False)
    return arrays(float, n, elements=elements, fill=st.nothing())  # each entry its own


@cache
def _dense(n: int, largest: float) -> st.SearchStrategy[np.ndarray]:
    """(n, n) numbers within +-largest, zeros and +-largest among them, all by one draw.

    Entries drawn one by one take most of the time of a test.
    """

    def entries(seed: int) -> np.ndarray:
        rng = np.random.default_rng(seed)
        edges = rng.choice([-largest, 0.0, largest], (n, n))
        return np.where(rng.random((n, n)) < 0.1, edges, rng.uniform(-largest, largest, (n, n)))

    return st.integers(0, 2**32 - 1).map(entries)


@cache
def attitudes(pitch: float = 1.3) -> st.SearchStrategy[np.ndarray]:
    """(6,) eta with theta within +-pitch."""
    parts = (st.floats(-50, 50), st.floats(-50, 50), st.floats(-50, 50))
    angles = (st.floats(-3.1, 3.1), st.floats(-pitch, pitch), st.floats(-3.1, 3.1))
    return st.tuples(*parts, *angles).map(np.array)


@cache
def _signed(smallest: float, largest: float) -> st.SearchStrategy[float]:
    return st.builds(
        lambda size, sign: size * sign, st.floats(smallest, largest), st.sampled_from((-1.0, 1.0))
    )


@cache
@st.composite
def positive_definite(draw: st.DrawFn, n: int = 6) -> np.ndarray:
    """(n, n) dense, symmetric, eigenvalues from 0.1 to a few."""
    A = draw(_dense(n, 1.0))
    P = 0.1 * np.eye(n) + A @ A.T / n
    return (P + P.T) / 2


@st.composite
def inertias(draw: st.DrawFn, mass: float) -> np.ndarray:
    """(3, 3) tensor about the centre of gravity: that of some distribution of mass."""
    second_moments = mass * 0.1 * draw(positive_definite(3))
    return np.trace(second_moments) * np.eye(3) - second_moments


@st.composite
def vehicles(draw: st.DrawFn, heavy_water: bool | None = None) -> dict[str, Any]:
    """Contents of a vehicle file: dense M_A, often far above M_RB, and CG off in all axes.

    Damping and lift, where there is any, may be asymmetric and only take energy.

    Parameters
    ----------
    draw : given by Hypothesis
    heavy_water : M_A twenty times the size of M_RB; None: drawn

    """
    mass = draw(st.floats(5.0, 3000.0))
    heavy = draw(st.booleans()) if heavy_water is None else heavy_water
    length = np.array([1.0, 1.0, 1.0, 0.4, 0.4, 0.4])
    added = mass * (20.0 if heavy else 0.5) * np.outer(length, length) * draw(positive_definite())
    linear = mass * draw(positive_definite())
    twist = draw(_dense(6, 0.1))
    linear = linear + mass * (twist - twist.T)  # damping may be asymmetric
    quadratic = mass * np.diag(np.abs(draw(vectors())))
    sign = draw(st.sampled_from(('positive', 'sname')))
    factor = {'positive': 1.0, 'sname': -1.0}[sign]
    lift = {}
    if (seed := int(1e6 * mass)) % 2:  # half of them, without a draw: the rest stays as hard
        arms = 0.3 * mass * np.random.default_rng(seed).uniform(-1, 1, (6, 6))
        lift['lift'] = (factor * (arms - arms.T + np.diag(np.abs(np.diagonal(arms))))).tolist()
    return {
        'format': 1,
        'name': 'random',
        'source': 'drawn by Hypothesis',
        'rigid_body': {
            'mass': mass,
            'center_of_gravity': [draw(_signed(0.01, 0.3)) for _ in range(3)],
            'inertia': draw(inertias(mass)).tolist(),
            'inertia_reference': 'cg',
        },
        'hydrostatics': {
            'volume': mass * draw(st.floats(0.9, 1.1)) / 1025.0,
            'center_of_buoyancy': draw(vectors(3, 0.2)).tolist(),
        },
        'added_mass': (factor * added).tolist(),
        'damping': {
            'linear': (factor * linear).tolist(),
            'quadratic': (factor * quadratic).tolist(),
        },
        **lift,
        'environment': {'water_density': 1025.0, 'gravity': 9.81},
        'sign': sign,
    }


_scalar = st.floats(0.1, 2.0)
FORMS = st.one_of(_scalar, st.lists(_scalar, min_size=6, max_size=6), positive_definite())


@cache
@st.composite
def gains(draw: st.DrawFn) -> dict[str, Any]:
    """k_D, k_I, Lambda, Gamma: each a number, six numbers or a symmetric 6x6 matrix."""
    sizes = {'k_D': 10.0, 'k_I': 1.0, 'Lambda': 1.0, 'Gamma': 50.0}
    one = {}
    for name, size in sizes.items():
        form = draw(FORMS)
        one[name] = (size * np.asarray(form)).tolist()
    return one


def full(value: Any) -> np.ndarray:
    """(6, 6) of a gain or coefficient as a file gives it."""
    return matrix6(value)


# harmonic signals as a scenario has them, and an example
NUMBERS = st.floats(-5.0, 5.0, allow_subnormal=False)
TERMS = st.fixed_dictionaries(
    {'amplitude': NUMBERS, 'omega': NUMBERS}, optional={'phase': NUMBERS}
)  # fmt: skip
ENTRIES = st.fixed_dictionaries(
    {}, optional={'offset': NUMBERS, 'terms': st.lists(TERMS, max_size=3)}
)
SPECS = st.dictionaries(st.sampled_from(DOFS), ENTRIES)
WORKED = {
    'surge': {'offset': 0.2, 'terms': [{'amplitude': 1.0, 'omega': np.pi / 20}]},
    'heave': {'terms': [{'amplitude': 1.5, 'omega': 0.4, 'phase': np.pi / 2},
                        {'amplitude': -0.5, 'omega': 2.0}]},
    'yaw': {'offset': -0.1},
}  # fmt: skip
