"""The text of a vehicle file, each number with a comment that says where it came from."""

import re
from typing import Any

import numpy as np
import yaml

from auv_analysis.formats.draft import Draft
from auv_dynamics.printable import printable

SECTIONS = (
    ('rigid_body', ('mass', 'center_of_gravity', 'inertia', 'inertia_reference')),
    ('hydrostatics', ('volume', 'center_of_buoyancy')),
    ('damping', ('linear', 'quadratic')),
    ('environment', ('water_density', 'gravity')),
)
UNFIT = re.compile(r'[^\w .-]+')


def vehicle_text(draft: Draft, name: str, source: str) -> str:
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


def _entry(draft: Draft, place: str, key: str, indent: str) -> list[str]:
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
    return yaml.safe_dump(str(text), width=10**6, allow_unicode=True).removesuffix('...\n').strip()
