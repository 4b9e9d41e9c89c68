"""A linear model with the names of its states, inputs and outputs, and the point it holds at."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from auv_dynamics.signals import DOFS


def names(*groups: str) -> tuple[str, ...]:
    """Names of groups of six: 'nu[surge]', ...; python-control takes no dots in them."""
    return tuple(f'{group}[{dof}]' for group in groups for dof in DOFS)


def state_names(m: int) -> tuple[str, ...]:
    """phi, theta, nu and the m states of a law: 'law1[surge]' of the first block of six, ..."""
    own = [f'law{1 + i // 6}[{DOFS[i % 6]}]' if m % 6 == 0 else f'law[{i + 1}]' for i in range(m)]
    return ('phi', 'theta', *names('nu'), *own)


def relative(error: np.ndarray, values: np.ndarray) -> float:
    """Largest error relative to the largest entry of its row."""
    largest = np.abs(values).max(axis=1, keepdims=True)
    return float(np.max(error / np.where(largest > 0, largest, 1.0), initial=0.0))


@dataclass(frozen=True, eq=False, repr=False)
class Linearization:
    """x_dot = A x + B u, y = C x + D u about a point; unpacks as A, B, C, D.

    Attributes
    ----------
    A, B, C, D : (n, n), (n, k), (p, n), (p, k) in SI units
    states, inputs, outputs : names, such as 'phi', 'nu[surge]', 'law1[yaw]', 'tau[yaw]'
    x0, u0, y0 : (n,), (k,), (p,) the point
    drift : (n,) x_dot there; zero where the point is at rest, which a vehicle that turns while it
        is inclined is not
    error : largest error of a derivative of the law, relative to the largest entry of its row

    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    x0: np.ndarray
    u0: np.ndarray
    y0: np.ndarray
    drift: np.ndarray
    error: float

    def __iter__(self) -> Iterator[np.ndarray]:
        """A, B, C, D, so that `control.ss(*linearize(...))` works."""
        return iter((self.A, self.B, self.C, self.D))

    def __repr__(self) -> str:
        """Sizes, names and poles, in a few lines; the matrices are A, B, C and D."""
        groups = (
            ', '.join(dict.fromkeys(name.partition('[')[0] for name in named))
            for named in (self.states, self.inputs, self.outputs)
        )
        states, inputs, outputs = groups
        poles = np.sort_complex(np.linalg.eigvals(self.A))[::-1]
        shown = ', '.join(_number(pole) for pole in poles if pole.imag >= 0)
        return (
            f'<Linearization: A {self.A.shape}, B {self.B.shape}, C {self.C.shape}'
            f'\n states: {states}; inputs: {inputs}; outputs: {outputs}'
            f'\n poles, 1/s: {shown}>'
        )

    def __len__(self) -> int:
        """Four."""
        return 4

    def selected(self, inputs: Sequence[str], outputs: Sequence[str]) -> 'Linearization':
        """The same model with some groups of six of its inputs and outputs; ValueError: no such."""
        columns = _places(self.inputs, inputs, 'inputs')
        rows = _places(self.outputs, outputs, 'outputs')
        return replace(
            self,
            B=self.B[:, columns],
            C=self.C[rows],
            D=self.D[np.ix_(rows, columns)],
            inputs=tuple(self.inputs[i] for i in columns),
            outputs=tuple(self.outputs[i] for i in rows),
            u0=self.u0[columns],
            y0=self.y0[rows],
        )


def _number(pole: complex) -> str:
    real = f'{round(pole.real, 9) + 0.0:.4g}'
    return f'{real} ± {pole.imag:.4g}i' if pole.imag > 1e-9 else real


def _places(named: Sequence[str], groups: Sequence[str], what: str) -> list[int]:
    known = list(dict.fromkeys(name.partition('[')[0] for name in named))
    chosen = [groups] if isinstance(groups, str) else groups
    for group in chosen:
        if group not in known:
            raise ValueError(f'{what}: expected some of {", ".join(known)}, found {group!r}')
    return [6 * known.index(group) + i for group in chosen for i in range(6)]
