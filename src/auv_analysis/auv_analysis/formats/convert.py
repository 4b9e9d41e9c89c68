"""Vehicle files from the formats of other systems: which format, and the text with its sources."""

import re
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.formats.derivatives import ASSIGNED, read_derivatives
from auv_analysis.formats.imported import Choices, ImportedVehicle
from auv_analysis.formats.mesh_import import SUFFIXES, read_mesh
from auv_analysis.formats.sdf_import import read_gazebo
from auv_analysis.formats.uuv_urdf import read_uuv, uuv_entries
from auv_analysis.formats.xml_parts import other_links, parse_xml
from auv_dynamics.files.errors import InputError, printable
from auv_dynamics.files.yaml_files import parse_yaml, read_text, yaml_text

OF_A_MESH = (
    'mass', 'center_of_gravity', 'inertia', 'units', 'axes', 'origin', 'tolerance', 'panels',
)  # fmt: skip
UUV = re.compile(r'hydrodynamic_model|quad_damping|quadratic_damping|^Ma\s*:', re.M)


def read_vehicle(path: Path, format_: str, choices: Choices) -> tuple[str, ImportedVehicle]:
    """Format and draft of a file of another system.

    Parameters
    ----------
    path : of the file
    format_ : 'uuv', 'gazebo', 'mss', 'mesh', or 'auto' to tell by its suffix and contents
    choices : what the user says of it

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    if format_ == 'mesh' or (format_ == 'auto' and path.suffix.lower() in SUFFIXES):
        return 'mesh', read_mesh(path, choices)
    for name in OF_A_MESH:
        if getattr(choices, name) is not None:
            option = f'--{name.replace("_", "-")}'
            raise InputError(path, option, 'a mesh, or no such option', f'{path.suffix or path}')
    text = read_text(path, 'vehicle')
    found = _told(text, path) if format_ == 'auto' else format_
    is_xml = text.lstrip().startswith('<')
    if found == 'mss':
        return found, read_derivatives(text, path, choices)
    if found == 'gazebo':
        return found, read_gazebo(parse_xml(text, path), path, choices)
    if not is_xml:
        return found, read_uuv(parse_yaml(text, path, 'uuv_simulator'), path, choices, path.stem)
    entries, others, done = uuv_entries(parse_xml(text, path), path)
    draft = read_uuv(entries, path, choices, path.stem)
    draft.traps += done
    other_links(draft, others)
    return found, draft


def _told(text: str, path: Path) -> str:
    if UUV.search(text):
        return 'uuv'
    if text.lstrip().startswith('<'):
        return 'gazebo'
    if any(match[2] for match in ASSIGNED.finditer(text)):
        return 'mss'
    raise InputError(
        path, '', 'a file of a known format, or --format uuv, gazebo, mss or mesh', 'neither'
    )


SECTIONS = (
    ('rigid_body', ('mass', 'center_of_gravity', 'inertia', 'inertia_reference')),
    ('hydrostatics', ('volume', 'center_of_buoyancy')),
    ('damping', ('linear', 'quadratic')),
    ('environment', ('water_density', 'gravity')),
)
UNFIT = re.compile(r'[^\w .-]+')


def vehicle_text(draft: ImportedVehicle, name: str, source: str) -> str:
    """Text of a vehicle file.

    Parameters
    ----------
    draft : complete
    name, source : of the vehicle

    """
    lines = [
        '# Comments say where numbers stand in the file that they were imported from. Body axes',
        '# are forward-starboard-down, units SI, matrices positive.',
        *(f'# {title}: {_line(text)}' for title, texts in draft.report.items() for text in texts),
        'format: 1',
        f'name: {_scalar(UNFIT.sub("_", name) or "imported")}',
        f'source: {_scalar(source)}',
    ]
    for section, keys in SECTIONS:
        if section == 'damping':
            lines += _entry(draft, 'added_mass', 'added_mass', '')
        lines.append(f'{section}:')
        for key in keys:
            lines += _entry(draft, f'{section}.{key}', key, '  ')
        if section == 'damping' and 'lift' in draft.values:
            lines += _entry(draft, 'lift', 'lift', '')
    return '\n'.join(lines) + '\n'


def _line(text: str) -> str:
    """A comment is one line, whatever names a file has."""
    return ' '.join(printable(text).split())


def _entry(draft: ImportedVehicle, place: str, key: str, indent: str) -> list[str]:
    value, comment = draft.values[place], draft.comments.get(place, '')
    said = f'  # {comment}' if comment else ''
    if isinstance(value, str):
        return [f'{indent}{key}: {value}{said}']
    array = np.asarray(value, float)
    if array.shape == (6, 6) and not np.any(array - np.diag(np.diagonal(array))):
        array = np.diagonal(array)
    if array.ndim < 2:
        return [f'{indent}{key}: {_numbers(array)}{said}']
    return [f'{indent}{key}:{said}', *(f'{indent}  - {_numbers(row)}' for row in array)]


def _numbers(value: np.ndarray) -> str:
    if value.ndim == 0:
        return repr(float(value))
    return f'[{", ".join(repr(float(entry) + 0.0) for entry in value)}]'


def _scalar(text: Any) -> str:
    """Text as YAML writes it in one line."""
    return yaml_text(str(text), width=10**6, allow_unicode=True).removesuffix('...\n').strip()
