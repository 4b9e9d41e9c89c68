"""How cost grows with batch size, horizon, threads, recorded topics and bag length.

    python benchmarks/growth.py [--only CURVE...]

Writes benchmarks/growth.json, growth.md with a table per curve, and growth.png.
With --only nothing is written.
"""

import argparse
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from curves import CURVES, Curve
from machine import machine, versions
from plot import plot
from table import conditions, quantity

FOLDER = Path(__file__).parent
DECADES = 100.0  # the slope is fitted from the largest size down to the size over this


def slope(points: Sequence[tuple[float, float]]) -> float:
    """Exponent p of cost = c size^p, fitted through the points of the two largest decades.

    Below them, what a run costs before it starts hides how it grows.

    Parameters
    ----------
    points : (size, cost), both positive, at least two of them within two decades of the largest

    """
    sizes, costs = np.log(np.array(points, float)).T
    upper = sizes >= sizes.max() - np.log(DECADES) - 1e-9
    return float(np.polyfit(sizes[upper], costs[upper], 1)[0])


def measure(names: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Points and slope of curves by name."""
    found = {}
    for curve in (curve for curve in CURVES if curve.name in names):
        _say(f'{curve.name}: {curve.what} ...')
        points = []
        with curve.measurement() as cost:
            for size in curve.sizes:
                start = time.monotonic()
                points.append((size, cost(size)))
                took = time.monotonic() - start
                _say(f'  {size:g} {curve.unit}: {quantity(points[-1][1], "s")} ({took:.0f} s)')
        found[curve.name] = {
            'unit': curve.unit, 'cost_unit': 's', 'points': points, 'slope': slope(points),
        }  # fmt: skip
        _say(f'  slope {found[curve.name]["slope"]:.3f}, expected {curve.expected}')
    return found


def text(results: dict[str, Any]) -> str:
    """Results as Markdown, a table per curve."""
    lines = [
        '# How cost grows',
        '',
        'Written by `make bench-growth`, see [README.md](README.md). The slope p of',
        'cost = c size^p is fitted through the two largest decades.',
        '',
        conditions(results),
        '',
        '![Cost against size, a panel per curve](growth.png)',
    ]
    for curve in CURVES:
        if curve.name in results:
            lines += ['', *_section(curve, results[curve.name])]
    return '\n'.join(lines) + '\n'


def _section(curve: Curve, found: dict[str, Any]) -> list[str]:
    head = [f'## {curve.what}', '', f'Slope **{found["slope"]:.2f}**; {curve.expected}.', '']
    head += [f'| {curve.unit} | time | {curve.per} |', '|---|---|---|']
    return head + [
        f'| {quantity(size, "").strip()} | {quantity(cost, "s")} | {curve.each(size, cost)} |'
        for size, cost in found['points']
    ]


def main(arguments: list[str] | None = None) -> None:
    """Measure and write."""
    names = [curve.name for curve in CURVES]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        '--only', nargs='+', metavar='CURVE', choices=names, help='these; nothing is written'
    )
    options = parser.parse_args(arguments)
    conditions: dict[str, Any] = {'machine': machine(), 'versions': versions()}
    results = {**measure(options.only or names), **conditions}
    if options.only:
        print(json.dumps(results, indent=2))
        return
    (FOLDER / 'growth.json').write_text(json.dumps(results, indent=2) + '\n', encoding='utf-8')
    (FOLDER / 'growth.md').write_text(text(results), encoding='utf-8')
    plot(results, FOLDER / 'growth.png')


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


if __name__ == '__main__':
    main()
