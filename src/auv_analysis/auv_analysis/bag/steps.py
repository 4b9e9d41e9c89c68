"""The steps of a bag that are complete on all step topics."""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np

from auv_analysis.bag.contents import Contents, NotOursError, Series
from auv_analysis.bag.roles import READERS, namespace_of, role_of
from auv_dynamics.files.errors import InputError
from auv_dynamics.ros import interface
from auv_dynamics.vehicle.frames import NED_FSD, named_axes

REQUIRED = (interface.ODOM, interface.WRENCH)
Steps = tuple[np.ndarray, dict[str, np.ndarray]]  # stamps (n,) in ns, role -> values


def topics_of_one_graph(topics: Iterable[str], contents: Contents, bag: Path) -> dict[str, str]:
    """Role -> topic, of the namespace that is read, or of the only one that is complete.

    Parameters
    ----------
    topics : those of ours that have messages
    contents : of the bag
    bag : for the refusal

    Raises
    ------
    InputError : a topic without which there is no run has no messages, or there are several runs

    """
    topics = set(topics)
    space = _namespace(topics, contents, bag)
    found = ', '.join(sorted(contents.types)) or 'no topics'
    frames = contents.frames[space]
    named = all(named_axes(name) == NED_FSD for name in (frames.odom, frames.base))
    if 'params.yaml' not in contents.attachments and not named:
        expected = 'frames whose names say that they are NED and FSD'
        found = f'{frames.odom}, {frames.base}'
        raise NotOursError(bag, f'{space}{interface.ODOM}: frame_id', expected, found)
    ours = {role: f'{space}{role}' for role in READERS if f'{space}{role}' in topics}
    for role in REQUIRED:
        if role not in ours:
            raise NotOursError(bag, role, 'messages', found)
    return ours


def _namespace(topics: set[str], contents: Contents, bag: Path) -> str:
    """Namespace that is read, as it stands before our names."""
    found = ', '.join(sorted(contents.types)) or 'no topics'
    spaces = sorted(namespace_of(t) for t in topics if role_of(t) == interface.ODOM)
    whole = [space for space in spaces if all(f'{space}{role}' in topics for role in REQUIRED)]
    if not spaces and contents.namespace is not None:
        others = {namespace_of(t) for t in contents.counts if role_of(t) == interface.ODOM}
        listed = ', '.join(sorted(space.rstrip('/') or '/' for space in others))
        key = f'namespace {contents.namespace}'
        if others:
            expected = f'{interface.ODOM} in it, or --namespace with one that has it'
            raise InputError(bag, key, expected, listed)
        if contents.asked:
            raise InputError(bag, key, interface.ODOM, found)
    if not spaces:
        raise NotOursError(bag, interface.ODOM, 'messages', found)
    if len(whole) > 1:
        listed = ', '.join(space.rstrip('/') or '/' for space in whole)
        raise InputError(bag, '', 'one vehicle, or --namespace with that of one', listed)
    return whole[0] if whole else spaces[0]


def complete(series: Mapping[str, Series]) -> Steps:
    """Stamps that are on every topic, rising, and the values there; of a doubled one the first."""
    stamps, *others = (ns for ns, _ in series.values())
    if np.all(np.diff(stamps) > 0) and all(np.array_equal(stamps, ns) for ns in others):
        return stamps, {role: rows for role, (_, rows) in series.items()}
    for ns in others:
        stamps = np.intersect1d(stamps, ns)
    stamps = np.unique(stamps)
    values = {}
    for role, (ns, rows) in series.items():
        order = np.argsort(ns, kind='stable')
        values[role] = rows[order[np.searchsorted(ns, stamps, sorter=order)]]
    return stamps, values


def complete_blocks(
    parts: Iterable[tuple[str, Series]], last: Mapping[str, int], size: int
) -> Iterator[Steps]:
    """The same of topics whose stamps rise, in blocks of `size` steps; the last may be shorter.

    Parameters
    ----------
    parts : roles and what comes next of them, in any interleaving
    last : role -> its last stamp: what comes behind the earliest of them is not complete
    size : steps of a block

    """
    end = min(last.values())
    waiting: dict[str, list[Series]] = {role: [] for role in last}
    counts = dict.fromkeys(last, 0)
    ready: list[Steps] = []
    for role, (stamps, rows) in parts:
        if role not in last:
            continue
        inside = slice(0, int(np.searchsorted(stamps, end, 'right')))
        waiting[role].append((stamps[inside], rows[inside]))
        counts[role] += len(stamps[inside])
        if min(counts.values()) >= size:
            ready.append(_settled(waiting, counts, finished=False))
            yield from _cut(ready, size)
    ready.append(_settled(waiting, counts, finished=True))
    yield from _cut(ready, size)
    if len(ready[0][0]):
        yield ready[0]


def _settled(waiting: dict[str, list[Series]], counts: dict[str, int], *, finished: bool) -> Steps:
    """Take the steps that no topic can add to any more from what waits."""
    series = {role: joined_series(parts) for role, parts in waiting.items()}
    sure = None if finished else min(int(ns[-1]) for ns, _ in series.values())
    early = {}
    for role, (ns, rows) in series.items():
        n = len(ns) if sure is None else int(np.searchsorted(ns, sure))  # it may come once more
        early[role] = ns[:n], rows[:n]
        waiting[role], counts[role] = [(ns[n:], rows[n:])], len(ns) - n
    return complete(early)


def _cut(ready: list[Steps], size: int) -> Iterator[Steps]:
    """Blocks of exactly `size` steps; one shorter one is left in `ready`."""
    roles = ready[0][1].keys()
    ns = np.concatenate([stamps for stamps, _ in ready])
    values = {role: np.concatenate([rows[role] for _, rows in ready]) for role in roles}
    full = len(ns) // size * size
    for i in range(0, full, size):
        here = slice(i, i + size)
        yield ns[here], {role: rows[here] for role, rows in values.items()}
    ready[:] = [(ns[full:], {role: rows[full:] for role, rows in values.items()})]


def joined_series(parts: Iterable[Series]) -> Series:
    """One series of consecutive ones."""
    stamps, rows = zip(*parts, strict=True)
    return np.concatenate(stamps), np.concatenate(rows)


def dropped(counts: dict[str, int], steps: int, bag: Path) -> list[str]:
    """Notes on messages that are not complete on all topics.

    Parameters
    ----------
    counts : role -> number of messages
    steps : that are complete
    bag : for the refusal

    Raises
    ------
    InputError : there is no run in fewer than two steps

    """
    if steps < 2:
        raise NotOursError(bag, '', 'at least two steps that are complete on all step topics', '0')
    return [
        f'{role}: {count - steps} of {count} messages are not complete on all topics'
        for role, count in counts.items()
        if count > steps
    ]
