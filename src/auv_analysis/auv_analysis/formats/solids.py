"""Poses of SDF, and its collision shapes, which Gazebo's buoyancy is computed from."""

from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from auv_analysis.formats.xml_text import numbers
from auv_dynamics.files import InputError
from auv_dynamics.kinematics import quaternion, rotation

Pose = tuple[np.ndarray, np.ndarray]  # position (3,) in m, rotation (3, 3) to the outer frame
SAME: Pose = (np.zeros(3), np.eye(3))
MODEL = '__model__'


def pose_in_link(element: Element, link: Element, model: Element, path: object, key: str) -> Pose:
    """Pose of a part of a link in the frame of the link, whatever frame it is given in.

    Parameters
    ----------
    element : has a <pose>, or none: that of the link
    link, model : the link, and the model whose links, joints and frames poses may be relative to
    path, key : named in errors

    Raises
    ------
    InputError : a frame that the model does not have, or frames that go in a circle

    """
    frame, inner = _pose_of(element, path, key)
    if frame in ('', link.get('name')):
        return inner
    p, R = _chained(_in_model(frame, model, path, key, ()), inner)
    origin, axes = _in_model(link.get('name', ''), model, path, key, ())
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


def _in_model(name: str, model: Element, path: object, key: str, seen: tuple[str, ...]) -> Pose:
    """Pose of a link, joint or frame of a model in the frame of the model."""
    if name == MODEL:
        return SAME
    named = [e for tag in ('link', 'joint', 'frame') for e in model.findall(tag)]
    found = [e for e in named if e.get('name') == name]
    if len(found) != 1 or name in seen:
        why = 'in a circle' if name in seen else 'not one of them'
        expected = 'a pose relative to a link, joint or frame of this model'
        raise InputError(path, f'{key}.pose', expected, f'{name}, {why}')
    usual = {'joint': found[0].findtext('child', '').strip(), 'frame': found[0].get('attached_to')}
    frame, inner = _pose_of(found[0], path, f'{found[0].tag} {name}')
    outer = frame or usual.get(str(found[0].tag)) or MODEL
    return _chained(_in_model(outer, model, path, key, (*seen, name)), inner)


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
