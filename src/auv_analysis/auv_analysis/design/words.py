"""A change of a vehicle in words."""

import numpy as np

from auv_analysis.design.bodies import disc_mass, normal_of
from auv_analysis.design.parameters import NAMES
from auv_analysis.design.search import parts_of
from auv_analysis.design.space import Space
from auv_analysis.output.text import join, number, plain

WAYS = (('forward', 'aft'), ('to starboard', 'to port'), ('down', 'up'))
PLACES = (('forward', 'aft'), ('to starboard', 'to port'), ('below', 'above'))
ORIGIN = 'the reference point'  # origin of the body frame
ALIGNED = np.radians(0.5)  # less than this from an axis is along it
NEAR = 5e-4  # of a unit vector: not worth a word


def change_words(space: Space, x: np.ndarray) -> list[str]:
    """What to do to the vehicle, a phrase for each part; none where nothing is changed."""
    phrases = {'shift': _shift, 'ballast': _ballast, 'disc': _disc}
    return [phrases[part](space, x) for part in parts_of(x)]


def part_words(part: str) -> str:
    """A part, or all of them, as a head of a table says it."""
    return {
        'shift': 'centre of gravity',
        'ballast': 'trimmed ballast',
        'disc': 'disc',
        'all': 'all together',
    }[part]


def values_of(x: np.ndarray) -> dict[str, float]:
    """Parameters of the parts that are changed, by name."""
    parts = parts_of(x)
    return {n: float(v) for n, v in zip(NAMES, x, strict=True) if n.split('.')[0] in parts}


def _shift(_: Space, x: np.ndarray) -> str:
    ways = [
        f'{plain(abs(d), 4)} m {names[d < 0]}'
        for d, names in zip(x[:3].tolist(), WAYS, strict=True)
        if d
    ]
    return f'move the centre of gravity {join(ways)}'


def _ballast(_: Space, x: np.ndarray) -> str:
    return f'add {number(x[3])} kg of ballast {_place(x[4:7])}, trimmed by foam at the same place'


def _disc(space: Space, x: np.ndarray) -> str:
    mass = float(disc_mass(x[7], space.density))
    normal = normal_of(x[11], x[12])
    normal = normal * np.sign(normal[int(np.argmax(np.abs(normal)))])  # a disc has two of them
    return (
        f'fit a thin circular plate of {number(2 * x[7])} m diameter, {_place(x[8:11])}, '
        f'{_facing(normal)} ({number(mass)} kg of added mass)'
    )


def _place(r: np.ndarray) -> str:
    """Where a part goes, seen from the reference point."""
    ways = [
        f'{plain(round(abs(float(v)), 3), 4)} m {names[int(v < 0)]}'
        for v, names in zip(r, PLACES, strict=True)
        if abs(v) >= NEAR
    ]
    return f'{join(ways)}, seen from {ORIGIN}' if ways else f'at {ORIGIN}'


def _facing(normal: np.ndarray) -> str:
    """Which way a plate faces: along the nearest axis, and how far it is turned from there."""
    main = int(np.argmax(np.abs(normal)))
    text = f'facing {WAYS[main][int(normal[main] < 0)]}'
    angle = float(np.arccos(min(abs(normal[main]), 1.0)))
    if angle < ALIGNED:
        return text
    ways = [
        WAYS[i][int(normal[i] < 0)]
        for i in range(3)
        if i != main and abs(normal[i]) >= np.sin(ALIGNED)
    ]
    numbers = ', '.join('0' if abs(v) < NEAR else plain(round(float(v), 3), 3) for v in normal)
    return f'{text}, turned {np.degrees(angle):.1f}° {join(ways)}, its normal ({numbers})'
