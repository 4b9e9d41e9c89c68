"""Files that keep the form of a good one, with entries that nobody expects: by Hypothesis."""

import copy
from collections.abc import Callable
from typing import Any

from hypothesis import strategies as st

NUMBERS = (
    *(0, -1, 1, 1e-9, 1e9, -1e300, 1e308, float('nan'), float('inf'), -float('inf')),
    *(10**400, 2**63, 6.02e23, 5e-324, True, False),
)
WORDS = (
    *(
        '',
        ' ',
        'nan',
        '1e3',
        'gvc',
        'rexrov',
        '../../etc/passwd',
        '/dev/zero',
        '~',
        '\x00',
        '\x1b[2J',
    ),
    *(
        'a' * 300,
        '{{7*7}}',
        '<script>',
        'os:system',
        'herman2018',
        'ode5',
        'x:y:z',
        '-',
        '%s',
        '🌊',
    ),
)
ODD: st.SearchStrategy[Any] = st.one_of(
    st.sampled_from(NUMBERS),
    st.sampled_from(WORDS),
    st.none(),
    st.floats(),
    st.integers(-(10**6), 10**6),
    st.text(max_size=8),
    st.just([]),
    st.just({}),
    st.lists(st.one_of(st.floats(), st.sampled_from(WORDS)), max_size=8),
    st.lists(st.lists(st.floats(-10, 10), max_size=7), max_size=7),
    st.dictionaries(st.sampled_from(('kind', 'surge', 'offset', 'x')), st.floats(), max_size=3),
)


def places(data: Any, at: tuple = ()) -> list[tuple]:
    """Where something stands in nested mappings and lists, by keys and indices."""
    inner: list[tuple] = []
    if isinstance(data, dict):
        inner = [place for key, value in data.items() for place in places(value, (*at, key))]
    elif isinstance(data, list):
        inner = [place for i, value in enumerate(data) for place in places(value, (*at, i))]
    return [at, *inner] if at else inner


def _at(data: Any, place: tuple) -> Any:
    for key in place:
        data = data[key]
    return data


@st.composite
def altered(draw: st.DrawFn, originals: list[Any]) -> Any:
    """One of the originals with one to four entries changed."""
    data = copy.deepcopy(draw(st.sampled_from(originals)))
    for _ in range(draw(st.integers(1, 4))):
        listed = places(data)
        if not listed:
            break
        place = draw(st.sampled_from(listed))
        holder, key = _at(data, place[:-1]), place[-1]
        draw(st.sampled_from(CHANGES))(draw, data, holder, key)
    return data


Change = Callable[[st.DrawFn, Any, Any, Any], None]


def _replace(draw: st.DrawFn, _: Any, holder: Any, key: Any) -> None:
    holder[key] = draw(ODD)


def _scale(draw: st.DrawFn, _: Any, holder: Any, key: Any) -> None:
    value = holder[key]
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300:
        holder[key] *= draw(st.sampled_from((-1.0, 0.0, 1e-6, 0.5, 2.0, 1e6)))
    else:
        holder[key] = draw(ODD)


def _drop(_: st.DrawFn, __: Any, holder: Any, key: Any) -> None:
    del holder[key]


def _double(_: st.DrawFn, __: Any, holder: Any, key: Any) -> None:
    if isinstance(holder, list):
        holder.append(copy.deepcopy(holder[key]))
    else:
        holder[f'{key}_'] = copy.deepcopy(holder[key])


def _move(draw: st.DrawFn, data: Any, holder: Any, key: Any) -> None:
    """What stands elsewhere takes this place."""
    holder[key] = copy.deepcopy(_at(data, draw(st.sampled_from(places(data)))))


CHANGES: tuple[Change, ...] = (_replace, _replace, _scale, _drop, _double, _move)
