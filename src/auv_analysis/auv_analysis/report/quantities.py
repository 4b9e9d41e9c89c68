"""Every quantity of the report in one line: its symbol, what it means, its unit, its equation."""

from typing import NamedTuple


class Quantity(NamedTuple):
    """One entry; `equation` is the paper's number, with the formula where it defines the symbol."""

    symbol: str
    meaning: str
    unit: str
    equation: str


QUANTITIES = (
    Quantity('η', 'position and ZYX Euler angles of the vehicle', 'm, rad, NED', '(2)'),
    Quantity('ν', 'velocity (u, v, w, p, q, r) of the vehicle', 'm/s, rad/s, body frame', '(1)'),
    Quantity('ν_d', 'velocity that is asked for, the set-point', 'm/s, rad/s', ''),
    Quantity('velocity error', 'what is missing to the set-point', 'm/s, rad/s', 'ν_d − ν, (17)'),
    Quantity('τ', 'forces and moments (X, Y, Z, K, M, N) of the actuators', 'N, N m', '(1)'),
    Quantity(
        'M',
        'inertia, of the rigid body and of the water that moves with it',
        'kg, kg m, kg m²',
        '(1)',
    ),
    Quantity('C, D, g', 'Coriolis, damping, and weight with buoyancy', 'N, N m', '(1)'),
    Quantity(
        'F',
        'lumped uncertainty: model errors and disturbances; positive F opposes τ',
        'N, N m',
        '(3)',
    ),
    Quantity('f', 'what the law believes F to be', 'N, N m', '(21)'),
    Quantity('w', 'error of that belief', 'N, N m', 'w = f − F, (22)'),
    Quantity(
        'Υ',
        'Upsilon, upper triangular with unit diagonal: it takes the coupled M apart',
        '',
        'M = Υ^-T N Υ^-1, (4)',
    ),
    Quantity('N', 'the inertia that each uncoupled component has', 'kg, kg m²', 'N = Υ^T M Υ, (9)'),
    Quantity(
        'ξ', 'generalised velocity components, in which M is diagonal', 'm/s, rad/s', 'ν = Υ ξ, (4)'
    ),
    Quantity('π', 'inputs in the same components', 'N, N m', 'π = Υ^T τ, (14)'),
    Quantity(
        'Δξ',
        'what the motion of other degrees of freedom adds to a velocity',
        'm/s, rad/s',
        'ξ − ν, (33)',
    ),
    Quantity(
        'Δπ', 'what the inputs of other degrees of freedom add to an input', 'N, N m', 'π − τ, (34)'
    ),
    Quantity('kinetic energy', 'of vehicle and added water', 'J', '½ ν^T M ν = Σ ½ N_i ξ_i², (30)'),
    Quantity('share', 'part of one component in the kinetic energy', '%', '½ N_i ξ_i² of (30)'),
    Quantity(
        's', 'velocity error with its integral, which the laws drive to zero', 'm/s, rad/s', '(19)'
    ),
    Quantity('z', 'integral of the velocity error', 'm, rad', '(17)'),
    Quantity(
        'k_D, k_I, Lambda, Gamma',
        'gains: of s, of z, of z in s, of the adaptation',
        '1/s, N/m, 1/s, 1/s²',
        '(16), (18), (21)',
    ),
    Quantity(
        'K_D, K_f',
        'gains of s and of its integral as they act in the body frame',
        'kg/s, kg/s²',
        'step 1',
    ),
    Quantity('L', 'function that certifies stability where it decreases', 'J', '(23)'),
)
