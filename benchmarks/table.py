"""The table of results in README.md, written from results.json."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from keys import KEYS, Key
from load import Load
from measure import Measured

README = Path(__file__).with_name('README.md')
BEGIN, END = '<!-- results -->', '<!-- end of results -->'


def table(results: Mapping[str, Any]) -> str:
    """Results as Markdown: where they come from, a row per key, why an aim is missed.

    Parameters
    ----------
    results : contents of results.json

    """
    lines = [conditions(results), '']
    lines += ['| key | what | reference | value | ratio | must | aim | verdict | others |']
    lines += ['|---|---|---|---|---|---|---|---|---|']
    reasons = []
    for key in KEYS:
        bounds = f'{key.bound(key.must)} | {key.bound(key.aim)}'
        if key.name not in results:
            row = f'| `{key.name}` | {key.what} | {key.reference} | | | {bounds} | not measured | |'
            lines.append(row)
            continue
        measured = restored(results[key.name])
        lines.append(_row(key, measured))
        if key.verdict(measured) in ('met', 'MISSED'):
            reasons.append(f'* `{key.name}`: {key.why or "no reason is known."}')
    if reasons:
        lines += ['', 'Where an aim is missed:', '', *reasons]
    return '\n'.join(lines)


def conditions(results: Mapping[str, Any]) -> str:
    """Machine and versions of results in one line."""
    machine, versions = results['machine'], results['versions']
    chosen = ', '.join(f'{name} {version}' for name, version in versions.items())
    return (
        f'{machine["cpu"]}, {machine["cores"]} cores, {machine["memory_gb"]:g} GB, '
        f'{machine["kernel"]}; {chosen}.'
    )


def _row(key: Key, measured: Measured) -> str:
    reference = key.reference
    if measured.reference is not None:
        reference += f': {quantity(measured.reference, measured.unit)}'
    ratio = '' if measured.ratio is None else f'**{measured.ratio:.3g}**'
    if measured.spread is not None:
        ratio += f' ({measured.spread[0]:.3g}–{measured.spread[1]:.3g})'
    cells = (
        f'`{key.name}`', key.what, reference, quantity(measured.value, measured.unit), ratio,
        key.bound(key.must), key.bound(key.aim), key.verdict(measured), _others(measured.load),
    )  # fmt: skip
    return f'| {" | ".join(cells)} |'


def restored(entry: Mapping[str, Any]) -> Measured:
    """What was measured, from its entry in results.json."""
    load = entry.get('load')
    return Measured(**{**entry, 'load': Load(**load) if load else None})


def _others(load: Load | None) -> str:
    return '' if load is None else f'{load.others:.1f}, {load.cpu:.0%}'


def quantity(value: float, unit: str) -> str:
    """A value with three digits in a unit that suits it."""
    if unit == 's' and 0 < value < 1:
        return f'{value * 1e3:.3g} ms' if value >= 1e-3 else f'{value * 1e6:.3g} µs'
    return f'{value:.3g} {unit}' if value < 1e3 else f'{value:,.0f}'.replace(',', ' ') + f' {unit}'


def write_table(results: Mapping[str, Any]) -> None:
    """Put the table between its marks in README.md."""
    text = README.read_text(encoding='utf-8')
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    README.write_text(f'{before}{BEGIN}\n{table(results)}\n{END}{after}', encoding='utf-8')
