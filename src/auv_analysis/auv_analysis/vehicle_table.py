"""The tables of `auv check-vehicle` for a terminal."""

from collections.abc import Iterable, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from auv_analysis.console import TextConsole
from auv_dynamics.signals import DOFS


def print_check(document: dict[str, Any], out: Console | None = None) -> None:
    """Print what `check_vehicle` found.

    Parameters
    ----------
    document : of `check_vehicle`
    out : none: standard output

    """
    out = out or TextConsole(highlight=False)
    _say(out, f'{document["name"]}: {document["source"] or "no source is given"}')
    _inertia(document, out)
    _couplings(document, out)
    _hydrostatics(document['hydrostatics'], out)
    _damping(document['damping'], out)
    _cruise(document['cruise'], out)
    if document['thrusters'] is not None:
        _thrusters(document['thrusters'], out)
    _sampling(document['sampling'], out)
    for warning in document['warnings']:
        _say(out, f'warning: {warning}')


def _say(out: Console, text: str) -> None:
    out.print(text, markup=False, soft_wrap=True)


def _print(
    out: Console, title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], words: int = 1
) -> None:
    """Table with `words` columns of text on the left and numbers on the right."""
    table = Table(box=None, header_style='bold')
    for i, column in enumerate(columns):
        table.add_column(column, justify='left' if i < words else 'right', no_wrap=True)
    for row in rows:
        table.add_row(*row)
    _say(out, f'\n{title}')
    out.print(table)


def _number(value: float | None) -> str:
    return 'none' if value is None else f'{value:.4g}'


def _inertia(document: dict[str, Any], out: Console) -> None:
    rows = [
        (dof, *(_number(entry) for entry in row), _number(N))
        for dof, row, N in zip(DOFS, document['M'], document['N'], strict=True)
    ]
    _print(out, 'M and N, kg, kg m, kg m2', ('', *DOFS, 'N'), rows)
    inertia = document['inertia']
    values = ', '.join(_number(value) for value in inertia['eigenvalues'])
    _say(out, f'eigenvalues {values}; condition number {inertia["condition_number"]:.4g}')


def _couplings(document: dict[str, Any], out: Console) -> None:
    _say(out, f'\n{document["statement"]}')
    for key in ('delta_xi', 'delta_pi'):
        rows = [
            (entry['from'], entry['to'], f'{entry[key]:+.4g}', entry['unit'])
            for entry in document['couplings']
            if key in entry
        ]
        if rows:
            columns = ('of', 'in', key, 'unit')
            _print(out, f'{key}: what one degree of freedom adds to another', columns, rows, 2)
            zero = ', '.join(document['structural_zeros'][key]) or 'none'
            _say(out, f'zero in every motion: {zero}')


def _hydrostatics(found: dict[str, Any], out: Console) -> None:
    percent = found['difference_percent']
    _say(
        out,
        f'\nweight {found["weight"]:.1f} N, buoyancy {found["buoyancy"]:.1f} N: '
        f'{found["difference"]:+.2f} N ({percent:+.2f} %); '
        f'metacentric height {found["metacentric_height"]:.4g} m',
    )
    roll, pitch = found['moment_when_level']
    if roll or pitch:
        _say(out, f'not level at rest: {roll:.4g} N m in roll, {pitch:.4g} N m in pitch')
    rows = [
        (
            dof,
            _number(mode['eigenvalue']),
            _number(mode['natural_frequency']),
            _number(mode['period']),
        )
        for dof, mode in found['modes'].items()
    ]
    columns = ('', 'eigenvalue, 1/s2', 'frequency, rad/s', 'period, s')
    _print(out, 'restoring about level, without damping', columns, rows)
    for dof, mode in found['modes'].items():
        if mode['eigenvalue'] < 0:
            _say(out, f'unstable in {dof}: the vehicle turns over')


def _damping(found: dict[str, Any], out: Console) -> None:
    rows = [
        (entry['mostly'], _number(entry['rate']), _number(entry['time_constant']))
        for entry in found['time_constants']
    ]
    columns = ('mostly', 'rate, 1/s', 'time constant, s')
    _print(out, 'open loop with linear damping alone', columns, rows)
    values = ', '.join(_number(value) for value in found['linear_symmetric_eigenvalues'])
    _say(out, f'eigenvalues of the symmetric part of linear D: {values}')


def _cruise(found: dict[str, Any], out: Console) -> None:
    why = {'given': '--speed', 'top speed': 'its top speed', 'assumed': 'assumed, see --speed'}
    rows = []
    for mode in found['modes']:
        real, imaginary = mode['pole']
        pole = f'{real:.4g} ± {imaginary:.4g}i' if imaginary else _number(real)
        rows.append((mode['mostly'], pole, _number(mode['time_constant'])))
    title = f'poles straight ahead at {found["speed"]:g} m/s ({why[found["speed_source"]]})'
    _print(out, title, ('mostly', 'pole, 1/s', 'time constant, s'), rows)
    said = {
        'unstable': 'it leaves straight motion',
        'marginal': 'no pole grows, one does not decay',
    }
    text = f'{found["verdict"]} at {found["speed"]:g} m/s without control'
    if found['verdict'] in said:
        text += f': {said[found["verdict"]]}, in {found["mostly"]} first'
    _say(out, text)
    if found['hint']:
        _say(out, f'hint: {found["hint"]}')


def _thrusters(found: dict[str, Any], out: Console) -> None:
    rows = [
        (dof, 'none', 'none') if pair is None else (dof, _number(pair[0]), _number(pair[1]))
        for dof, pair in found['largest'].items()
    ]
    title = f'{len(found["names"])} thrusters, T has rank {found["rank"]}: largest wrench, N, N m'
    _print(out, title, ('', 'backward', 'forward'), rows)
    for dof, others in found['unactuated'].items():
        apart = f' apart from {" and ".join(others)}' if others else ''
        _say(out, f'{dof} cannot be actuated{apart}')


def _sampling(found: dict[str, dict[str, Any]], out: Console) -> None:
    rows = [
        (
            law,
            entry['mostly'],
            _number(entry['k_D']),
            _number(entry['rate']),
            _number(entry['rings_above']),
            _number(entry['unstable_above']),
        )
        for law, entry in found.items()
    ]
    columns = ('law', 'mostly', 'k_D', 'rate, 1/s', 'rings above, s', 'unstable above, s')
    _print(
        out, 'largest step of a sampled velocity loop, with the gain of the paper', columns, rows, 2
    )
