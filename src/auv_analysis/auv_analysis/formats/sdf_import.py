"""Gazebo: the hydrodynamics plugin of an SDF model, with the link that it acts on.

In Gazebo everything is in the link's frame, forward-left-up; xDotU and xU, xUabsU are derivatives
of SNAME, negative where they oppose (gz-sim, systems/hydrodynamics), yVabsU is lift; a positive
matrix is <fluid_added_mass> of the link. The plugin's C_A has the diagonal of the added mass alone.
"""

import re
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from auv_analysis.formats.imported import POSITIVE, SNAME, Choices, ImportedVehicle
from auv_analysis.formats.xml_parts import displaced, link_inertia, numbers, other_links

ROWS, COLUMNS = 'xyzkmn', 'UVWPQR'
COEFFICIENT = re.compile(r'([xyzkmn])(Dot)?([UVWPQR])(abs)?([UVWPQR])?')
FLUID = 'xyzpqr'  # of <fluid_added_mass>: xx, xy, ... rr
OTHERS = {
    'link_name', 'namespace', 'water_density', 'default_current', 'disable_coriolis',
    'disable_added_mass', 'enable_coriolis', 'lookup_current_x', 'lookup_current_y',
    'lookup_current_z',
}  # fmt: skip


def read_gazebo(root: Element, path: Path, choices: Choices) -> ImportedVehicle:
    """Vehicle of an SDF file; InputError names file, key, expected and found."""
    draft = ImportedVehicle(path, choices)
    plugin = _plugin(root, draft)
    name = (plugin.findtext('link_name') or '').strip()
    model, link = _link(root, plugin, name, draft)
    draft.name = model.get('name') or path.stem
    link_inertia(draft, link, model)
    others = [other for other in model.iter('link') if other is not link]
    other_links(draft, others)
    found = displaced(link, model, path)
    said = 'collision shapes of the link, which Gazebo computes buoyancy from'
    draft.buoyancy(
        None if found is None else (found[0], said), None if found is None else (found[1], said)
    )
    draft.environment(_density(root, plugin, draft), _gravity(root, draft))
    _coefficients(draft, plugin, link)
    _settings(draft, plugin)
    water = [one for one in root.iter('plugin') if 'buoyancy' in str(one.attrib).lower()]
    enabled = [element.text or '' for one in water for element in one.findall('enable')]
    if enabled and not any(model.get('name') in text.strip().split('::') for text in enabled):
        draft.traps.append('enable: Gazebo lets other models float and not this one, we do not')
    return draft


def _is_on(plugin: Element, tag: str) -> bool:
    return (plugin.findtext(tag) or '').strip().lower() in ('true', '1')


def _settings(draft: ImportedVehicle, plugin: Element) -> None:
    """Differences between Gazebo's model under the plugin's settings and a vehicle file."""
    for tag, force in (('disable_added_mass', 'M_A nu_dot'), ('disable_coriolis', 'C_A nu')):
        if _is_on(plugin, tag):
            draft.traps.append(f'{tag}: Gazebo leaves {force} out, we do not')
    for tag in ('default_current', *(f'lookup_current_{axis}' for axis in 'xyz')):
        if (plugin.findtext(tag) or '').strip(' .0\n\t'):
            draft.left_out.append(f'{tag}: a current belongs into a scenario, its axes are NED')


def _plugin(root: Element, draft: ImportedVehicle) -> Element:
    found = [
        plugin
        for plugin in root.iter('plugin')
        if any(COEFFICIENT.fullmatch(str(child.tag)) for child in plugin)
        or 'hydrodynamics' in f'{plugin.get("filename")} {plugin.get("name")}'.lower()
    ]
    if len(found) != 1:
        raise draft.refuse('plugin', 'one plugin with xDotU, xU ...', f'{len(found)} of them')
    return found[0]


def _link(
    root: Element, plugin: Element, name: str, draft: ImportedVehicle
) -> tuple[Element, Element]:
    wanted, models = name.rpartition('::')[2], [*root.iter('model')]
    around = [one for one in models if plugin in one.iter('plugin')]  # the innermost is the last
    for model in [one for outer in around[::-1] for one in outer.iter('model')] or models:
        for link in model.findall('link'):
            if link.get('name') == wanted:
                return model, link
    how = 'write included models out' if models else 'gz sdf -p turns URDF into SDF'
    raise draft.refuse('plugin.link_name', f'a link of this file ({how})', name or None)


def _density(root: Element, plugin: Element, draft: ImportedVehicle) -> tuple[float, str] | None:
    world = ('uniform_fluid_density', 'graded_buoyancy/default_density')
    for element, key in (*((root.find(f'.//{key}'), key) for key in world),
                         (plugin.find('water_density'), 'water_density')):  # fmt: skip
        if element is not None:
            return numbers(element.text, 1, draft.file, key)[0], f'<{key}>'
    return None


def _gravity(root: Element, draft: ImportedVehicle) -> tuple[float, str]:
    element = root.find('.//world/gravity') if root.tag != 'world' else root.find('gravity')
    if element is None:
        return 9.8, "assumed: SDF's default, as no world is given"
    vector = np.array(numbers(element.text, 3, draft.file, 'world.gravity'))
    return float(np.linalg.norm(vector)), '<gravity> of the world'


def _coefficients(draft: ImportedVehicle, plugin: Element, link: Element) -> None:
    added, linear, quadratic, lift = np.zeros((4, 6, 6))
    by_u: list[str] = []
    for child in plugin:
        tag = str(child.tag)
        match = COEFFICIENT.fullmatch(tag)
        if match is None or (match[2] and (match[4] or match[5])) or (match[4] and not match[5]):
            if tag not in OTHERS and isinstance(child.tag, str):
                draft.cannot_hold(tag, 'no parameter of the hydrodynamics plugin')
            continue
        if plugin.find(tag) is not child:
            raise draft.refuse(tag, 'each coefficient once', 'again')
        value = numbers(child.text, 1, draft.file, tag)[0]
        i, j = ROWS.index(match[1]), COLUMNS.index(match[3])
        if match[2]:
            added[i, j] = value
        elif not match[5]:
            linear[i, j] = value
        elif value and 'U' in (match[3], match[5]) and match[3] != match[5]:
            if match[4] and match[5] != 'U':
                draft.cannot_hold(tag, 'u times the absolute value of another velocity')
                continue
            lift[i, COLUMNS.index(match[5]) if match[3] == 'U' else j] += value
            by_u += [] if match[4] else [tag]
        elif value:
            _quadratic(draft, quadratic, tag, (i, j, match[5], bool(match[4])), value)
    M_A, convention, said = _added_mass(draft, plugin, link, added)
    if convention == SNAME:  # the sign that is told is the plugin's
        M_A = draft.positive('added_mass', M_A, convention, said)
    draft.put('added_mass', draft.from_flu('added_mass', M_A), said)
    for key, A, said in (('linear', linear, 'xU ... nR'), ('quadratic', quadratic, 'xUabsU ...')):
        name = f'damping.{key}'
        D = draft.positive(name, A, SNAME, said)
        draft.put(name, draft.from_flu(name, D), f'{said} of the plugin')
    if np.any(lift):
        said = 'yVabsU ... of the plugin'
        draft.put('lift', draft.from_flu('lift', draft.positive('lift', lift, SNAME, said)), said)
        draft.lift_by_abs_u(by_u)
    draft.traps.append(
        'C_A: Gazebo takes it from the diagonal of xDotU ... alone (before 2026 with two wrong '
        'elements); here C follows from the whole of M'
    )


def _quadratic(
    draft: ImportedVehicle, A: np.ndarray, tag: str, place: tuple[int, int, str, bool], value: float
) -> None:
    i, j, other, is_abs = place
    if other != COLUMNS[j]:
        draft.cannot_hold(tag, 'a product of two different velocities')
        return
    if not is_abs:
        if not draft.choices.quadratic_abs:
            expected = f'{tag[:2]}abs{tag[2]}, or --quadratic-abs if that is meant'
            raise draft.refuse(tag, expected, f'{value:g}, which newer Gazebo takes without abs')
        draft.traps.append(f'{tag}: taken for {tag[:2]}abs{tag[2]}, as asked')
    A[i, j] += value


def _added_mass(
    draft: ImportedVehicle, plugin: Element, link: Element, added: np.ndarray
) -> tuple[np.ndarray, str, str]:
    """Matrix as given, the sign convention that it follows, and where it stands."""
    is_off = _is_on(plugin, 'disable_added_mass')
    fluid = link.find('inertial/fluid_added_mass')
    if fluid is None:
        return added, SNAME, 'xDotU ... nDotR of the plugin'
    if np.any(added) and not is_off:
        expected = 'added mass once, in the plugin or in the link'
        raise draft.refuse('fluid_added_mass', expected, 'both: Gazebo counts it twice')
    M_A = np.zeros((6, 6))
    for child in fluid:
        tag = str(child.tag)
        if len(tag) != 2 or tag.strip(FLUID):
            raise draft.refuse(f'fluid_added_mass.{tag}', 'xx, xy ... rr', tag)
        i, j = (FLUID.index(letter) for letter in tag)
        M_A[i, j] = M_A[j, i] = numbers(child.text, 1, draft.file, f'fluid_added_mass.{tag}')[0]
    draft.traps.append('fluid_added_mass: positive there, unlike xDotU ...: taken as it is')
    return M_A, POSITIVE, '<fluid_added_mass> of the link'
