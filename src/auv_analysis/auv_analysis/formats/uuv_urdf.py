"""uuv_simulator: the YAML files of its vehicles and URDF with <hydrodynamic_model>."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from auv_analysis.formats.imported import POSITIVE, SNAME, Choices, ImportedVehicle
from auv_analysis.formats.xml_parts import (
    ENTRIES,
    inertia_entries,
    mass_of,
    numbers,
    pose_in_link,
    put_rigid_body,
)
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.kinematics import quaternion, rotation

ALIASES = {
    'Ma': 'added_mass', 'quad_damping': 'quadratic_damping', 'cog': 'center_of_gravity',
    'cob': 'center_of_buoyancy', 'density': 'fluid_density', 'inertia': 'inertial',
}  # fmt: skip
OTHERS = {'model', 'type', 'base_link', 'length', 'width', 'height', 'box', 'name', 'model_name'}
SHAPES = {'sphere', 'cylinder', 'spheroid', 'box'}
NEUTRAL = {  # scalings and offsets that change nothing
    'scaling_added_mass': 1.0, 'scaling_damping': 1.0, 'scaling_volume': 1.0,
    'offset_added_mass': 0.0, 'offset_linear_damping': 0.0, 'offset_volume': 0.0,
    'offset_lin_forward_speed_damping': 0.0, 'offset_nonlin_damping': 0.0,
}  # fmt: skip
DENSITY, GRAVITY = 1028.0, 9.81  # its defaults


def read_uuv(data: Mapping[str, Any], file: object, choices: Choices, name: str) -> ImportedVehicle:
    """Vehicle of the contents of a file; InputError names file, key, expected and found."""
    draft = ImportedVehicle(file, choices, str(data.get('model', data.get('model_name', name))))
    given = _gathered(data, draft)
    mass = _numbers(draft, given, 'mass', 1)[0]
    tensor = given.get('inertial', {})
    entries = [
        _numbers(draft, {key: tensor.get(key, 0.0)}, key, 1)[0] if isinstance(tensor, dict) else 0.0
        for key in ENTRIES
    ]
    r_G = np.array(_numbers(draft, given, 'center_of_gravity', 3, [0.0] * 3))
    put_rigid_body(draft, mass, r_G, entries, 'inertial')
    density = _numbers(draft, given, 'fluid_density', 1, [DENSITY])[0]
    if 'fluid_density' not in given and choices.water_density is None:
        draft.assumed.append(f'environment.water_density: {DENSITY:g} kg/m3, its default')
    gravity = _numbers(draft, given, 'gravity', 1, [GRAVITY])[0]
    said = 'gravity' if 'gravity' in given else 'assumed: its default'
    draft.environment((density, 'fluid_density'), (gravity, said))
    point = given.get('center_of_buoyancy')
    centre = None if point is None else _numbers(draft, given, 'center_of_buoyancy', 3)
    draft.buoyancy(
        _volume(draft, given, mass), None if centre is None else (centre, 'center_of_buoyancy')
    )
    _matrices(draft, given)
    return draft


def _gathered(data: Mapping[str, Any], draft: ImportedVehicle) -> dict[str, Any]:
    """Entries of the file and of its hydrodynamic_model by their names in URDF."""
    found: dict[str, Any] = {}
    for key, value in _entries(data):
        name = ALIASES.get(key, key)
        if name in NEUTRAL:
            if _numbers(draft, {key: value}, key, 1)[0] != NEUTRAL[name]:
                raise draft.refuse(key, f'{NEUTRAL[name]:g}', value)
        elif name == 'type' and str(value).strip().lower() in SHAPES:
            raise draft.refuse(key, 'fossen: of a shape its coefficients are computed', value)
        elif name in KNOWN:
            if name in found:
                raise draft.refuse(key, 'each entry once', 'again')
            found[name] = value
        elif name not in OTHERS:
            draft.cannot_hold(key, 'no entry of a vehicle of uuv_simulator')
    return found


KNOWN = {
    'mass', 'inertial', 'center_of_gravity', 'center_of_buoyancy', 'volume', 'fluid_density',
    'gravity', 'neutrally_buoyant', 'added_mass', 'linear_damping', 'quadratic_damping',
    'linear_damping_forward_speed',
}  # fmt: skip


def _entries(data: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, value in data.items():
        if key == 'hydrodynamic_model' and isinstance(value, Mapping):
            yield from value.items()
        else:
            yield key, value


def _flat(value: Any) -> list[str]:
    if isinstance(value, list | tuple):
        return [word for entry in value for word in _flat(entry)]
    return str(value).split()


def _numbers(
    draft: ImportedVehicle, given: Mapping[str, Any], key: str, count: int, default: Any = None
) -> list[float]:
    """So many numbers, from a list, nested lists or a text."""
    if key not in given and default is not None:
        return default
    text = ' '.join(_flat(given[key])) if key in given else None
    return numbers(text, count, draft.file, key)


def _matrix(draft: ImportedVehicle, given: Mapping[str, Any], key: str) -> np.ndarray:
    if key not in given:
        return np.zeros((6, 6))
    if len(_flat(given[key])) == 6:
        return np.diag(_numbers(draft, given, key, 6))
    return np.array(_numbers(draft, given, key, 36)).reshape(6, 6)


def _volume(
    draft: ImportedVehicle, given: Mapping[str, Any], mass: float
) -> tuple[float, str] | None:
    if str(given.get('neutrally_buoyant', 0)).strip().lower() in ('1', 'true'):
        density = draft.values['environment.water_density']
        draft.traps.append('neutrally_buoyant: the volume is that of W = B, not the one given')
        return mass / density, 'neutrally_buoyant: mass / density'
    if 'volume' not in given:
        return None
    return _numbers(draft, given, 'volume', 1)[0], 'volume'


def _matrices(draft: ImportedVehicle, given: Mapping[str, Any]) -> None:
    for key, name, convention in (
        ('added_mass', 'added_mass', POSITIVE),
        ('damping.linear', 'linear_damping', SNAME),
        ('damping.quadratic', 'quadratic_damping', SNAME),
    ):
        A = _matrix(draft, given, name)
        if name == 'quadratic_damping' and np.any(A - np.diag(np.diagonal(A))):
            draft.left_out.append(f'{name}: what is off its diagonal, which uuv_simulator ignores')
            A = np.diag(np.diagonal(A))
        draft.put(key, draft.positive(key, A, convention, name), name)
    forward = 'linear_damping_forward_speed'
    if forward in given and np.any(A := _matrix(draft, given, forward)):
        draft.put('lift', draft.positive('lift', A, SNAME, forward), forward)
        draft.lift_by_abs_u([forward])
    draft.traps.append(
        'added_mass, damping: they act on velocities that uuv_simulator has turned to FSD, unlike '
        'the inertia: not turned again'
    )


def uuv_entries(root: Element, path: Path) -> tuple[dict[str, Any], list[Element], list[str]]:
    """Entries of the one link with <hydrodynamic_model> and its body, other bodies, what was done.

    Parameters
    ----------
    root : of a URDF, expanded by xacro, or of SDF; the body is the link of the same name
    path : named in errors

    """
    links = [link for link in root.iter('link') if link.find('hydrodynamic_model') is not None]
    if len(links) != 1:
        expected = 'one link with <hydrodynamic_model>'
        raise InputError(path, 'hydrodynamic_model', expected, f'{len(links)} of them')
    wet = links[0]
    model = [root, *(one for one in root.iter('model') if wet in one.iter('link'))][-1]
    entries: dict[str, Any] = {'model': model.get('name') or path.stem}
    for child in wet:
        if child.tag == 'hydrodynamic_model':
            entries['hydrodynamic_model'] = {str(part.tag): part.text or '' for part in child}
        elif child.tag != 'box':
            entries[str(child.tag)] = child.text or ''
    density = root.find('.//fluid_density')
    if density is not None:
        entries['fluid_density'] = density.text or ''
    bodies = [link for link in model.iter('link') if link.find('inertial') is not None]
    named = [link for link in bodies if link.get('name') == wet.get('name', '')]
    if not named:
        name = wet.get('name') or 'without name'
        expected = f'<inertial> of the link {name}, with xacro expanded'
        raise InputError(path, 'inertial', expected, None)
    others = [link for link in bodies if link is not named[0]]
    body, done = _inertial(named[0], model, path)
    return entries | body, others, done


def _inertial(link: Element, model: Element, path: Path) -> tuple[dict[str, Any], list[str]]:
    found = link.find('inertial')
    assert found is not None
    origin, inertia = found.find('origin'), found.find('inertia')
    if origin is None:
        point, R = pose_in_link(found, link, model, path, 'inertial')  # of SDF
    else:
        point, rpy = (
            np.array(numbers(origin.get(name, '0 0 0'), 3, path, f'inertial.origin.{name}'))
            for name in ('xyz', 'rpy')
        )
        R = rotation(quaternion(rpy))
    parts = {} if inertia is None else {str(part.tag): part.text or '' for part in inertia}
    texts = parts if inertia is None else parts | dict(inertia.attrib)
    entries, traps = inertia_entries(texts, R, path, 'inertial')
    body = {
        'mass': mass_of(found),
        'center_of_gravity': point.tolist(),
        'inertial': dict(zip(ENTRIES, entries, strict=True)),
    }
    return body, traps
