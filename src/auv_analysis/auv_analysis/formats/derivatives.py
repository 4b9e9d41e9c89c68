"""Lists of derivatives as papers and MATLAB files give them: Xudot = -5.5, X_{u|u|} = -18.2, ...

Fossen's conventions: FSD, derivatives of SNAME. What a list cannot say for itself (the sign of
products of inertia, the point of the tensor, whether Nuv has the Munk moment in it) is asked for.
"""

import re
from pathlib import Path

import numpy as np

from auv_analysis.formats.imported import SNAME, Choices, ImportedVehicle
from auv_dynamics.files.yaml_files import LARGEST
from auv_dynamics.vehicle.vehicle import munk_terms

NUMBER = r'[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?'
ASSIGNED = re.compile(rf'([A-Za-z][\w{{}}|\\\']*)\s*[=:]\s*({NUMBER})?')
# what may follow a number: its SI unit, then the end, a separator or the next name
PART = r'(?:kg|N|m(?!m)|s|rad)'
SI = rf'{PART}(?:[ ./*^·()\-\d²³]*{PART})*[\^()\-\d²³]*'
UNIT = rf'(?:\[\s*(?:{SI}|[-1])?\s*\]|\((?!(?:mm|cm|km|g|lb|deg)\b)[^)]*\)|{SI})'
FOLLOWS = re.compile(rf"\s*{UNIT}?\s*(?:$|[;,&|\\](?!\d)|(?=[A-Za-z][\w{{}}|\\']*\s*[=:]))")
BRACED = re.compile(r'\{[^=]*\}')  # X_{\dot u}
BLOCK = re.compile(r'^[ \t]*%\{[ \t]*$.*?^[ \t]*%\}[ \t]*$', re.M | re.S)  # of comments
COMMENT = re.compile(r'(%|#|//).*')
ADDED = re.compile(r'([XYZKMN])(?:([uvwpqr])dot|dot([uvwpqr]))')
DAMPING = re.compile(r'([XYZKMN])([uvwpqr])([uvwpqr])?')
COEFFICIENT = re.sub(r'\((?!\?)', '(?:', f'{ADDED.pattern}|{DAMPING.pattern}')
NAME = rf'(?:{COEFFICIENT}|I[xyz]{{1,2}}|[xyz][GBgb]|rho)'
UNREAD = re.compile(rf'(?<![\w.])({NAME})[\s&|]+{NUMBER}')  # a row of a table
SURFACE = re.compile(r'[XYZKMN]uu(?:d|delta)[a-z]*')  # Yuudr: an input
ABSOLUTE = re.compile(r'abs([uvwpqr])')
ROWS, COLUMNS = 'XYZKMN', 'uvwpqr'
SCALARS = {
    'mass': 'm', 'Ixx': 'Ix', 'Iyy': 'Iy', 'Izz': 'Iz', 'volume': 'V', 'nabla': 'V', 'Vol': 'V',
}  # fmt: skip
KNOWN = {'m', 'W', 'B', 'V', 'g', 'rho', 'Ix', 'Iy', 'Iz', 'Ixy', 'Ixz', 'Iyz',
         'xG', 'yG', 'zG', 'xB', 'yB', 'zB'}  # fmt: skip
APART = 0.005  # relative, beyond which m g and W are two different numbers
GRAVITY, FRESH = 9.81, 1000.0


def read_derivatives(text: str, path: Path, choices: Choices) -> ImportedVehicle:
    """Vehicle of a list; InputError names file, key, expected and found."""
    draft = ImportedVehicle(path, choices, path.stem)
    scalars: dict[str, float] = {}
    matrices = np.zeros((4, 6, 6))
    lifting: list[str] = []
    for name, value in _assignments(text, draft):
        plain = re.sub(r"[_{}|\\']|abs", '', name)
        scalar = re.sub(r'^([xyz])([gb])$', lambda m: m[1] + m[2].upper(), plain)
        scalar = SCALARS.get(scalar, scalar)
        if "'" in name:
            raise draft.refuse(name, 'a coefficient with a dimension', 'a prime')
        if scalar in KNOWN:
            if scalars.setdefault(scalar, value) != value:
                raise draft.refuse(name, f'{scalars[scalar]:g} as by another name', value)
        elif SURFACE.fullmatch(plain):
            draft.left_out.append(f'{name}: of a control surface, which is an input')
        elif not _placed(draft, matrices, name, plain, value):
            draft.cannot_hold(name, 'no name of a coefficient')
        elif value and _is_by_u(plain):
            lifting.append(name)
    draft.assumed.append('all numbers are in SI units and FSD axes, coefficients with dimensions')
    _body(draft, scalars)
    names = ('added_mass', 'damping.linear', 'damping.quadratic')
    said = ('Xudot ... Nrdot', 'Xu ... Nr', 'Xuu ... Nrr')
    for key, A, where in zip(names, matrices[:3], said, strict=True):
        draft.put(key, draft.positive(key, A, SNAME, where), where)
    if lifting:
        _lift(draft, matrices[3], lifting)
    return draft


def _is_by_u(plain: str) -> bool:
    """Whether a name is that of a product of u and another velocity."""
    match = DAMPING.fullmatch(plain)
    return bool(match and match[3] and match[2] != match[3] and 'u' in (match[2], match[3]))


def _lift(draft: ImportedVehicle, derivatives: np.ndarray, names: list[str]) -> None:
    """Put the lift; combined derivatives without what C has of the added mass."""
    lift = draft.positive('lift', derivatives, SNAME, 'Yuv ... Nur')
    water = munk_terms(draft.values['added_mass']) * (derivatives != 0)
    if np.any(water) and draft.choices.lift is None:
        expected = '--lift alone (of body and fins) or combined (with the terms of added mass, as '
        expected += 'the Munk moment in Nuv): the list cannot say'
        raise draft.refuse(', '.join(names), expected, 'added mass that adds to them')
    if draft.choices.lift == 'combined':
        draft.traps.append(f'{", ".join(names)}: the terms of added mass are taken out, C has them')
        lift = lift + water
    draft.put('lift', lift, 'Yuv ... Nur')
    draft.lift_by_abs_u([name for name in names if '|' not in name and 'abs' not in name])


def _assignments(text: str, draft: ImportedVehicle) -> list[tuple[str, float]]:
    found, seen = [], set()
    for line in BLOCK.sub('', text).splitlines():
        bare = COMMENT.sub('', line).replace('$', '')
        bare = BRACED.sub(lambda braced: braced[0].replace(' ', ''), bare)
        if unread := UNREAD.search(re.sub(r'[_{}\\]', '', bare)):
            raise draft.refuse(unread[1], f'{unread[1]} = a number', line.strip())
        for match in ASSIGNED.finditer(bare):
            name = match[1]
            told = match[2] is not None and abs(float(match[2])) <= LARGEST
            told = told and not bare[: match.start()].rstrip().endswith(('-', '\N{MINUS SIGN}'))
            if not told or not FOLLOWS.match(bare, match.end()):
                expected = 'a number, and nothing behind it but its SI unit'
                raise draft.refuse(name, expected, line.strip())
            if name in seen:
                raise draft.refuse(name, 'each name once', 'again')
            seen.add(name)
            found.append((name, float(match[2])))
    return found


def _placed(
    draft: ImportedVehicle, matrices: np.ndarray, name: str, plain: str, value: float
) -> bool:
    """Put a coefficient in its matrix; False where its name is none."""
    added, linear, quadratic, lift = matrices

    def put(A: np.ndarray, i: int, j: int) -> None:
        if A[i, j] and A[i, j] != value:
            raise draft.refuse(name, f'{A[i, j]:g} as by another name', value)
        A[i, j] = value

    if match := ADDED.fullmatch(plain):
        put(added, ROWS.index(match[1]), COLUMNS.index(match[2] or match[3]))
        return True
    match = DAMPING.fullmatch(plain)
    if match is None:
        return False
    i, j = ROWS.index(match[1]), COLUMNS.index(match[2])
    if match[3] is None:
        put(linear, i, j)
    elif _is_by_u(plain):
        other = match[3] if match[2] == 'u' else match[2]
        if value and f'|{other}|' in ABSOLUTE.sub(r'|\1|', name):
            draft.cannot_hold(name, 'u times the absolute value of another velocity')
        else:
            put(lift, i, COLUMNS.index(other))
    elif match[3] != match[2]:
        if value:
            draft.cannot_hold(name, 'a product of two different velocities')
    else:
        if '|' not in name and 'abs' not in name and value:
            draft.assumed.append(f'{name}: multiplies the velocity and its absolute value')
        put(quadratic, i, j)
    return True


def _body(draft: ImportedVehicle, given: dict[str, float]) -> None:
    """Mass, tensor, centres, water: W = m g and B = rho g V tie them together."""
    choices = draft.choices
    for key in ('m', 'W'):
        if key in given:
            draft.above_zero(key, given[key])
    if choices.swap_weight_buoyancy:
        given['W'], given['B'] = (_needed(draft, given, key) for key in 'BW')
        draft.traps.append('W, B: swapped, as asked')
    if 'g' in given:
        gravity = given['g'], 'g'
    elif 'W' in given and 'm' in given and abs(given['W'] / given['m'] / GRAVITY - 1) < APART:
        gravity = given['W'] / given['m'], 'W / m'
    else:
        gravity = GRAVITY, 'assumed'
    g = gravity[0] if choices.gravity is None else choices.gravity
    volume = (draft.above_zero('V', given['V']), 'V') if 'V' in given else None
    rho = (given['rho'], 'rho') if 'rho' in given else None
    if rho is None and 'B' in given and volume is not None:
        rho = given['B'] / (draft.above_zero('g', g) * volume[0]), 'B / (g V)'
    elif rho is None and 'B' in given and choices.water_density is None:
        draft.assumed.append('environment.water_density: 1000 kg/m3; the volume is B / (rho g)')
        rho = FRESH, 'assumed; the volume belongs to it'
    draft.environment(rho, gravity)
    g, density = (draft.values[f'environment.{key}'] for key in ('gravity', 'water_density'))
    mass = given['m'] if 'm' in given else _needed(draft, given, 'W') / g
    _check_weight(draft, given, mass * g)
    r_G = [given.get(f'{axis}G', 0.0) for axis in 'xyz']
    draft.put('rigid_body.mass', mass, 'm' if 'm' in given else 'W / g')
    draft.put('rigid_body.center_of_gravity', r_G, 'xG, yG, zG; what is absent is 0')
    _tensor(draft, given, bool(np.any(r_G)))
    if volume is None and 'B' in given:
        volume = given['B'] / (density * g), 'B / (rho g)'
    elif volume is not None and choices.water_density is None and choices.volume is None:
        _check_buoyancy(draft, given, density * g * volume[0])
    draft.buoyancy(volume, ([0.0] * 3, ''))
    if choices.center_of_buoyancy is None:
        r_B = [given.get(f'{axis}B', 0.0) for axis in 'xyz']
        draft.put('hydrostatics.center_of_buoyancy', r_B, 'xB, yB, zB; what is absent is 0')
        if not any(f'{axis}B' in given for axis in 'xyz'):
            draft.assumed.append('hydrostatics.center_of_buoyancy: the origin')


def _needed(draft: ImportedVehicle, given: dict[str, float], key: str) -> float:
    if key not in given:
        raise draft.refuse(key, 'a number', None)
    return given[key]


def _check_buoyancy(draft: ImportedVehicle, given: dict[str, float], displaced: float) -> None:
    if 'B' in given and abs(given['B'] - displaced) > APART * displaced:
        raise draft.refuse('B', f'rho g V = {displaced:.6g} N', given['B'])


def _check_weight(draft: ImportedVehicle, given: dict[str, float], weight: float) -> None:
    if 'W' not in given or abs(given['W'] - weight) <= APART * weight:
        return
    expected = f'm g = {weight:.6g} N'
    if 'B' in given and abs(given['B'] - weight) <= APART * weight:
        expected += ', which B is: --swap-weight-buoyancy if the two are swapped'
    raise draft.refuse('W', expected, given['W'])


def _tensor(draft: ImportedVehicle, given: dict[str, float], is_apart: bool) -> None:
    Ix, Iy, Iz = (_needed(draft, given, f'I{axis}') for axis in 'xyz')
    xy, xz, yz = (given.get(f'I{pair}', 0.0) for pair in ('xy', 'xz', 'yz'))
    if xy or xz or yz:
        if draft.choices.products is None:
            expected = '--products integral (of x y dm) or tensor (its entry): the list cannot say'
            raise draft.refuse('Ixy, Ixz, Iyz', expected, [xy, xz, yz])
        sign = -1.0 if draft.choices.products == 'integral' else 1.0
        xy, xz, yz = (sign * value for value in (xy, xz, yz))
        draft.traps.append(f'Ixy, Ixz, Iyz: --products {draft.choices.products}')
    if is_apart and draft.choices.inertia_reference is None:
        expected = '--inertia-reference cg or co: the list cannot say which point it is about'
        raise draft.refuse('Ix, Iy, Iz', expected, [Ix, Iy, Iz])
    tensor = [[Ix, xy, xz], [xy, Iy, yz], [xz, yz, Iz]]
    draft.put('rigid_body.inertia', tensor, 'Ix ... Iyz')
    draft.values['rigid_body.inertia_reference'] = draft.choices.inertia_reference or 'cg'
