"""The mesh of a hull: displaced volume, its centre, and added mass in unbounded fluid.

The potential of a unit velocity in each degree of freedom is constant on flat triangles and found
by the direct boundary integral method of capytaine (Rankine sources alone); the added mass is
M_A = -rho int n phi dS (Newman 1977, section 4.13), n out of the hull. Its error falls as h^2 where
the hull is smooth and as h^(4/3) at right-angled edges; both are taken out over three refinements.
"""

import logging
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.formats.imported import Choices, ImportedVehicle
from auv_analysis.output.progress import waiting
from auv_dynamics.files.errors import InputError, first_line, refusing
from auv_dynamics.vehicle.vehicle import skew

SUFFIXES = ('.stl', '.obj', '.ply', '.off', '.glb')
UNITS = {'mm': 1e-3, 'cm': 1e-2, 'm': 1.0, 'in': 0.0254}
DIRECTIONS = {
    **dict.fromkeys('f', (1, 0, 0)), **dict.fromkeys('ba', (-1, 0, 0)),
    **dict.fromkeys('rs', (0, 1, 0)), **dict.fromkeys('lp', (0, -1, 0)),
    'd': (0, 0, 1), 'u': (0, 0, -1),
}  # fmt: skip
USUAL_AXES = ('flu', 'rfu', 'luf')  # by the file's axis along which the hull is longest
PLAUSIBLE = 2.0  # times: displaced water and mass of no submerged vehicle are so far apart
LARGEST_FILE, MOST_TRIANGLES = 1 << 27, 1_000_000
MERGED = 1e-6  # of the hull's size, below which vertices are one
GRAVITY = 9.81
# edges of one base in up to so many parts -> orders of the error that are taken out, share of what
# was taken out that counts as its error; with two refinements one order between both
REFINED = {3: ((4 / 3, 2.0), 0.1), 2: ((1.6,), 0.5)}
SMALLEST_BASE = 80  # triangles
DETAIL = 0.7  # of a base's triangles are the simplified hull's, the rest is to halve the longest
SHRUNK = 0.1  # relative change of volume by simplification beyond which a base is no hull
LAST = 0.8  # of the largest base, what the last one aims at, as triangles are halved together
SAFETY = 2.0  # error estimate in differences between two levels
NOISE = 0.1  # of two errors of the diagonal, the least that the entry of both has
PANELS, TOLERANCE = 5500, 0.02
WORST = 0.2  # error with which there is a file all the same
ROUNDING = 1e-7  # of the hull's length: of the single precision of STL
DIGITS = 10  # significant, of what is written: the loader asks for eigenvalues above -1e-9
LETTERS = 'XYZKMN'


def read_mesh(path: Path, choices: Choices) -> ImportedVehicle:
    """Vehicle of a hull's mesh; InputError names file, key, expected and found."""
    draft = ImportedVehicle(path, choices, path.stem)
    trimesh = _libraries()
    for name in ('volume', 'center_of_buoyancy'):
        if getattr(choices, name) is not None:
            expected = 'that of the mesh: the water in a flooded hull belongs to --mass'
            raise draft.refuse(f'hydrostatics.{name}', expected, getattr(choices, name))
    if choices.mass is None:
        raise draft.refuse('rigid_body.mass', '--mass (kg): a mesh does not say it', None)
    mass = draft.above_zero('rigid_body.mass', choices.mass)
    draft.environment(None, (GRAVITY, 'assumed'))
    density = draft.values['environment.water_density']
    hull = _in_body_frame(draft, _united(draft, _loaded(path, trimesh), trimesh), density / mass)
    volume, r_B = float(hull.volume), np.array(hull.center_mass)
    r_B[np.abs(r_B) < ROUNDING * hull.extents.max()] = 0.0
    draft.put('rigid_body.mass', mass, 'given by --mass')
    draft.put('hydrostatics.volume', _rounded(volume), 'of the mesh')
    draft.put('hydrostatics.center_of_buoyancy', _rounded(r_B), 'centroid of the mesh')
    _put_rigid_body(draft, r_B, np.asarray(hull.moment_inertia) * mass / volume)
    scale = density * np.concatenate([[volume] * 3, np.diagonal(hull.moment_inertia)])
    hull.apply_translation(-r_B)
    with waiting('added mass'):
        M_A, error, panels = converged(draft, hull, density, scale)
    said = ', '.join(
        f'{letter} {value:.4g} ± {bound:.1g}'
        for letter, value, bound in zip(LETTERS, np.diagonal(M_A), np.diagonal(error), strict=True)
    )
    off = max(float(error[i, j]) for i in range(3) for j in range(3, 6))
    draft.traps.append(
        f'added_mass: potential flow by capytaine in unbounded fluid, up to {panels} panels; about '
        f'the centre of buoyancy and in kg, kg m2: {said}; translation with rotation ± {off:.1g} '
        'kg m; entries below their error are zero'
    )
    shift = np.eye(6)
    shift[:3, 3:] = -skew(r_B)
    M_A = shift.T @ M_A @ shift
    draft.put('added_mass', _rounded(M_A), 'capytaine, unbounded fluid; errors: above')
    for key in ('linear', 'quadratic'):
        draft.put(f'damping.{key}', np.zeros((6, 6)), 'potential flow has none')
    draft.assumed.append(
        'damping: zero, as potential flow has none: put in measured or identified coefficients '
        'before the vehicle is simulated for its speed'
    )
    return draft


def _libraries() -> Any:
    try:
        import capytaine  # noqa: F401
        import fast_simplification  # noqa: F401
        import manifold3d  # noqa: F401
        import networkx  # noqa: F401
        import trimesh
    except ImportError as error:
        expected = 'what reads meshes installed: pip install -r requirements-mesh.txt'
        raise InputError(error.name, '', expected, 'no such module') from None
    return trimesh


def _rounded(values: Any) -> Any:
    rounded = np.vectorize(lambda value: float(f'{value:.{DIGITS}g}'))(values)
    return rounded if np.ndim(values) else float(rounded)


def _loaded(path: Path, trimesh: Any) -> Any:
    """Triangles of a file, with vertices merged and without what has no area."""
    with refusing(path, '', 'a mesh'):
        size = path.stat().st_size
    if size > LARGEST_FILE:
        raise InputError(path, '', f'a file of at most {LARGEST_FILE >> 20} MB', f'{size} bytes')
    try:
        mesh = trimesh.load(path, force='mesh', skip_materials=True, process=False)
        count = len(mesh.faces)
    except Exception as error:  # whatever a reader of a dozen formats stumbles over
        raise InputError(path, '', 'a mesh that trimesh reads', first_line(error)) from None
    if not 4 <= count <= MOST_TRIANGLES or not np.isfinite(mesh.vertices).all():
        expected = f'4 to {MOST_TRIANGLES} triangles of finite numbers'
        raise InputError(path, '', expected, f'{count} triangles')
    step = max(float(np.ptp(mesh.vertices, axis=0).max()), np.finfo(float).tiny) * MERGED
    mesh = trimesh.Trimesh(np.asarray(mesh.vertices) / step, mesh.faces, process=False)
    mesh.merge_vertices(merge_tex=True, merge_norm=True, digits_vertex=0)
    mesh.update_faces(mesh.nondegenerate_faces())
    mesh.apply_scale(step)
    return mesh


def _united(draft: ImportedVehicle, mesh: Any, trimesh: Any) -> Any:
    """Closed surfaces with normals outwards; parts that overlap or enclose each other as one."""
    parts = _parts(mesh)
    filled = turned = 0
    for number, part in enumerate(parts, 1):
        before = len(part.faces)
        if not part.is_watertight:
            trimesh.repair.fill_holes(part)
        filled += len(part.faces) - before
        if not part.is_watertight:
            _, index, counts = np.unique(
                part.edges_sorted, axis=0, return_index=True, return_counts=True
            )
            loose = part.vertices[part.edges_sorted[index[counts != 2]]].reshape(-1, 3)
            corners = ' to '.join(
                f'({", ".join(f"{x:.4g}" for x in end(loose, axis=0))})' for end in (np.min, np.max)
            )
            found = f'{len(loose) // 2} open edges in part {number} of {len(parts)}, at {corners}'
            raise draft.refuse('surface', 'closed parts', found)
        was_consistent = part.is_winding_consistent
        trimesh.repair.fix_winding(part)
        if not part.is_winding_consistent:
            raise draft.refuse('surface', 'parts with two sides', f'part {number} with one')
        with np.errstate(invalid='ignore'):  # trimesh divides by it
            volume = part.volume
        if volume == 0.0:
            raise draft.refuse('surface', 'parts with a volume', f'part {number} without any')
        turned += not was_consistent or volume < 0
        if volume < 0:
            part.invert()
    if filled:
        draft.traps.append(f'surface: {filled} triangles added that close its holes')
    if turned:
        draft.traps.append(f'surface: normals turned outwards in {turned} of {len(parts)} parts')
    union = parts[0] if len(parts) == 1 else trimesh.boolean.union(parts, engine='manifold')
    total = sum(part.volume for part in parts)
    if abs(union.volume / total - 1) > MERGED:
        draft.traps.append(
            f'surface: {len(parts)} parts of together {total / union.volume:.4g} times the volume '
            'overlap or lie in each other: what is inside is not wetted'
        )
    return union


def _parts(mesh: Any) -> list[Any]:
    """Connected parts; those that touch are told apart where the file has them one by one."""
    ends, open_edges = [0], set[tuple[int, int]]()
    for number, edges in enumerate(mesh.edges_sorted.reshape(-1, 3, 2).tolist(), 1):
        open_edges ^= {(a, b) for a, b in edges}
        if not open_edges or number == len(mesh.faces):
            ends.append(number)
    parts = []
    for begin, end in pairwise(ends):
        solid = mesh.submesh([np.arange(begin, end)], append=True, repair=False)
        solid.update_faces(solid.unique_faces())
        parts += list(solid.split(only_watertight=False, repair=False))
    return parts


def _in_body_frame(draft: ImportedVehicle, hull: Any, water: float) -> Any:
    """The hull in m and FSD from the body's origin; `water`: density over mass, 1/m3."""
    choices = draft.choices
    ratios = {name: water * float(hull.volume) * unit**3 for name, unit in UNITS.items()}
    fits = [name for name, ratio in ratios.items() if 1 / PLAUSIBLE <= ratio <= PLAUSIBLE]
    hint = f'{fits[0]}, which fits the mass' if fits else 'none of mm, cm, m, in fits the mass'
    if choices.units is None:
        size = ' x '.join(f'{length:.4g}' for length in hull.extents)
        raise draft.refuse('--units', f'that of the file ({hint})', f'none, and {size} in size')
    if choices.units not in fits:
        expected = f'a hull that displaces about its mass of water ({hint})'
        found = f'{ratios[choices.units]:.3g} times the mass in {choices.units}'
        raise draft.refuse('--units, --mass', expected, found)
    longest = int(np.argmax(hull.extents))
    usual = f'{USUAL_AXES[longest]} if it is longest ahead, along {"xyz"[longest]}'
    expected = f"right-handed directions of the file's x, y, z, of f b l r u d ({usual})"
    letters = (choices.axes or '').lower()
    rotation = np.array([DIRECTIONS.get(letter, (0, 0, 0)) for letter in letters], float).T
    if rotation.shape != (3, 3) or round(np.linalg.det(rotation)) != 1:
        raise draft.refuse('--axes', expected, choices.axes)
    if choices.origin is None:
        draft.assumed.append("the body's origin is that of the file")
    scaled = np.eye(4)
    scaled[:3, :3] = UNITS[choices.units] * rotation
    scaled[:3, 3] = -scaled[:3, :3] @ np.asarray(choices.origin or (0.0, 0.0, 0.0))
    hull.apply_transform(scaled)
    draft.traps.append(
        f'mesh: {len(hull.faces)} triangles, bodies: {hull.body_count}; from {choices.units} and '
        f'{letters} to m and FSD; the water that it displaces has '
        f'{ratios[choices.units]:.4g} times the mass'
    )
    return hull


def _put_rigid_body(draft: ImportedVehicle, r_B: np.ndarray, uniform: np.ndarray) -> None:
    """Centre of gravity and tensor: the user's, else those of the hull at uniform density."""
    choices, key = draft.choices, 'rigid_body.inertia'
    if choices.center_of_gravity is None:
        said = 'assumed: the centre of buoyancy'
        draft.put('rigid_body.center_of_gravity', _rounded(r_B), said)
        draft.assumed.append(
            'rigid_body.center_of_gravity: the centre of buoyancy, so that nothing rights the '
            'vehicle: give --center-of-gravity'
        )
    else:
        said = 'given by --center-of-gravity'
        draft.put('rigid_body.center_of_gravity', choices.center_of_gravity, said)
    draft.values['rigid_body.inertia_reference'] = 'cg'
    if choices.inertia is None:
        noise = np.abs(uniform) < MERGED * np.abs(uniform).max()
        draft.put(
            key, _rounded(np.where(noise, 0.0, uniform)), 'assumed: uniform density of the hull'
        )
        draft.assumed.append(f'{key}: that of the hull at uniform density: give --inertia')
        return
    if len(choices.inertia) not in (3, 6):
        raise draft.refuse('--inertia', '3 or 6 numbers (kg m2)', list(choices.inertia))
    products = np.zeros(3) if len(choices.inertia) == 3 else np.array(choices.inertia[3:])
    if np.any(products) and choices.products is None:
        expected = '--products integral (of x y dm) or tensor (its entry)'
        raise draft.refuse('--inertia', expected, list(choices.inertia))
    tensor = np.diag(choices.inertia[:3])
    sign = -1.0 if choices.products == 'integral' else 1.0
    for (i, j), value in zip(((0, 1), (0, 2), (1, 2)), products, strict=True):
        tensor[i, j] = tensor[j, i] = sign * value
    draft.values['rigid_body.inertia_reference'] = choices.inertia_reference or 'cg'
    draft.put(key, tensor, 'given by --inertia')


def converged(
    draft: ImportedVehicle, hull: Any, density: float, scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray, int]:
    """Added mass about the mesh's origin, refined until two levels agree.

    Parameters
    ----------
    draft : whose choices have the tolerance and the largest number of panels
    hull : closed `trimesh.Trimesh`, m; about its centroid
    density : of the water, kg/m3
    scale : (6,) mass and moments of inertia of the displaced water, kg and kg m2: the error is
        judged against M_A's diagonal and these together, what a hull that floats has

    Returns
    -------
    M_A : (6, 6) positive semidefinite; zero where it is below its error, kg, kg m, kg m2
    error : (6, 6) estimate, the same units
    panels : most that were solved for

    """
    limit = draft.choices.panels or PANELS
    tolerance = draft.choices.tolerance or TOLERANCE
    last, worst, panels = None, np.inf, 0
    found: tuple[np.ndarray, np.ndarray, int]
    for triangles in _bases(hull, limit // min(REFINED) ** 2):
        parts = max(n for n in REFINED if n**2 * len(triangles) <= limit)
        level, finest = (density * A for A in extrapolated(triangles, parts))
        panels = len(triangles) * parts**2
        M_A = (level + level.T) / 2
        if last is not None:
            error = SAFETY * np.abs(M_A - last) + REFINED[parts][1] * np.abs(level - finest)
            spread = np.sqrt(np.diagonal(error))
            error = np.maximum(np.maximum(error, error.T), NOISE * np.outer(spread, spread))
            size = np.sqrt(np.maximum(np.diagonal(M_A), 0) + scale)
            worst = float(np.max(error / np.outer(size, size)))
            found = _cut(M_A, error, size), error, panels
            if worst <= tolerance:
                return found
        last = M_A
    if not worst <= WORST:
        expected = f'two levels that agree to {WORST:g} at least: more --panels, a simpler mesh'
        said = f'{worst:.2g} at {panels}' if np.isfinite(worst) else f'not two in {limit} panels'
        raise draft.refuse('added_mass', expected, said)
    draft.traps.append(
        f'added_mass: its levels agree to {worst:.2g}, not to {tolerance:g}: give more --panels'
    )
    return found


def _cut(M_A: np.ndarray, error: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Without what is below its error, and without negative eigenvalues that the error allows."""
    held = np.abs(M_A) > error
    held &= np.outer(np.diagonal(held), np.diagonal(held))
    values, vectors = np.linalg.eigh(np.where(held, M_A, 0.0) / np.outer(size, size))
    positive = (vectors * np.maximum(values, 0.0)) @ vectors.T * np.outer(size, size)
    return np.where(held, positive, 0.0)


def _bases(hull: Any, limit: int) -> Iterator[np.ndarray]:
    """Ever finer triangulations (n, 3, 3) of a hull, n at most `limit`, each twice the last.

    Where the hull has too many triangles it is simplified, then made to have its volume, centroid
    and second moments again.
    """
    wanted = SMALLEST_BASE
    while wanted <= limit:
        mesh = _simplified(hull, int(DETAIL * wanted)) or _simplified(hull, wanted)
        if mesh is not None:
            fitted = (np.asarray(mesh.triangles) - mesh.center_mass) @ _fit(mesh, hull)
            triangles = shortened(fitted + hull.center_mass, wanted)
            if len(triangles) > limit:
                return
            yield triangles
            wanted = len(triangles)
        last = int(LAST * limit)
        wanted = last if wanted < LAST * last < last < 2 * wanted else 2 * wanted


def _simplified(hull: Any, count: int) -> Any:
    """Hull of about so many triangles; None where it falls apart."""
    if len(hull.faces) <= count:
        return hull
    mesh = hull.simplify_quadric_decimation(face_count=count)
    fits = mesh.is_watertight and abs(mesh.volume / hull.volume - 1) < SHRUNK
    return mesh if fits else None


def _fit(mesh: Any, hull: Any) -> np.ndarray:
    """Symmetric map (3, 3) by which a mesh gets the volume and second moments of a hull."""
    moments = [part.moment_inertia / part.volume for part in (mesh, hull)]
    own, wanted = (np.eye(3) * np.trace(tensor) / 2 - tensor for tensor in moments)
    root = _power(wanted, 0.5)
    stretch = root @ _power(root @ own @ root, -0.5) @ root
    return stretch * (hull.volume / mesh.volume / np.linalg.det(stretch)) ** (1 / 3)


def _power(A: np.ndarray, exponent: float) -> np.ndarray:
    values, vectors = np.linalg.eigh(A)
    return (vectors * values**exponent) @ vectors.T


def shortened(triangles: np.ndarray, count: int) -> np.ndarray:
    """Triangles (n, 3, 3) of the same surface, the longest halved until there are `count`."""
    longest = np.inf
    while len(triangles) < count:
        edges = np.linalg.norm(triangles - triangles[:, [1, 2, 0]], axis=2)
        longest = min(longest, edges.max()) * 0.9
        apart = edges.max(axis=1) > longest
        long, rows = triangles[apart], np.arange(int(apart.sum()))
        alike = edges[apart] > (1 - MERGED) * edges[apart].max(axis=1)[:, None]
        first = np.argmax(alike, axis=1)
        a, b, c = (long[rows, (first + k) % 3] for k in range(3))
        middle = (a + b) / 2
        halves = np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)
        triangles = np.concatenate([triangles[~apart], *halves])
    return triangles


def split(triangles: np.ndarray, n: int) -> np.ndarray:
    """Each of the triangles (m, 3, 3) as n^2 similar ones."""
    a, b, c = np.moveaxis(triangles, 1, 0)

    def point(i: int, j: int) -> np.ndarray:
        return (a * (n - i - j) + b * i + c * j) / n

    cells = [(i, j) for i in range(n) for j in range(n - i)]
    upright = [np.stack([point(i, j), point(i + 1, j), point(i, j + 1)], 1) for i, j in cells]
    other = [
        np.stack([point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)], 1)
        for i, j in cells
        if i + j < n - 1
    ]
    return np.concatenate(upright + other)


def extrapolated(triangles: np.ndarray, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Added mass (6, 6) at density 1 for panels of no size, and that of the finest ones.

    Parameters
    ----------
    triangles : (n, 3, 3) base, m
    parts : 2 or 3, of its edges in the finest refinement

    """
    splits = range(1, parts + 1)
    basis = [[1.0, *(n**-order for order in REFINED[parts][0])] for n in splits]
    levels = [panel_added_mass(split(triangles, n)) for n in splits]
    return np.tensordot(np.linalg.inv(basis)[0], levels, 1), levels[-1]


def panel_added_mass(triangles: np.ndarray) -> np.ndarray:
    """Added mass at density 1 by one panel a triangle; symmetric but for the discretisation.

    Parameters
    ----------
    triangles : (n, 3, 3) corners, anticlockwise seen from the fluid, m

    Returns
    -------
    M_A : (6, 6) about the origin of the axes, m3, m4, m5

    """
    import capytaine
    from scipy.linalg import solve

    corners = np.arange(3 * len(triangles)).reshape(-1, 3)
    faces = np.column_stack([corners, corners[:, 2]])
    a, b, c = np.moveaxis(triangles, 1, 0)
    area, middle = np.cross(b - a, c - a) / 2, triangles.mean(axis=1)  # normals of its length
    size = np.linalg.norm(area, axis=1)
    logging.getLogger(capytaine.__name__).setLevel(logging.ERROR)  # it tells much of meshes
    mesh = capytaine.Mesh(
        vertices=triangles.reshape(-1, 3), faces=faces, auto_clean=False, auto_check=False
    )
    # what it would work out face by face, which takes a third of all the time
    vars(mesh).update(
        faces_normals=area / size[:, None], faces_areas=size, faces_centers=middle,
        faces_radiuses=np.linalg.norm(triangles[:, 0] - middle, axis=1),
    )  # fmt: skip
    # a table of waves is not used without a surface: a small one takes no time
    small = {'tabulation_nr': 4, 'tabulation_nz': 4, 'tabulation_nb_integration_points': 5}
    single, double = capytaine.Delhommeau(**small, tabulation_cache_dir=None).evaluate(
        mesh, mesh, free_surface=np.inf, water_depth=np.inf, adjoint_double_layer=False
    )
    flux = np.hstack([area, np.cross(middle, area)])
    normal = flux / size[:, None]
    potential = solve(double, single @ normal, overwrite_a=True, check_finite=False)
    return -(flux.T @ potential)
