"""Which format a file is in, and the vehicle file that comes of it."""

import re
from pathlib import Path

from auv_analysis.formats.derivatives import ASSIGNED, read_derivatives
from auv_analysis.formats.draft import Choices, Draft
from auv_analysis.formats.gazebo import read_gazebo
from auv_analysis.formats.uuv import read_uuv
from auv_analysis.formats.uuv_urdf import uuv_entries
from auv_analysis.formats.xml_text import parse_xml
from auv_dynamics.files import InputError, parse_yaml, read_text

UUV = re.compile(r'hydrodynamic_model|quad_damping|quadratic_damping|^Ma\s*:', re.M)


def read_vehicle(path: Path, format_: str, choices: Choices) -> tuple[str, Draft]:
    """Format and draft of a file of another system.

    Parameters
    ----------
    path : of the file
    format_ : 'uuv', 'gazebo', 'mss', or 'auto' to tell by its contents
    choices : what the user says of it

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    text = read_text(path, 'vehicle')
    found = _told(text, path) if format_ == 'auto' else format_
    is_xml = text.lstrip().startswith('<')
    if found == 'mss':
        return found, read_derivatives(text, path, choices)
    if found == 'gazebo':
        return found, read_gazebo(parse_xml(text, path), path, choices)
    if is_xml:
        data = uuv_entries(parse_xml(text, path), path)
    else:
        data = parse_yaml(text, path, 'uuv_simulator')
    return found, read_uuv(data, path, choices, path.stem)


def _told(text: str, path: Path) -> str:
    if UUV.search(text):
        return 'uuv'
    if text.lstrip().startswith('<'):
        return 'gazebo'
    if any(match[2] for match in ASSIGNED.finditer(text)):
        return 'mss'
    raise InputError(
        path, '', 'a file of a known format, or --format uuv, gazebo or mss', 'neither'
    )
