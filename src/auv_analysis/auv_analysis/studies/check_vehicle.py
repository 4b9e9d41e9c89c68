"""Check of a vehicle: inertia, couplings, hydrostatics, poles, thrusters, largest step."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from auv_analysis.metrics.coupling import structural_zeros
from auv_analysis.metrics.energy import NEGLIGIBLE
from auv_analysis.metrics.quantities import SIGNALS
from auv_analysis.output.progress import TextConsole
from auv_analysis.output.text import plain
from auv_analysis.report.results import (
    Column,
    Rows,
    Shown,
    described,
    make_table,
    terminal,
)
from auv_analysis.scenario.scaling import TOP_SPEED
from auv_analysis.studies.linearize.linearize import ATTITUDE, NU, linearize, plant_jacobian
from auv_analysis.studies.linearize.modes import FOUR, POLES, modes, pole_rows
from auv_dynamics.vehicle import DOFS
from auv_dynamics.vehicle.thruster_curves import source_of
from auv_dynamics.vehicle.thrusters import Rotor, Thrusters
from auv_dynamics.vehicle.vehicle import Vehicle, munk_terms
from auv_dynamics.vehicle.vehicle_file import load_vehicle
from auv_gvc_controller.control.gains import RINGS, UNSTABLE, sampled_rate
from auv_gvc_controller.laws.model import decompose, inverse_upper

K_D = 12.0  # k_D of the paper, (36)
CRUISE = 1.0  # m/s, where the top speed of a vehicle is not known


def check_vehicle(name_or_path: str | Path, speed: float | None = None) -> dict[str, Any]:
    """Properties of a vehicle file that decide how it can be controlled, ready for JSON.

    Parameters
    ----------
    name_or_path : a vehicle file, or the bare name of a shipped one
    speed : m/s, ahead, at which the poles are; None: the top speed of a shipped vehicle, else 1

    Returns
    -------
    document : name, source, M, N, Upsilon, inertia, couplings, structural_zeros, statement,
        hydrostatics, damping, cruise, thrusters (None without), sampling, warnings; SI units, None
        for what does not exist (a time constant without damping, a frequency without restoring)

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    vehicle = load_vehicle(name_or_path)
    Upsilon, N = decompose(vehicle.M)
    inverse = inverse_upper(Upsilon)
    couplings = _couplings(Upsilon, inverse)
    moments = np.linalg.eigvalsh(vehicle.M)
    return {
        'name': vehicle.name,
        'source': vehicle.source,
        'M': vehicle.M.tolist(),
        'N': N.tolist(),
        'Upsilon': Upsilon.tolist(),
        'inertia': {
            'eigenvalues': moments.tolist(),
            'condition_number': float(moments[-1] / moments[0]),
        },
        'couplings': couplings,
        'structural_zeros': structural_zeros(Upsilon),
        'statement': _statement(couplings),
        'hydrostatics': _hydrostatics(vehicle),
        'damping': _damping(vehicle),
        'cruise': _cruise(vehicle, speed),
        'thrusters': None if vehicle.thrusters is None else _thrusters(vehicle.thrusters),
        'sampling': _sampling(vehicle.M),
        'warnings': list(vehicle.warnings),
    }


def _couplings(Upsilon: np.ndarray, inverse: np.ndarray) -> list[dict[str, Any]]:
    """Entries of (33) and (34): delta_xi_i by nu_j, j > i, and delta_pi_i by tau_j, j < i."""
    found: list[dict[str, Any]] = []
    for key, weights, unit in (
        ('delta_xi', inverse, SIGNALS['nu'].unit_of),
        ('delta_pi', Upsilon.T, SIGNALS['tau'].unit_of),
    ):
        for i, j in np.argwhere(np.abs(weights - np.eye(6)) > NEGLIGIBLE).tolist():
            entry = {'from': DOFS[j], 'to': DOFS[i], key: float(weights[i, j])}
            found.append(entry | {'unit': f'{unit(i)} per {unit(j)}'})
    return found


def _statement(couplings: list[dict[str, Any]]) -> str:
    if not couplings:
        return (
            'M is diagonal: Upsilon is the identity and there is no inertial coupling; '
            'delta_xi and delta_pi are zero in every motion'
        )
    number = sum('delta_xi' in entry for entry in couplings)
    word = 'coupling' if number == 1 else 'couplings'
    return f'M is not diagonal: {number} {word} of velocities by its inertia'


def _hydrostatics(vehicle: Vehicle) -> dict[str, Any]:
    """N, m, N m: metacentric height is z_G - z_B, positive with the weight below the buoyancy.

    `moment_when_level` acts in roll and pitch at phi = theta = 0; not zero: the vehicle does
    not float level.
    """
    difference = vehicle.buoyancy - vehicle.weight
    couple = vehicle.weight * vehicle.r_G - vehicle.buoyancy * vehicle.r_B
    return {
        'weight': vehicle.weight,
        'buoyancy': vehicle.buoyancy,
        'difference': difference,
        'difference_percent': 100 * difference / vehicle.weight,
        'r_G': vehicle.r_G.tolist(),
        'r_B': vehicle.r_B.tolist(),
        'metacentric_height': float(vehicle.r_G[2] - vehicle.r_B[2]),
        'moment_when_level': [float(couple[1]), float(0.0 - couple[0])],
        'modes': _pendulum(vehicle),
    }


def _pendulum(vehicle: Vehicle) -> dict[str, dict[str, float | None]]:
    """Undamped motion in phi and theta about level: its stiffness M^-1 dg/d(phi, theta), 1/s2.

    The eigenvalue is the square of the natural frequency; negative: the vehicle turns over;
    the real part of a complex pair, which has no natural frequency: one of its motions grows.
    """
    level = np.zeros(6)
    A, _ = plant_jacobian(vehicle, level, level)
    values, modes = np.linalg.eig(-A[NU, ATTITUDE][3:5])
    named = {}
    for dof, i in zip(('roll', 'pitch'), np.argsort(-np.abs(modes[0])), strict=True):
        value = float(values[i].real)
        stable = value > NEGLIGIBLE and not values[i].imag
        omega = float(np.sqrt(value)) if stable else None
        named[dof] = {
            'eigenvalue': value,
            'natural_frequency': omega,
            'period': None if omega is None else 2 * np.pi / omega,
        }
    return named


def _damping(vehicle: Vehicle) -> dict[str, Any]:
    """Linear damping: eigenvalues of its symmetric part, time constants of M nu_dot = -D nu."""
    rates, modes = np.linalg.eig(np.linalg.solve(vehicle.M, vehicle.D_linear))
    constants = []
    for i in np.argsort(rates.real):
        energy = np.abs(modes[:, i] * (vehicle.M @ modes[:, i]))
        rate = float(rates[i].real)
        row = {'mostly': DOFS[int(np.argmax(energy))], 'rate': rate}
        constants.append(row | {'time_constant': 1 / rate if rate > NEGLIGIBLE else None})
    symmetric = (vehicle.D_linear + vehicle.D_linear.T) / 2
    return {
        'linear_symmetric_eigenvalues': np.linalg.eigvalsh(symmetric).tolist(),
        'time_constants': constants,
    }


def _cruise(vehicle: Vehicle, speed: float | None) -> dict[str, Any]:
    """Poles of straight and level motion ahead, held by a constant wrench, and what they mean."""
    known = TOP_SPEED.get(vehicle.name)
    source = 'given' if speed is not None else 'top speed' if known else 'assumed'
    if speed is None:
        speed = float(known.split()[0]) if known else CRUISE
    found, at_rest = (modes(linearize(vehicle, [u, *np.zeros(5)])) for u in (speed, 0.0))
    fastest = max(found, key=lambda mode: mode['pole'][0])
    by_speed = all(mode['pole'][0] <= 0 for mode in at_rest)
    growth = fastest['pole'][0]
    return {
        'speed': speed,
        'speed_source': source,
        'modes': found,
        'verdict': 'unstable' if growth > 0 else 'marginal' if growth == 0 else 'stable',
        'mostly': fastest['mostly'],
        'hint': _munk(vehicle) if growth > 0 and by_speed else None,
    }


def _munk(vehicle: Vehicle) -> str | None:
    """Why a vehicle turns across the flow; None where the added mass does not turn it."""
    yaw, pitch = (munk_terms(vehicle.M)[place] for place in ((5, 1), (4, 2)))
    if yaw >= 0 and pitch <= 0:
        return None
    because = 'the Munk moment of the added mass turns it across the flow'
    if vehicle.lift is None:
        return (
            f'{because}, and the file has no lift of body and fins (key lift), without which a '
            'torpedo vehicle is unstable'
        )
    return f'{because}; lift and damping are too small against it'


def _thrusters(thrusters: Thrusters) -> dict[str, Any]:
    """What is there, and how much of each degree of freedom it gives; None where it gives none."""
    lost = thrusters.unactuated()
    largest = zip(DOFS, thrusters.alone().T.tolist(), strict=True)
    return {
        'names': list(thrusters.names),
        'matrix': thrusters.matrix.tolist(),
        'reverse': thrusters.reverse.tolist(),
        'forward': thrusters.forward.tolist(),
        'rank': thrusters.rank,
        'unactuated': {dof: list(others) for dof, others in lost.items()},
        'largest': {dof: None if dof in lost else both for dof, both in largest},
        'rotors': [_rotor(rotor) for rotor in thrusters.rotors],
    }


def _rotor(rotor: Rotor) -> dict[str, Any]:
    """Drive of a thruster, None for what does not exist; N, V, s, rad/s."""
    curve = rotor.curve
    return {
        'curve': 'square law' if curve is None else curve.name or 'table of the file',
        'source': source_of(curve.name) if curve and curve.voltage else None,
        'thrust': None if curve is None else curve.thrusts[[0, -1]].tolist(),
        'command_without_thrust': None if curve is None else list(curve.dead_band),
        'command_unit': None if curve is None else curve.unit,
        'voltage': rotor.voltage,
        'dead_band': list(rotor.dead_band),
        'lag': None if rotor.omega else rotor.lag,
        'lag_at': rotor.lag_at or None,
        'omega': rotor.omega or None,
        'zeta': rotor.zeta if rotor.omega else None,
    }


def _sampling(M: np.ndarray) -> dict[str, dict[str, Any]]:
    """Rate of the sampled velocity loop with k_D = 12, and the steps where it rings and grows.

    GVC with a scalar k_D has K_D = k_D M: the rate is k_D in every degree of freedom.
    """
    found = {}
    for law, (rate, dof) in (('cl', sampled_rate(K_D * np.eye(6), M)), ('gvc', (K_D, 'all'))):
        found[law] = {
            'k_D': K_D,
            'rate': rate,
            'mostly': dof,
            'rings_above': RINGS / rate,
            'unstable_above': UNSTABLE / rate,
        }
    return found


def print_check(document: dict[str, Any], out: Console | None = None) -> None:
    """Print what `check_vehicle` found; default: on standard output."""
    out = out or TextConsole(highlight=False)
    _say(out, f'{document["name"]}: {document["source"] or "no source is given"}')
    _inertia(document, out)
    _couplings_table(document, out)
    _hydrostatics_table(document['hydrostatics'], out)
    _damping_table(document['damping'], out)
    _cruise_table(document['cruise'], out)
    if document['thrusters'] is not None:
        _thrusters_table(document['thrusters'], out)
    _sampling_table(document['sampling'], out)
    for warning in document['warnings']:
        _say(out, f'warning: {warning}')


def _say(out: Console, text: str) -> None:
    out.print(text, markup=False, soft_wrap=True)


def _print(out: Console, title: str, rows: Rows, shown: Mapping[str, Shown]) -> None:
    _say(out, f'\n{title}')
    out.print(terminal(make_table('', title, rows, shown)))


def _four(label: str, unit: str = '') -> Column:
    """Column of numbers of at most four digits."""
    return described(label, unit=unit, **FOUR)


def _listed(values: Iterable[float]) -> str:
    return ', '.join(plain(value) for value in values)


def _inertia(document: dict[str, Any], out: Console) -> None:
    rows = [
        {'': dof, **dict(zip(DOFS, row, strict=True)), 'N': N}
        for dof, row, N in zip(DOFS, document['M'], document['N'], strict=True)
    ]
    _print(out, 'M and N, kg, kg m, kg m2', rows, {'': ''} | {n: _four(n) for n in (*DOFS, 'N')})
    inertia = document['inertia']
    condition = plain(inertia['condition_number'])
    _say(out, f'eigenvalues {_listed(inertia["eigenvalues"])}; condition number {condition}')


def _couplings_table(document: dict[str, Any], out: Console) -> None:
    _say(out, f'\n{document["statement"]}')
    shown: dict[str, Shown] = {'from': 'of', 'to': 'in', 'value': '', 'unit': 'unit'}
    for key in ('delta_xi', 'delta_pi'):
        entries = [entry for entry in document['couplings'] if key in entry]
        rows = [entry | {'value': f'{entry[key]:+.4g}'} for entry in entries]
        if rows:
            _print(out, f'{key}: what one degree of freedom adds to another', rows, shown)
            zero = ', '.join(document['structural_zeros'][key]) or 'none'
            _say(out, f'zero in every motion: {zero}')


def _hydrostatics_table(found: dict[str, Any], out: Console) -> None:
    percent = found['difference_percent']
    _say(
        out,
        f'\nweight {found["weight"]:.1f} N, buoyancy {found["buoyancy"]:.1f} N: '
        f'{found["difference"]:+.2f} N ({percent:+.2f} %); '
        f'metacentric height {plain(found["metacentric_height"])} m',
    )
    roll, pitch = found['moment_when_level']
    if roll or pitch:
        _say(out, f'not level at rest: {plain(roll)} N m in roll, {plain(pitch)} N m in pitch')
    rows = [{'dof': dof, **mode} for dof, mode in found['modes'].items()]
    shown: dict[str, Shown] = {
        'dof': '',
        'eigenvalue': _four('eigenvalue', '1/s2'),
        'natural_frequency': _four('frequency', 'rad/s'),
        'period': _four('period', 's'),
    }
    _print(out, 'restoring about level, without damping', rows, shown)
    for row in rows:
        if row['eigenvalue'] < 0:
            _say(out, f'unstable in {row["dof"]}: the vehicle turns over')
    if any(row['eigenvalue'] > NEGLIGIBLE and row['period'] is None for row in rows):
        _say(out, 'unstable: roll and pitch are a complex pair, which grows where damping is small')


def _damping_table(found: dict[str, Any], out: Console) -> None:
    shown: dict[str, Shown] = {'mostly': 'mostly', 'rate': _four('rate', '1/s')}
    shown['time_constant'] = POLES['time_constant']
    _print(out, 'open loop with linear damping alone', found['time_constants'], shown)
    values = _listed(found['linear_symmetric_eigenvalues'])
    _say(out, f'eigenvalues of the symmetric part of linear D: {values}')


def _cruise_table(found: dict[str, Any], out: Console) -> None:
    why = {'given': '--speed', 'top speed': 'its top speed', 'assumed': 'assumed, see --speed'}
    title = f'poles straight ahead at {found["speed"]:g} m/s ({why[found["speed_source"]]})'
    shown = {name: POLES[name] for name in ('mostly', 'pole', 'time_constant')}
    _print(out, title, pole_rows(found['modes']), shown)
    said = {
        'unstable': 'it leaves straight motion',
        'marginal': 'no unstable pole, one does not decay',
    }
    text = f'{found["verdict"]} at {found["speed"]:g} m/s without control'
    if found['verdict'] in said:
        text += f': {said[found["verdict"]]}, in {found["mostly"]} first'
    _say(out, text)
    if found['hint']:
        _say(out, f'hint: {found["hint"]}')


def _thrusters_table(found: dict[str, Any], out: Console) -> None:
    rows = [
        {'dof': dof, **dict(zip(('backward', 'forward'), pair or (None, None), strict=True))}
        for dof, pair in found['largest'].items()
    ]
    title = f'{len(found["names"])} thrusters, T has rank {found["rank"]}: largest wrench, N, N m'
    names = {name: _four(name) for name in ('backward', 'forward')}
    _print(out, title, rows, {'dof': '', **names})
    for dof, others in found['unactuated'].items():
        apart = f' apart from {" and ".join(others)}' if others else ''
        _say(out, f'{dof} cannot be actuated{apart}')
    alike: dict[str, list[str]] = {}
    for name, rotor in zip(found['names'], found['rotors'], strict=False):
        alike.setdefault(_rotor_text(rotor), []).append(name)
    for text, thrusters in alike.items():
        _say(out, f'rotor of {", ".join(thrusters)}: {text}')
    for source in dict.fromkeys(rotor['source'] for rotor in found['rotors'] if rotor['source']):
        _say(out, f'source: {source}')


def _rotor_text(rotor: Mapping[str, Any]) -> str:
    parts = [rotor['curve']]
    if rotor['thrust'] is not None:
        (astern, ahead), (low, high) = rotor['thrust'], rotor['command_without_thrust']
        parts.append(f'{astern:.4g} to {ahead:.4g} N')
        parts.append(f'none from {low:g} to {high:g} {rotor["command_unit"]}')
    parts.append(f'{rotor["voltage"]:g} V' if rotor['voltage'] else 'voltage unknown')
    parts.append('dead band {:g} and {:g} N'.format(*rotor['dead_band']))
    if rotor['omega'] is None:
        at = f' at {rotor["lag_at"]:g} N, by 1/sqrt(thrust)' if rotor['lag_at'] else ''
        parts.append(f'lag {rotor["lag"]:g} s{at}')
    else:
        parts.append(f'second order, {rotor["omega"]:g} rad/s, damping ratio {rotor["zeta"]:g}')
    return ', '.join(parts)


def _sampling_table(found: dict[str, dict[str, Any]], out: Console) -> None:
    shown: dict[str, Shown] = {
        'law': 'law',
        'mostly': 'mostly',
        'k_D': _four('k_D'),
        'rate': _four('rate', '1/s'),
        'rings_above': _four('rings above', 's'),
        'unstable_above': _four('unstable above', 's'),
    }
    rows = [{'law': law, **entry} for law, entry in found.items()]
    title = 'largest step of a sampled velocity loop, with the gain of the paper'
    _print(out, title, rows, shown)
