"""Texts of a vehicle, a scenario and a law of one's own, made of the shipped ones."""

import copy
import importlib.util
import keyword
import re
from pathlib import Path
from typing import Any

from auv_analysis.scaling import scale_lines, scaled_case1
from auv_analysis.scenario import SCHEMA
from auv_analysis.starting.annotated import annotated
from auv_dynamics.config import shipped
from auv_dynamics.files import InputError, read_text, read_yaml, schema
from auv_dynamics.vehicle_file import SCHEMA as VEHICLE_SCHEMA
from auv_dynamics.vehicle_file import load_vehicle

STARTING = 'bluerov2_heavy'  # has thrusters and M_RB apart from M_A, so that every option applies
OWN_LAW = 'own_law'
NAME = re.compile(r'[A-Za-z0-9][A-Za-z0-9_.+-]{0,99}')
CLASS = re.compile(r'^class (\w+)\(', re.M)
OPTIONS = (
    'A line that begins with # and no blank is an option: take the # away to use it.',
    'Errors name file, key, expected and found.',
)


def checked_name(kind: str, text: str) -> str:
    """Name of what is to be made: of a file, for a law also of a module.

    Raises
    ------
    InputError : it cannot be one, or a module of that name is there already

    """
    name = text.removesuffix('.yaml').removesuffix('.py')
    if not NAME.fullmatch(name):
        raise InputError('NAME', '', 'a word without blanks or slashes', text)
    if kind == 'law':
        if not name.isidentifier() or keyword.iskeyword(name):
            raise InputError('NAME', '', 'the name of a Python module, such as my_law', text)
        if not Path(f'{name}.py').exists() and importlib.util.find_spec(name) is not None:
            raise InputError('NAME', '', 'a name that no Python module has', text)
    return name


def vehicle_files(name: str) -> dict[str, str]:
    """File name -> text of a vehicle of one's own, with the numbers of a shipped one."""
    data = copy.deepcopy(read_yaml(shipped('vehicles', STARTING), 'vehicle'))
    data |= {'name': name, 'source': f'the numbers of {STARTING}: say where yours come from'}
    about = (
        f'A vehicle of your own, with the numbers of {STARTING} to be replaced; SI units.',
        'Symbols of SNAME (1950) and Fossen: nu = (u, v, w, p, q, r) in surge, sway, heave,',
        'roll, pitch, yaw; M nu_dot + C(nu) nu + D(nu) nu + g(eta) = tau, M = M_RB + M_A.',
    )
    return {f'{name}.yaml': _text(data, VEHICLE_SCHEMA, about)}


def scenario_files(name: str, vehicle: str | None) -> dict[str, str]:
    """File name -> text of a scenario of one's own: case 1 scaled to a vehicle."""
    vehicle = vehicle or STARTING
    data = scaled_case1(vehicle) | {'name': name, 'vehicle': vehicle}
    data['disturbance'] = [data['disturbance']]
    first = "A scenario of your own: the paper's case 1, scaled to the vehicle; SI units."
    about = (first, 'Of the disturbance:', *scale_lines())
    return {f'{name}.yaml': _text(data, SCHEMA, about)}


def law_files(name: str, vehicle: str | None) -> dict[str, str]:
    """File name -> text of a law of one's own and of a scenario that compares it."""
    path = shipped('laws', OWN_LAW)
    module = read_text(path.with_suffix('.py'), 'law')
    found = CLASS.search(module)
    own = ''.join(word.capitalize() for word in name.split('_')) or name
    shown = re.sub(rf'\b{found[1]}\b', own, module) if found else module
    data: dict[str, Any] = copy.deepcopy(read_yaml(path, 'scenario'))
    data |= {'name': name} | ({'vehicle': vehicle} if vehicle else {})
    load_vehicle(data['vehicle'])
    for entry in data['controllers'].values():
        if entry['law'].startswith(f'{OWN_LAW}:'):
            entry['law'] = f'{name}:{own}'
    data['disturbance'] = [data['disturbance']]
    about = (f'Compares the law of {name}.py with a shipped one; SI units.',)
    return {f'{name}.py': shown, f'{name}.yaml': _text(data, SCHEMA, about)}


def _text(data: dict[str, Any], schema_path: Path, about: tuple[str, ...]) -> str:
    lines = [f'# yaml-language-server: $schema={schema_path.as_uri()}', '#']
    lines += [f'# {line}' for line in (*about, *OPTIONS)]
    return '\n'.join(lines) + '\n' + annotated(data, schema(schema_path))
