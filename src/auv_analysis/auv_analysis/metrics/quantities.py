"""Registry of quantities: symbol, unit, label, equation of the paper, meaning in one line.

A unit stands here and nowhere else. Keys are those of `summary.json`, of columns and of JSON
documents, so that `quantity('velocity_error.rms.surge')` describes the column of that name.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from auv_analysis.metrics.settling import SETTLED, TRANSIENT
from auv_analysis.output.text import GAINS
from auv_dynamics.vehicle import DOFS

VELOCITY, WRENCH = ('m/s', 'rad/s'), ('N', 'N m')
HALVES = {'linear': DOFS[:3], 'angular': DOFS[3:]}


@dataclass(frozen=True)
class Quantity:
    """A quantity: symbol, unit, label, equation and meaning.

    Attributes
    ----------
    symbol : of the literature, ASCII indices, such as 'w_X'; '' where there is none
    unit : '' of a ratio or a word; of six components 'm/s, rad/s': linear, then angular
    label : short, for heads and axes
    equation : number in the paper, with the formula where it defines the symbol
    meaning : one line for a reader without the paper
    components : of six components: their symbols

    """

    symbol: str
    unit: str
    label: str
    equation: str = ''
    meaning: str = ''
    components: tuple[str, ...] = ()

    @property
    def units(self) -> tuple[str, str]:
        """Units of the linear and of the angular components."""
        first, _, second = self.unit.partition(', ')
        return first, second or first

    def unit_of(self, component: int | str) -> str:
        """Unit of a component by its index or its degree of freedom."""
        index = DOFS.index(component) if isinstance(component, str) else component
        return self.units[index // 3]

    def of(self, part: str) -> 'Quantity':
        """The quantity of one degree of freedom, or of the 'linear' or 'angular' half."""
        first = DOFS.index(part) if part in DOFS else 3 * (part == 'angular')
        symbol = self.components[first] if part in DOFS and self.components else self.symbol
        label = f'{self.label}, {part}'
        return replace(self, symbol=symbol, unit=self.units[first // 3], label=label, components=())

    def axis(self, components: Sequence[int]) -> str:
        """Axis label: the symbols of some components of one half, in mathtext, with their unit."""
        symbols = ', '.join(mathtext(self.components[i]) for i in components)
        return f'{symbols} ({self.unit_of(components[0])})'


LETTERS = {'Δ': r'\Delta ', 'ξ': r'\xi', 'π': r'\pi', 'τ': r'\tau', 'ν': r'\nu', 'η': r'\eta'}
LETTERS |= {name: f'\\{name}' for name in ('Lambda', 'Gamma', 'omega', 'phi')}


def mathtext(symbol: str) -> str:
    """A symbol, such as 'Δξ_1' or 'k_D', for a plot."""
    head, _, index = symbol.partition('_')
    for letter, command in LETTERS.items():
        head = head.replace(letter, command)
    return f'${head}_{{{index}}}$' if index else f'${head}$'


def gain_mathtext(gain: str) -> str:
    """A gain's name for a plot; that of a user's law stays as it stands."""
    return mathtext(gain) if gain in GAINS else gain


def _six(symbol: str, indices: str) -> tuple[str, ...]:
    return tuple(f'{symbol}{index}' for index in indices)


_VELOCITY, _WRENCH, _AXES = ', '.join(VELOCITY), ', '.join(WRENCH), 'XYZKMN'
_ENERGY_SHARE = 'share of a component of the decomposition in the mean kinetic energy'

SIGNALS = {
    'eta': Quantity('η', 'm, rad', 'pose', '(2)', 'position and ZYX Euler angles, NED'),
    'nu': Quantity(
        'ν', _VELOCITY, 'velocity', '(1)', 'velocity of the vehicle, body frame', (*'uvwpqr',)
    ),
    'nu_d': Quantity('ν_d', _VELOCITY, 'set-point', '', 'velocity set-point'),
    'error': Quantity(
        'ν_d − ν', _VELOCITY, 'velocity error', '(17)', 'set-point minus velocity',
        _six('Δ', 'uvwpqr'),
    ),
    'tau': Quantity(
        'τ', _WRENCH, 'input', '(1)', 'wrench of the actuators: the input', _six('τ_', _AXES)
    ),
    'applied': Quantity('τ', _WRENCH, 'applied wrench', '', 'wrench that the actuators delivered'),
    'M': Quantity('M', 'kg, kg m, kg m²', 'inertia', '(1)', 'rigid-body inertia and added mass'),
    'dynamics': Quantity(
        'C, D, g', _WRENCH, 'C, D, g', '(1)', 'Coriolis, damping and restoring forces'
    ),
    'F': Quantity(
        'F', _WRENCH, 'lumped uncertainty', '(3)',
        'lumped uncertainty: model errors and disturbances; positive F opposes τ',
        _six('F_', _AXES),
    ),
    'unexplained': Quantity('F', _WRENCH, 'unexplained wrench', '(1)', 'F by inverse dynamics'),
    'required_wrench': Quantity(
        'τ', _WRENCH, 'required wrench', '(1)', 'M ν̇ + C ν + D ν + g, τ − F of the motion',
    ),
    'f': Quantity('f', _WRENCH, 'estimate of F', '(21)', 'estimate of F by the adaptive term'),
    'lumped_error': Quantity(
        'w', _WRENCH, 'lumped estimation error', 'w = f − F, (22)', 'estimation error of F',
        _six('w_', _AXES),
    ),
    'Upsilon': Quantity(
        'Υ', '', 'Upsilon', 'M = Υ^-T N Υ^-1, (4)',
        'upper triangular with unit diagonal: it diagonalises M',
    ),
    'N': Quantity(
        'N', 'kg, kg m²', 'N', 'N = Υ^T M Υ, (9)', 'inertia of each decoupled component'
    ),
    'xi': Quantity(
        'ξ', _VELOCITY, 'GVC', 'ν = Υ ξ, (4)', 'generalised velocity components: M is diagonal'
    ),
    'pi': Quantity('π', _WRENCH, 'quasi-inputs', 'π = Υ^T τ, (14)', 'inputs in these components'),
    'delta_xi': Quantity(
        'Δξ', _VELOCITY, 'velocity deformation', 'ξ − ν, (33)',
        'what the other degrees of freedom add to a velocity component', _six('Δξ_', '123456'),
    ),
    'delta_pi': Quantity(
        'Δπ', _WRENCH, 'input deformation', 'π − τ, (34)',
        'what the other degrees of freedom add to an input', _six('Δπ_', '123456'),
    ),
    'kinetic_energy': Quantity(
        '', 'J', 'kinetic energy', '½ ν^T M ν = Σ ½ N_i ξ_i², (30)', 'of vehicle and added mass'
    ),
    'energy': Quantity(
        'ξ', 'J', 'energy of ξ', '½ N_i ξ_i², (30)', 'kinetic energy of a component'
    ),
    'share': Quantity('', '%', 'share', '½ N_i ξ_i² of (30)', _ENERGY_SHARE),
    's': Quantity('s', _VELOCITY, 's', '(19)', 'sliding variable: Λ z plus the velocity error'),
    'z': Quantity('z', 'm, rad', 'z', '(17)', 'integral of the velocity error'),
    'gains': Quantity(
        'k_D, k_I, Lambda, Gamma', '1/s, N/m, 1/s, 1/s²', 'gains', '(16), (18), (21)',
        'gains of s, of z, of z in s, of the adaptation',
    ),
    'body_gains': Quantity(
        'K_D, K_f', 'kg/s, kg/s²', 'gains in the body frame', 'step 1',
        'gains of s and of its integral as they act in the body frame',
    ),
    'L': Quantity('L', 'J', 'L', '(23)', 'Lyapunov function'),
    'L_dot': Quantity('dL/dt', 'W', 'dL/dt', '(26)', 'derivative of the Lyapunov function'),
}  # fmt: skip

METRICS = {  # of a run: keys of `summary.json`
    'kinetic_energy.mean': Quantity(
        '', 'J', 'kinetic energy', '(30)', 'mean kinetic energy ½ νᵀ M ν over its window'
    ),
    'kinetic_energy.mean_by_component': Quantity(
        '', 'J', 'energy', '(30)', 'mean kinetic energy of a component, ½ N_i ξ_i²'
    ),
    'kinetic_energy.shares_percent': Quantity('', '%', 'energy share', '(30)', _ENERGY_SHARE),
    'velocity_error.rms': Quantity(
        '', _VELOCITY, 'RMS error', '(17)',
        'root mean square of set-point minus velocity over the whole run',
    ),
    'velocity_error.max_after_2s': Quantity(
        '', _VELOCITY, f'error after {TRANSIENT:g} s', '(17)',
        f'largest magnitude of the velocity error after the first {TRANSIENT:g} s',
    ),
    'velocity_error.settling_time': Quantity(
        '', 's', 'settled', '', f'time from which the velocity error stays within {SETTLED}'
    ),
    'lumped_error.rms': Quantity(
        '', _WRENCH, 'RMS w', '(22)',
        'root mean square of the estimation error w = f − F of the uncertainty',
    ),
    'lumped_error.max_after_2s': Quantity(
        '', _WRENCH, f'w after {TRANSIENT:g} s', '(22)',
        f'largest magnitude of the estimation error w = f − F after {TRANSIENT:g} s',
    ),
    'coupling.delta_xi_max': Quantity(
        'Δξ', _VELOCITY, 'Δξ', '(33)',
        'largest magnitude of ξ − ν: what inertial coupling adds to a velocity',
        _six('Δξ_', '123456'),
    ),
    'coupling.delta_pi_max': Quantity(
        'Δπ', _WRENCH, 'Δπ', '(34)',
        'largest magnitude of π − τ: what inertial coupling adds to an input',
        _six('Δπ_', '123456'),
    ),
    'effort.rms': Quantity(
        '', _WRENCH, 'RMS input', '', 'root mean square of the commanded input τ'
    ),
    'effort.max': Quantity('', _WRENCH, 'peak input', '', 'largest magnitude of the input τ'),
}  # fmt: skip

COSTS = {  # of a closed loop: keys of `tune.json`
    'weighted_error': Quantity(
        '', 'J', 'time-weighted error', '',
        'mean of ½ Δνᵀ M Δν, the kinetic energy of the velocity error, weighted by the time since '
        'the start (ITSE)',
    ),
    'error': Quantity('', 'J', 'error', '', 'the same without the weight (ISE)'),
    'effort': Quantity(
        '', 'J/s²', 'effort', '',
        'mean of ½ τᵀ M⁻¹ τ: the kinetic energy that the wrench alone would give the vehicle from '
        'rest in a second',
    ),
    'late_error': Quantity(
        '', 'J', f'error after {TRANSIENT:g} s', '', 'largest ½ Δνᵀ M Δν from then on'
    ),
    'peak_effort': Quantity('', 'J/s²', 'peak effort', '', 'largest ½ τᵀ M⁻¹ τ'),
    'settling': Quantity(
        '', 's', 'settled', '', f'time from which every error stays within {SETTLED}'
    ),
}  # fmt: skip


def quantity(name: str) -> Quantity:
    """Quantity of a column: of a metric, of one of its degrees of freedom or of one half of them.

    Parameters
    ----------
    name : 'velocity_error.rms', 'velocity_error.rms.surge', 'overall.effort.max.linear'

    Returns
    -------
    quantity : of another name one without unit, labelled by the name

    """
    if name in METRICS:
        return METRICS[name]
    family, _, part = name.removeprefix('overall.').rpartition('.')
    if family in METRICS and (part in DOFS or part in HALVES):
        return METRICS[family].of(part)
    return Quantity('', '', name)
