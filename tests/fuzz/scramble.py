"""Seeded mutations: of bytes, and of the numbers inside of them."""

import random
import re
import struct
from collections.abc import Sequence

SPECIAL = (
    *(float('nan'), float('inf'), -float('inf'), 1e308, -1e308, 5e-324, -0.0, 1e30, -1e9),
    *(2.0**53, 1e-300, 0.0, 1.0),
)
LENGTHS = (0, 1, 2**31 - 1, 2**32 - 1, 0x7FFFFFF0)


def scrambled(data: bytes, rng: random.Random, others: Sequence[bytes] = ()) -> bytes:
    """A copy with one to five changes: bits, bytes, numbers, lengths, cuts, splices.

    Parameters
    ----------
    data : what is changed
    rng : decides
    others : from which parts may be taken

    """
    changed = bytearray(data)
    for _ in range(rng.randint(1, 5)):
        rng.choice(CHANGES)(changed, rng, others)
    return bytes(changed)


NUMBER = re.compile(r'(?<![\w.])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?')
WORDS = (
    'nan',
    '-inf',
    '1e400',
    '-1e308',
    '1e-320',
    '0',
    '-0.0',
    '1e9',
    '',
    '1_0',
    '0x10',
    '9' * 400,
)


def renumbered(text: str, rng: random.Random) -> str:
    """A copy with up to three of its numbers written as what nobody expects, or negated."""
    for _ in range(rng.randint(0, 3)):
        found = rng.choice([*NUMBER.finditer(text)])
        word = rng.choice((*WORDS, f'-{found[0]}', f'{found[0]}0'))
        text = text[: found.start()] + word + text[found.end() :]
    return text


def _place(data: bytearray, rng: random.Random, size: int = 1) -> int:
    return rng.randrange(max(1, len(data) - size + 1))


def _flip(data: bytearray, rng: random.Random, _: Sequence[bytes]) -> None:
    if data:
        data[_place(data, rng)] ^= 1 << rng.randrange(8)


def _number(data: bytearray, rng: random.Random, _: Sequence[bytes]) -> None:
    """A double that nobody expects, where doubles usually stand."""
    if len(data) >= 8:
        at = _place(data, rng, 8) & ~3
        struct.pack_into('<d', data, min(at, len(data) - 8), rng.choice(SPECIAL))


def _length(data: bytearray, rng: random.Random, _: Sequence[bytes]) -> None:
    if len(data) >= 4:
        struct.pack_into('<I', data, _place(data, rng, 4) & ~3, rng.choice(LENGTHS))


def _cut(data: bytearray, rng: random.Random, _: Sequence[bytes]) -> None:
    del data[_place(data, rng) :]


def _remove(data: bytearray, rng: random.Random, _: Sequence[bytes]) -> None:
    at = _place(data, rng)
    del data[at : at + rng.randrange(1, 64)]


def _insert(data: bytearray, rng: random.Random, _: Sequence[bytes]) -> None:
    at = _place(data, rng)
    data[at:at] = rng.randbytes(rng.randrange(1, 64))


def _splice(data: bytearray, rng: random.Random, others: Sequence[bytes]) -> None:
    other = rng.choice(others) if others else bytes(data)
    if other:
        start = rng.randrange(len(other))
        at = _place(data, rng)
        part = other[start : start + rng.randrange(1, 400)]
        data[at : at + len(part)] = part


CHANGES = (_flip, _flip, _number, _number, _length, _cut, _remove, _insert, _splice)
