"""Volumes and centres of the collision shapes of SDF, which Gazebo's buoyancy is computed from."""

from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from auv_analysis.formats.xml_text import numbers


def pose_of(element: Element, path: object, key: str) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,) in m and roll, pitch, yaw (3,) in rad of <pose>; zero where there is none."""
    pose = element.find('pose')
    if pose is None:
        return np.zeros(3), np.zeros(3)
    values = np.array(numbers(pose.text, 6, path, f'{key}.pose'))
    angles = np.radians(values[3:]) if pose.get('degrees') in ('true', '1') else values[3:]
    return values[:3], angles


def displaced(link: Element, path: Path) -> tuple[float, np.ndarray] | None:
    """Volume in m3 and its centre (3,) in the link's frame; None where a shape has none of its own.

    Parameters
    ----------
    link : of an SDF model
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
        moment += volume * pose_of(collision, path, key)[0]
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
