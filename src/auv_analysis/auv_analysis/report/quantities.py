"""Every quantity of the report: its symbol, how that is set, its meaning, unit and equation."""

import re
from itertools import chain, zip_longest
from typing import NamedTuple

from markupsafe import Markup, escape

LETTERS = {'Lambda': 'Λ', 'Gamma': 'Γ', 'lambda': 'λ', 'omega': 'ω', 'phi': 'φ'}
GAINS = ('k_D', 'k_I', 'k_P', 'k_S', 'K_D', 'K_f', 'Lambda', 'Gamma', 'omega_f', 'phi')
_LETTER = re.compile(rf'(?<![^\W_])({"|".join(LETTERS)})(?![^\W_])')
_INDEX = re.compile(r'\b(Δ?[A-Za-zτξπωνΓΛΥλ])_([A-Za-z0-9]{1,3})\b')
_POWER = re.compile(r'\^([-−]?[A-Za-z0-9]+(?:/\d)?)')
_NUMBERED = re.compile(r'(?<=[ξπ])([1-6])\b')


class Maths(str):
    """Words of ours whose symbols a page sets: w_X, k_D, ξ3, M^-1, Lambda.

    Every other text is a user's, or may be, and is shown as it stands.

    Parameters
    ----------
    words : ours; each `{}` stands for the next field
    fields : of users, shown as they stand, or `Maths` again

    """

    __slots__ = ('parts',)
    parts: tuple[str, ...]  # words and fields in turn

    def __new__(cls, words: str, *fields: str) -> 'Maths':
        """Words with fields as a text in which the symbols are ASCII."""
        pieces = zip_longest(words.split('{}'), fields, fillvalue='')
        parts = tuple(chain.from_iterable(pieces))
        found = super().__new__(cls, ''.join(parts))
        found.parts = parts
        return found

    def html(self) -> Markup:
        """The text with indices lowered, powers raised, and Greek letters for their names."""
        fields = (
            part.html() if isinstance(part, Maths) else escape(part) for part in self.parts[1::2]
        )
        words = map(_set, self.parts[::2])
        return Markup('').join(chain.from_iterable(zip(words, fields, strict=True)))


def _set(words: str) -> Markup:
    text = _LETTER.sub(lambda match: LETTERS[match[0]], str(escape(words)))
    text = _INDEX.sub(r'\1<sub>\2</sub>', text)
    text = _POWER.sub(lambda match: f'<sup>{match[1].replace("-", "−")}</sup>', text)
    return Markup(_NUMBERED.sub(r'<sub>\1</sub>', text))


def symbol(gain: str) -> str:
    """A gain's name, to be set where it is one of ours; that of a user's law stays as it stands."""
    return Maths(gain) if gain in GAINS else gain


def mathtext(gain: str) -> str:
    """The same for a figure."""
    if gain not in GAINS:
        return gain
    head, _, tail = gain.partition('_')
    head = rf'\{head}' if head in LETTERS else head
    return f'${head}_{{{tail}}}$' if tail else f'${head}$'


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
