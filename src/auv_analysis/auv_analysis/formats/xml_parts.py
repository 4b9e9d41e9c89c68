"""XML that nobody has to trust, and what SDF and URDF share: bodies, poses, collision shapes."""

import re
from collections.abc import Mapping
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

import defusedxml.ElementTree
import numpy as np
from defusedxml.common import DefusedXmlException

from auv_analysis.formats.imported import ImportedVehicle
from auv_dynamics.files.errors import InputError, first_line
from auv_dynamics.files.yaml_files import LARGEST, LONGEST_TEXT, MOST_ENTRIES
from auv_dynamics.vehicle.kinematics import quaternion, rotation

# SDF has prefixes that nobody declares, such as <experimental:params> or gz:expressed_in="..."
PREFIX = re.compile(r'(</?|\s(?!xmlns:)(?=[\w.:-]+=))([A-Za-z_][\w.-]*):(?=[A-Za-z_])')


def parse_xml(text: str, path: Path) -> Element:
    """Root element of a text; a prefix of a name ends in an underscore.

    Parameters
    ----------
    text : of the file
    path : named in errors

    Raises
    ------
    InputError : no XML, too large, or with a document type or entities of its own

    """
    if len(text) > LONGEST_TEXT:
        expected = f'XML of at most {LONGEST_TEXT} characters'
        raise InputError(path, '', expected, f'{len(text)} characters')
    try:
        root = defusedxml.ElementTree.fromstring(PREFIX.sub(r'\1\2_', text), forbid_dtd=True)
    except DefusedXmlException as error:
        found = f'a {type(error).__name__.removesuffix("Forbidden")}'
        raise InputError(path, '', 'XML without document type and entities', found) from None
    except (ParseError, ValueError) as error:
        raise InputError(path, '', 'valid XML', first_line(error)) from None
    for count, element in enumerate(root.iter()):
        if count >= MOST_ENTRIES:
            raise InputError(path, '', f'at most {MOST_ENTRIES} elements', 'more')
        if isinstance(element.tag, str):
            element.tag = element.tag.rpartition('}')[2]
    return root


def numbers(text: str | None, count: int, path: object, key: str) -> list[float]:
    """So many finite numbers of a text; InputError where it holds anything else."""
    words = (text or '').split()
    try:
        found = [float(word) for word in words]
    except ValueError:
        found = []
    if len(found) != count or not all(abs(value) <= LARGEST for value in found):
        expected = 'a number' if count == 1 else f'{count} numbers'
        hint = ' (expand xacro first)' if '${' in (text or '') else ''
        raise InputError(path, key, expected + hint, text or None)
    return found


Pose = tuple[np.ndarray, np.ndarray]  # position (3,) in m, rotation (3, 3) to the outer frame
SAME: Pose = (np.zeros(3), np.eye(3))
MODEL = '__model__'
LONGEST_CHAIN = 100  # links, joints and frames, each relative to the next


def pose_in_link(element: Element, link: Element, model: Element, path: object, key: str) -> Pose:
    """Pose of a part of a link in the frame of the link, whatever frame it is given in.

    Parameters
    ----------
    element : has a <pose>, or none: that of the link
    link, model : the link, and the model whose links, joints and frames poses may be relative to
    path, key : named in errors

    Raises
    ------
    InputError : a frame that the model does not have, or frames in a circle or a long chain

    """
    frame, inner = _pose_of(element, path, key)
    if frame in ('', link.get('name')):
        return inner
    p, R = _chained(_in_model(frame, model, path, key), inner)
    origin, axes = _in_model(link.get('name', ''), model, path, key)
    return axes.T @ (p - origin), axes.T @ R


def _pose_of(element: Element, path: object, key: str) -> tuple[str, Pose]:
    """Name of the frame that <pose> is relative to, empty for the usual one, and the pose."""
    pose = element.find('pose')
    if pose is None:
        return '', SAME
    values = np.array(numbers(pose.text or '0 0 0 0 0 0', 6, path, f'{key}.pose'))
    angles = np.radians(values[3:]) if pose.get('degrees') in ('true', '1') else values[3:]
    return pose.get('relative_to', ''), (values[:3], rotation(quaternion(angles)))


def _chained(outer: Pose, inner: Pose) -> Pose:
    return outer[0] + outer[1] @ inner[0], outer[1] @ inner[1]


def _in_model(name: str, model: Element, path: object, key: str, behind: int = 0) -> Pose:
    """Pose of a link, joint or frame of a model in its frame; `behind`: so many that led there."""
    if name == MODEL:
        return SAME
    named = [e for tag in ('link', 'joint', 'frame') for e in model.findall(tag)]
    found = [e for e in named if e.get('name') == name]
    if len(found) != 1 or behind == LONGEST_CHAIN:
        why = 'not one of them' if len(found) != 1 else f'in a circle or behind {behind} others'
        expected = 'a pose relative to a link, joint or frame of this model'
        raise InputError(path, f'{key}.pose', expected, f'{name}, {why}')
    usual = {'joint': found[0].findtext('child', '').strip(), 'frame': found[0].get('attached_to')}
    frame, inner = _pose_of(found[0], path, f'{found[0].tag} {name}')
    outer = frame or usual.get(str(found[0].tag)) or MODEL
    return _chained(_in_model(outer, model, path, key, behind + 1), inner)


def displaced(link: Element, model: Element, path: Path) -> tuple[float, np.ndarray] | None:
    """Volume in m3 and its centre (3,) in the link's frame; None where a shape has none of its own.

    Parameters
    ----------
    link, model : of SDF
    path : named in errors

    """
    total, moment = 0.0, np.zeros(3)
    for collision in link.findall('collision'):
        key = f'link.collision {collision.get("name", "")}'.rstrip()
        shape = collision.find('geometry')
        volume = _volume(shape, path, key) if shape is not None else None
        if volume is None:
            return None
        total += volume
        moment += volume * pose_in_link(collision, link, model, path, key)[0]
    return (total, moment / total) if total > 0 else None


def _volume(geometry: Element, path: Path, key: str) -> float | None:
    def get(tag: str, count: int = 1) -> list[float]:
        return numbers(geometry.findtext(tag), count, path, f'{key}.{tag}')

    if geometry.find('box') is not None:
        return float(np.prod(get('box/size', 3)))
    if geometry.find('sphere') is not None:
        return 4 / 3 * np.pi * get('sphere/radius')[0] ** 3
    if geometry.find('cylinder') is not None:
        return np.pi * get('cylinder/radius')[0] ** 2 * get('cylinder/length')[0]
    if geometry.find('capsule') is not None:
        radius, length = get('capsule/radius')[0], get('capsule/length')[0]
        return np.pi * radius**2 * (length + 4 / 3 * radius)
    if geometry.find('ellipsoid') is not None:
        return 4 / 3 * np.pi * float(np.prod(get('ellipsoid/radii', 3)))
    return None


TURNED = 'link.inertial.pose: the tensor is turned into the axes of the link'
ENTRIES = ('ixx', 'ixy', 'ixz', 'iyy', 'iyz', 'izz')


def inertia_entries(
    texts: Mapping[str, str], R: np.ndarray, path: object, key: str
) -> tuple[list[float], list[str]]:
    """Entries ixx ... izz of a tensor in the axes of its link, and a note where R turns it."""
    xx, xy, xz, yy, yz, zz = (
        numbers(texts.get(name, '0'), 1, path, f'{key}.{name}')[0] for name in ENTRIES
    )
    turned = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
    entries = [float(turned[i, j]) for i in range(3) for j in range(i, 3)]
    return entries, [TURNED] * bool(np.any(np.eye(3) != R))


def put_rigid_body(
    draft: ImportedVehicle, mass: float, r_G: np.ndarray, entries: list[float], said: str
) -> None:
    """Put what is given in FLU: kg, (3,) m, ixx ixy ixz iyy iyz izz of the tensor about cg."""
    xx, xy, xz, yy, yz, zz = entries
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    draft.put('rigid_body.mass', mass, said)
    draft.point_from_flu('rigid_body.center_of_gravity', r_G, said)
    if np.any(tensor - np.diag(np.diagonal(tensor))):
        draft.traps.append(
            'rigid_body.inertia: ixy, ixz, iyz are entries of the tensor, minus the products of '
            'inertia: taken as they are'
        )
    turned = draft.from_flu('rigid_body.inertia', tensor)
    draft.put('rigid_body.inertia', turned, f'{said}, about the centre of gravity')
    draft.values['rigid_body.inertia_reference'] = 'cg'


def mass_of(body: Element) -> str:
    """Text of the mass of an <inertial> or a link, of URDF or SDF."""
    mass = body.find('mass' if body.tag == 'inertial' else 'inertial/mass')
    return '' if mass is None else mass.get('value') or mass.text or ''


def other_links(draft: ImportedVehicle, others: list[Element]) -> None:
    """Say what links of a model, be they fixed to that of the vehicle, are left out with it."""
    total = sum(
        numbers(text, 1, draft.file, 'link.mass')[0] for text in map(mass_of, others) if text
    )
    if others:
        draft.assumed.append(
            f'{len(others)} other links of the model are no part of the vehicle: {total:g} kg'
        )


def link_inertia(draft: ImportedVehicle, link: Element, model: Element) -> None:
    """Put mass, centre of gravity and tensor of a link of an SDF model."""
    inertial = link.find('inertial')
    if inertial is None or inertial.find('mass') is None:
        raise draft.refuse('link.inertial.mass', 'a number (kg)', None)
    path, key = draft.file, 'link.inertial'
    if inertial.get('auto') in ('true', '1'):
        expected = 'numbers that count, and no auto: Gazebo takes those of the collision shapes'
        raise draft.refuse(f'{key}.auto', expected, inertial.get('auto'))
    mass = numbers(inertial.findtext('mass'), 1, path, f'{key}.mass')[0]
    r_G, R = pose_in_link(inertial, link, model, path, key)
    texts = {name: inertial.findtext(f'inertia/{name}', '0') for name in ENTRIES}
    entries, traps = inertia_entries(texts, R, path, key)
    draft.traps += traps
    put_rigid_body(draft, mass, r_G, entries, '<inertial> of the link')
