"""Mass, centre of gravity and tensor of a link, as SDF and URDF write them."""

from xml.etree.ElementTree import Element

import numpy as np

from auv_analysis.formats.draft import Draft
from auv_analysis.formats.solids import pose_in_link
from auv_analysis.formats.xml_text import numbers

ENTRIES = ('ixx', 'ixy', 'ixz', 'iyy', 'iyz', 'izz')


def put_rigid_body(
    draft: Draft, mass: float, r_G: np.ndarray, entries: list[float], said: str
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


def link_inertia(draft: Draft, link: Element, model: Element) -> None:
    """Put mass, centre of gravity and tensor of a link of an SDF model."""
    inertial = link.find('inertial')
    if inertial is None or inertial.find('mass') is None:
        raise draft.refuse('link.inertial.mass', 'a number (kg)', None)
    path, key = draft.file, 'link.inertial'
    mass = numbers(inertial.findtext('mass'), 1, path, f'{key}.mass')[0]
    r_G, R = pose_in_link(inertial, link, model, path, key)
    entries = [
        numbers(inertial.findtext(f'inertia/{name}', '0'), 1, path, f'{key}.{name}')[0]
        for name in ENTRIES
    ]
    if np.any(np.eye(3) != R):
        draft.traps.append('link.inertial.pose: the tensor is turned into the axes of the link')
        xx, xy, xz, yy, yz, zz = entries
        turned = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
        entries = [float(turned[i, j]) for i in range(3) for j in range(i, 3)]
    put_rigid_body(draft, mass, r_G, entries, '<inertial> of the link')
