"""Vehicle file, format 1: read, check and turn into a `Vehicle`."""

from pathlib import Path
from typing import Any

import numpy as np

from auv_dynamics.files.errors import InputError
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import check, matrix6, read_yaml
from auv_dynamics.vehicle.thrusters import Thrusters, thrusters_of
from auv_dynamics.vehicle.vehicle import Vehicle, rigid_body_matrix, skew

SCHEMA = Path(__file__).with_name('vehicle.schema.json')
ASYMMETRY = 1e-3  # largest tolerated, relative to the matrix's largest entry
ABSURD = 300.0  # times: weight and buoyancy of no vehicle are so far apart, a wrong unit is 1000
LIGHTEST = 10.0  # kg/m3 of water
LONGEST = 8.0  # of lengths, in edges of a cube of the vehicle's volume: a slender hull has 2
ROUNDING = 1e-9  # relative, below which a negative eigenvalue counts as zero


def load_vehicle(vehicle: str | Path) -> Vehicle:
    """Vehicle of a file or of a shipped bare name.

    Parameters
    ----------
    vehicle : path of a vehicle file, or a bare name such as 'herman2018'

    Returns
    -------
    vehicle : Vehicle; `vehicle.warnings` holds what is odd but usable

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    path = shipped('vehicles', vehicle)
    return vehicle_from_dict(read_yaml(path, 'vehicle'), path)


def vehicle_from_dict(data: dict[str, Any], file: object) -> Vehicle:
    """Vehicle of the contents of a vehicle file; `file` is named in errors."""
    check(data, SCHEMA, file)
    source = _Source(data, file)
    body = data['rigid_body']
    mass, r_G = float(body['mass']), np.array(body['center_of_gravity'], float)
    M_RB = M_A = None
    if 'inertia_matrix' in data:
        M = source.inertia_matrix()
    else:
        M_RB, M_A = source.rigid_body(mass, r_G), source.added_mass()
        M = M_RB + M_A
    source.check_positive_definite(M)
    environment, water = data['environment'], data['hydrostatics']
    source.check_units(mass, water['volume'], environment['water_density'])
    weight = mass * environment['gravity']
    buoyancy = environment['water_density'] * environment['gravity'] * water['volume']
    D_linear, D_quadratic = source.damping()
    lift = source.lift()
    source.warn_buoyancy(weight, buoyancy)
    thrusters = source.thrusters()
    return Vehicle(
        name=data['name'],
        source=data.get('source', ''),
        M=M,
        D_linear=D_linear,
        D_quadratic=D_quadratic,
        weight=weight,
        buoyancy=buoyancy,
        r_G=r_G,
        r_B=np.array(water['center_of_buoyancy'], float),
        M_RB=M_RB,
        M_A=M_A,
        lift=lift,
        warnings=tuple(source.warnings),
        thrusters=thrusters,
    )


def is_symmetric(A: np.ndarray) -> Any:
    """Whether matrices (..., n, n) are symmetric but for a tolerated share."""
    difference = np.abs(A - np.swapaxes(A, -2, -1)).max(axis=(-2, -1))
    return difference <= ASYMMETRY * np.abs(A).max(axis=(-2, -1))


def is_definite(M: np.ndarray) -> Any:
    """Whether symmetric matrices (..., n, n) are positive definite, and can be inverted."""
    eigenvalues = np.linalg.eigvalsh(M)
    return eigenvalues[..., 0] > np.finfo(float).eps * eigenvalues[..., -1]


def is_semidefinite(A: np.ndarray) -> Any:
    """Whether symmetric matrices (..., n, n) are positive semidefinite but for rounding."""
    size = np.maximum(np.abs(A).max(axis=(-2, -1)), np.finfo(float).tiny)
    return np.linalg.eigvalsh(A)[..., 0] >= -ROUNDING * size


def principal_moments(
    mass: Any, r_G: np.ndarray, inertia: np.ndarray, reference: str
) -> np.ndarray:
    """Moments (..., 3) about the centre of gravity, ascending, kg m2."""
    S, m = skew(r_G), np.asarray(mass, float)[..., None, None]
    return np.linalg.eigvalsh(inertia + m * S @ S if reference == 'co' else inertia)


def satisfies_triangle(moments: np.ndarray) -> Any:
    """Whether no principal moment (..., 3) exceeds the sum of the others."""
    return moments[..., 0] + moments[..., 1] >= moments[..., 2] * (1 - ROUNDING)


class _Source:
    """The file's matrices, each checked for what physics asks of it."""

    def __init__(self, data: dict[str, Any], file: object):
        self._data, self._file = data, file
        self._sign = -1.0 if data.get('sign') == 'sname' else 1.0
        self.warnings: list[str] = []
        if not data.get('source'):
            self._warn('source', 'no source is given for these numbers')

    def _warn(self, key: str, text: str) -> None:
        self.warnings.append(f'{self._file}: {key}: {text}')

    def _symmetric(self, key: str, A: np.ndarray) -> np.ndarray:
        difference = np.abs(A - A.T)
        i, j = np.unravel_index(np.argmax(difference), A.shape)
        if not is_symmetric(A):
            found = f'[{i}][{j}] = {A[i, j]:g} against [{j}][{i}] = {A[j, i]:g}'
            raise InputError(self._file, key, 'a symmetric matrix', found)
        if difference[i, j] > 0:
            self._warn(key, f'[{i}][{j}] = {A[i, j]:g} and [{j}][{i}] = {A[j, i]:g}: symmetrised')
        return (A + A.T) / 2

    def inertia_matrix(self) -> np.ndarray:
        expected = 'nothing beside inertia_matrix'
        if 'added_mass' in self._data:
            raise InputError(self._file, 'added_mass', expected, 'both')
        for key in ('inertia', 'inertia_reference'):
            if key in self._data['rigid_body']:
                raise InputError(self._file, f'rigid_body.{key}', expected, 'both of them')
        return self._symmetric('inertia_matrix', matrix6(self._data['inertia_matrix']))

    def rigid_body(self, mass: float, r_G: np.ndarray) -> np.ndarray:
        body = self._data['rigid_body']
        for key, expected in (
            ('inertia', 'a 3x3 tensor (kg m2), or inertia_matrix in its place'),
            ('inertia_reference', 'cg or co'),
        ):
            if key not in body:
                raise InputError(self._file, f'rigid_body.{key}', expected, None)
        key = 'rigid_body.inertia'
        inertia = self._symmetric(key, np.array(body['inertia'], float))
        moments = principal_moments(mass, r_G, inertia, body['inertia_reference'])
        if moments[0] <= 0:
            found = f'principal moments {_numbers(moments)} about the centre of gravity'
            raise InputError(self._file, key, 'a positive definite tensor', found)
        if not satisfies_triangle(moments):
            found = f'principal moments {_numbers(moments)}'
            expected = 'principal moments that satisfy the triangle inequality'
            raise InputError(self._file, key, expected, found)
        return rigid_body_matrix(mass, r_G, inertia, body['inertia_reference'])

    def added_mass(self) -> np.ndarray:
        if 'added_mass' not in self._data:
            expected = '6 numbers or a 6x6 matrix (kg, kg m, kg m2)'
            raise InputError(self._file, 'added_mass', expected, None)
        M_A = self._symmetric('added_mass', self._sign * matrix6(self._data['added_mass']))
        self._check_semidefinite('added_mass', M_A)
        return M_A

    def damping(self) -> tuple[np.ndarray, np.ndarray]:
        damping = self._data['damping']
        linear = self._sign * matrix6(damping['linear'])
        quadratic = self._sign * matrix6(damping['quadratic'])
        self._check_semidefinite('damping.linear', (linear + linear.T) / 2)
        self._warn_quadratic(quadratic)
        return linear, quadratic

    def lift(self) -> np.ndarray | None:
        if 'lift' not in self._data:
            return None
        lift = self._sign * matrix6(self._data['lift'])
        driving = [f'[{i}][{i}] = {lift[i, i]:g}' for i in range(6) if lift[i, i] < 0]
        if driving:
            self._warn('lift', f'{", ".join(driving)}: feeds its own motion, see sign')
        return lift

    def thrusters(self) -> Thrusters | None:
        if 'thrusters' not in self._data:
            return None
        thrusters, warnings = thrusters_of(self._data['thrusters'], self._file)
        for key, text in warnings:
            self._warn(key, text)
        return thrusters

    def _check_semidefinite(self, key: str, A: np.ndarray) -> None:
        if not is_semidefinite(A):
            sign = '' if self._sign > 0 else ' after sign: sname'
            found = f'smallest eigenvalue {np.linalg.eigvalsh(A)[0]:.4g}{sign}'
            raise InputError(self._file, key, 'a positive semidefinite matrix', found)

    def check_positive_definite(self, M: np.ndarray) -> None:
        if not is_definite(M):
            key = 'inertia_matrix' if 'inertia_matrix' in self._data else 'M'
            found = f'smallest eigenvalue {np.linalg.eigvalsh(M)[0]:.4g}'
            raise InputError(self._file, key, 'a positive definite inertia M', found)

    def _warn_quadratic(self, quadratic: np.ndarray) -> None:
        generator = np.random.default_rng(0)
        nu = np.vstack([np.eye(6), -np.eye(6), generator.normal(size=(200, 6))])
        power = (nu @ quadratic * np.abs(nu) * nu).sum(axis=1)
        gaining = power < -ROUNDING * np.abs(quadratic).max()
        if gaining.any():
            k = int(np.argmax(gaining))
            text = f'nu = {_numbers(nu[k])} gains energy from it ({power[k]:.3g} W)'
            self._warn('damping.quadratic', text)

    def check_units(self, mass: float, volume: float, density: float) -> None:
        """Refuse what is wrong by a factor of a thousand, warn of what probably is."""
        displaced = density * volume
        if displaced > ABSURD * mass:
            expected = f'm3 that displace about the mass, {mass:g} kg'
            found = f'{volume:g}: litres, or the mass in t?'
            raise InputError(self._file, 'hydrostatics.volume', expected, found)
        if mass > ABSURD * displaced:
            if density < LIGHTEST:
                found = f'{density:g}: g/cm3?'
                raise InputError(
                    self._file, 'environment.water_density', 'kg/m3, such as 1025', found
                )
            expected, found = f'kg, about the {displaced:g} kg of water displaced', f'{mass:g}: g?'
            raise InputError(self._file, 'rigid_body.mass', expected, found)
        body, most = self._data['rigid_body'], LONGEST * volume ** (1 / 3)
        if 'inertia' in body:
            radius = float(np.sqrt(np.abs(body['inertia']).max() / mass))
            if radius > most:
                text = f'a radius of gyration of {radius:.3g} m for {volume:g} m3: g m2 or kg mm2?'
                self._warn('rigid_body.inertia', text)
        for part, key in (
            ('rigid_body', 'center_of_gravity'),
            ('hydrostatics', 'center_of_buoyancy'),
        ):
            distance = float(np.linalg.norm(self._data[part][key]))
            if distance > most:
                self._warn(f'{part}.{key}', f'{distance:.3g} m away for {volume:g} m3: mm?')

    def warn_buoyancy(self, weight: float, buoyancy: float) -> None:
        if abs(weight - buoyancy) > 0.02 * weight:
            text = f'weight {weight:.1f} N and buoyancy {buoyancy:.1f} N are more than 2 % apart'
            self._warn('hydrostatics.volume', text)


def _numbers(values: np.ndarray) -> str:
    return ', '.join(f'{value:.4g}' for value in values)
