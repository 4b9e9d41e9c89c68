"""URDF with the underwater plugin of uuv_simulator, as the entries of its YAML files."""

from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from auv_analysis.formats.xml_text import numbers
from auv_dynamics.files import InputError


def uuv_entries(root: Element, path: Path) -> dict[str, Any]:
    """Entries of the one link with <hydrodynamic_model>, and of the URDF link of that name.

    Parameters
    ----------
    root : of a URDF, expanded by xacro
    path : named in errors

    """
    links = [link for link in root.iter('link') if link.find('hydrodynamic_model') is not None]
    if len(links) != 1:
        expected = 'one link with <hydrodynamic_model>'
        raise InputError(path, 'hydrodynamic_model', expected, f'{len(links)} of them')
    wet = links[0]
    entries: dict[str, Any] = {'model': root.get('name') or path.stem}
    for child in wet:
        if child.tag == 'hydrodynamic_model':
            entries['hydrodynamic_model'] = {str(part.tag): part.text or '' for part in child}
        elif child.tag != 'box':
            entries[str(child.tag)] = child.text or ''
    density = root.find('.//fluid_density')
    if density is not None:
        entries['fluid_density'] = density.text or ''
    return entries | _inertial(root, wet.get('name', ''), path)


def _inertial(root: Element, name: str, path: Path) -> dict[str, Any]:
    named = (link for link in root.iter('link') if link.get('name') == name)
    found = next((part for link in named if (part := link.find('inertial')) is not None), None)
    if found is None:
        expected = f'<inertial> of the link {name or "without name"}, with xacro expanded'
        raise InputError(path, 'inertial', expected, None)
    mass, origin, inertia = (found.find(tag) for tag in ('mass', 'origin', 'inertia'))
    if origin is not None and any(numbers(origin.get('rpy', '0 0 0'), 3, path, 'inertial.origin')):
        raise InputError(path, 'inertial.origin', 'rpy="0 0 0"', origin.get('rpy'))
    return {
        'mass': '' if mass is None else mass.get('value', ''),
        'center_of_gravity': '0 0 0' if origin is None else origin.get('xyz', '0 0 0'),
        'inertial': {} if inertia is None else dict(inertia.attrib),
    }
