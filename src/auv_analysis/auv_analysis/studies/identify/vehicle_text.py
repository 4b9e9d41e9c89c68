"""The identified vehicle as a file: the prior's, with what was identified in its place."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from auv_analysis.output.text import number
from auv_analysis.report.results import Results
from auv_analysis.studies.identify.identified import Identified
from auv_analysis.studies.identify.report import verdict
from auv_analysis.studies.identify.unknowns import Coefficients
from auv_dynamics.files.errors import InputError, printable
from auv_dynamics.files.yaml_files import yaml_text
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_dynamics.vehicle.vehicle_file import is_semidefinite, vehicle_from_dict

WIDTH = 96  # of comments
DIGITS = 7
SECTIONS = {
    'inertia_matrix': 'M.', 'added_mass': 'M.', 'damping': 'D_', 'hydrostatics': 'restoring.',
}  # fmt: skip


def vehicle_text(found: Identified, data: Mapping[str, Any], name: str, source: str) -> str:
    """Text of the vehicle file, every section with the provenance of its numbers in comments.

    `data` are the contents of the file of the prior; name and source are those of the new one.
    """
    prior, rows = found.vehicle, found.coefficients()
    new = with_vehicle(prior, found.found)
    contents = {**data, 'name': name, 'source': source, 'sign': 'positive'}
    contents['damping'] = {'linear': _six(new.D_linear), 'quadratic': _six(new.D_quadratic)}
    if prior.lift is not None:
        contents['lift'] = _six(prior.lift)
    environment = data['environment']
    contents['hydrostatics'] = {
        'volume': _rounded(float(new.buoyancy) / environment['water_density']
                           / environment['gravity']),
        'center_of_buoyancy': _rounded(new.r_B),
    }  # fmt: skip
    M_A = None if prior.M_RB is None else new.M - prior.M_RB
    if M_A is not None and is_semidefinite(np.array(_six(_symmetric(M_A), whole=True))):
        contents['added_mass'] = _six(_symmetric(M_A))
        contents.pop('inertia_matrix', None)
    else:
        contents['inertia_matrix'] = _six(_symmetric(new.M), whole=True)
        contents.pop('added_mass', None)
        body, apart = contents['rigid_body'], ('inertia', 'inertia_reference')
        contents['rigid_body'] = {key: body[key] for key in body if key not in apart}
    lines = ['# Identified by auv identify; comments say what each number is: identified with its',
             '# 95 % interval, or the prior, of which the recording says too little.']  # fmt: skip
    other = [row for row in rows if not row['name'].startswith(('M.', 'D_', 'restoring.'))]
    lines += _said(other, 'beside this file')
    for key, value in contents.items():
        start = SECTIONS.get(key)
        if start:
            lines += _said([row for row in rows if row['name'].startswith(start)], key)
        flow = None if isinstance(value, dict | list) else False  # lists of numbers in a line
        text = yaml_text({key: value}, default_flow_style=flow, width=WIDTH)
        lines += text.rstrip().splitlines()
    return '\n'.join(lines) + '\n'


def with_vehicle(vehicle: Vehicle, found: Coefficients) -> Vehicle:
    """The vehicle with identified coefficients: M_RB as it was, the rest is added mass."""
    couple = found.hydrostatics[1:]
    buoyancy = float(vehicle.weight) - float(found.hydrostatics[0])
    r_B = (float(vehicle.weight) * vehicle.r_G - couple) / buoyancy
    return vehicle.changed(M=found.M, D_linear=found.D_linear, D_quadratic=found.D_quadratic,
                           buoyancy=buoyancy, r_B=r_B)  # fmt: skip


def write_vehicle(text: str, results: Results, folder: Path) -> None:
    """Write a vehicle file; one that no command would take is a contradiction, and none."""
    file, told = results.facts['file'], results.facts['contradictions']
    try:
        vehicle_from_dict(yaml.safe_load(text), file)
    except InputError as error:
        wrong = [f'no command would take it, {error}', *told]
        results.facts.update(file='', contradictions=wrong, verdict=verdict([], wrong))
    else:
        (folder / file).write_text(text, 'utf-8')


def _said(rows: Sequence[Mapping[str, Any]], key: str) -> list[str]:
    """Comment lines: a coefficient each."""
    if not rows:
        return []
    lines = [f'# {key}:']
    for row in rows:
        unit = f' {row["unit"]}' if row['unit'] else ''
        if row['status'] == 'at zero' and row['high'] is None:
            text = 'held at 0, as it would feed energy beside what was identified'
        elif row['status'] == 'at zero':
            text = f'at its bound 0{unit}, at most {number(row["high"], 5)}{unit}'
        elif row['low'] is not None:
            within = f'{number(row["low"], 5)} to {number(row["high"], 5)}{unit}'
            text = f'identified {number(row["value"], 5)}{unit}, within {within}'
            if row['low'] <= 0.0 <= row['high']:
                text += '; no more than its uncertainty'
        else:
            text = f'prior {number(row["prior"], 5)}{unit}, not identified by itself'
        lines.append(printable(f'#   {row["name"]}: {text}'))
    return lines


def _symmetric(A: np.ndarray) -> np.ndarray:
    return (A + A.T) / 2


def _six(A: np.ndarray, *, whole: bool = False) -> list[Any]:
    """Six numbers of a diagonal matrix, else rows."""
    is_diagonal = not whole and not np.any(A - np.diag(np.diag(A)))
    return _rounded(np.diag(A) if is_diagonal else A)


def _rounded(value: Any) -> Any:
    if np.ndim(value):
        return [_rounded(entry) for entry in value]
    return float(f'{float(value):.{DIGITS}g}') + 0.0
