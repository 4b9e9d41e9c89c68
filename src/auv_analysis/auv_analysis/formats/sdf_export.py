"""A vehicle as an SDF model for Gazebo: link, shape for buoyancy, hydrodynamics plugin."""

from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from auv_analysis.formats.sdf_import import COLUMNS, FLUID, ROWS
from auv_analysis.formats.xml_parts import ENTRIES
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.frames import swap_body_matrix, swap_inertia
from auv_dynamics.vehicle.vehicle import Vehicle, skew

IN_PLUGIN, IN_LINK = 'plugin', 'link'
HYDRODYNAMICS = 'filename="gz-sim-hydrodynamics-system" name="gz::sim::systems::Hydrodynamics"'
BUOYANCY = 'filename="gz-sim-buoyancy-system" name="gz::sim::systems::Buoyancy"'


def sdf_text(vehicle: Vehicle, environment: dict[str, Any], file: object, added_mass: str) -> str:
    """Text of an SDF file.

    Parameters
    ----------
    vehicle : with M_RB and M_A apart
    environment : of its file: water_density in kg/m3, gravity in m/s2
    file : named in errors
    added_mass : 'plugin' for xDotU ..., 'link' for <fluid_added_mass>

    Raises
    ------
    InputError : a vehicle of which only M is known

    """
    if vehicle.M_RB is None or vehicle.M_A is None:
        raise InputError(file, 'inertia_matrix', 'inertia and added_mass apart', 'their sum alone')
    rho, g = environment['water_density'], environment['gravity']
    world = [
        f'  <gravity>0 0 {_number(-g)}</gravity>',
        f'  <plugin {BUOYANCY}>',
        f'    <uniform_fluid_density>{_number(rho)}</uniform_fluid_density>',
        '  </plugin>',
    ]
    said = [*notes(vehicle, added_mass), 'Into the world:']
    return '\n'.join(
        [
            '<?xml version="1.0"?>',
            '<!--',
            *(f'  {line.replace("--", "")}' for line in (*said, *world)),
            '-->',
            '<sdf version="1.10">',
            f'  <model name={quoteattr(vehicle.name)}>',
            '    <link name="base_link">',
            *_inertial(vehicle, added_mass),
            *_collision(vehicle, vehicle.buoyancy / (rho * g)),
            '    </link>',
            f'    <plugin {HYDRODYNAMICS}>',
            '      <link_name>base_link</link_name>',
            f'      <water_density>{_number(rho)}</water_density>',
            *_plugin(vehicle, added_mass),
            '    </plugin>',
            '  </model>',
            '</sdf>',
            '',
        ]
    )


def notes(vehicle: Vehicle, added_mass: str) -> list[str]:
    """Limits and differences of Gazebo's model of a vehicle, a sentence each."""
    found = ['Axes of the link: forward, left, up. Its origin is that of the vehicle file.']
    M_A, M_RB = vehicle.M_A, vehicle.M_RB
    assert M_A is not None
    assert M_RB is not None
    if added_mass == IN_PLUGIN:
        ratio = float(np.linalg.eigvals(np.linalg.solve(M_RB, M_A)).real.max())
        if ratio >= 1:
            found.append(
                f'Unstable: the plugin takes the added mass from the last acceleration, and it is '
                f'{ratio:.3g} times the mass (below 1 is needed): use --added-mass link, for DART.'
            )
        if np.any(M_A - np.diag(np.diagonal(M_A))):
            found.append(
                'The C_A of the plugin leaves out what is off the diagonal of the added mass: '
                '--added-mass link has all of C.'
            )
    else:
        found.append('<fluid_added_mass> is used by the physics engine DART alone.')
    found += [
        'Buoyancy comes from the collision shape, a cube that is no hull: it also collides.',
        'Not held: density of the water and gravity, which are those of the world; the source.',
    ]
    if vehicle.thrusters is not None:
        rotors = ', and lag, dead band and curve of their rotors' * bool(vehicle.thrusters.rotors)
        found.append(f'Not exported: thrusters{rotors}.')
    return found


def _number(value: float) -> str:
    return repr(float(value) + 0.0)


def _inertial(vehicle: Vehicle, added_mass: str) -> list[str]:
    assert vehicle.M_RB is not None
    mass, S = float(vehicle.M_RB[0, 0]), skew(vehicle.r_G)
    tensor = swap_inertia(vehicle.M_RB[3:, 3:] + mass * S @ S)
    values = [tensor[i, j] for i in range(3) for j in range(i, 3)]
    lines = [
        '      <inertial>',
        f'        <pose>{_point(vehicle.r_G)} 0 0 0</pose>',
        f'        <mass>{_number(mass)}</mass>',
        '        <inertia>',
        *(f'          {_tag(name, value)}' for name, value in zip(ENTRIES, values, strict=True)),
        '        </inertia>',
    ]
    if added_mass == IN_LINK and vehicle.M_A is not None:
        M_A = swap_body_matrix(vehicle.M_A)
        upper = [(i, j) for i in range(6) for j in range(i, 6) if M_A[i, j]]
        lines += [
            '        <fluid_added_mass>',
            *(f'          {_tag(FLUID[i] + FLUID[j], M_A[i, j])}' for i, j in upper),
            '        </fluid_added_mass>',
        ]
    return [*lines, '      </inertial>']


def _collision(vehicle: Vehicle, volume: float) -> list[str]:
    side = _number(np.cbrt(volume))
    return [
        '      <collision name="displaced_water">',
        f'        <pose>{_point(vehicle.r_B)} 0 0 0</pose>',
        f'        <geometry><box><size>{side} {side} {side}</size></box></geometry>',
        '      </collision>',
    ]


def _plugin(vehicle: Vehicle, added_mass: str) -> list[str]:
    """Derivatives of SNAME: the signs of M_A and D turned; zeros off the diagonal are left out.

    Lift is yVabsU ...; its column of u is the same as that of the quadratic damping.
    """
    lines = []
    M_A = vehicle.M_A if added_mass == IN_PLUGIN and vehicle.M_A is not None else np.zeros((6, 6))
    lift = np.zeros((6, 6)) if vehicle.lift is None else vehicle.lift
    by_u = lift * (np.arange(6) == 0)
    for A, name in (
        (M_A, '{}Dot{}'),
        (vehicle.D_linear, '{}{}'),
        (vehicle.D_quadratic + by_u, '{0}{1}abs{1}'),
        (lift - by_u, '{}{}absU'),
    ):
        given = -swap_body_matrix(A)
        for i, j in np.argwhere(given):
            lines.append(f'      {_tag(name.format(ROWS[i], COLUMNS[j]), given[i, j])}')
    return lines


def _tag(name: str, value: float) -> str:
    return f'<{name}>{_number(value)}</{name}>'


def _point(r: np.ndarray) -> str:
    return ' '.join(_number(value) for value in r * [1.0, -1.0, -1.0])
