"""Measure every key of the table: `make bench`.

    python benchmarks/run.py [--only KEY...]

Writes benchmarks/results.json and the table in benchmarks/README.md. With --only nothing is
written: the numbers of a table are of one run. Exit code 1: a key that must be met is missed, or
one could not be measured; 3: else, but other programs were too busy beside a key to judge it.
"""

import argparse
import importlib
import json
import sys
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from keys import BY_NAME, GROUPS, KEYS, NOT_JUDGED
from load import QUIET, watched
from machine import machine, versions
from measure import Measured
from table import table, write_table

NOT_ALL = 3  # exit code: not every key was judged
RESULTS = Path(__file__).with_name('results.json')


def measure(names: set[str]) -> tuple[dict[str, Measured], dict[str, str]]:
    """Results by key, and why a key that was asked for has none."""
    found: dict[str, Measured] = {}
    missing: dict[str, str] = {}
    for place, keys in GROUPS.items():
        if not names.intersection(keys):
            continue
        _say(f'{", ".join(keys)} ...')
        start = time.monotonic()
        module, _, function = place.partition(':')
        group: dict[str, Measured] = {}
        with watched() as watch:
            try:
                group = getattr(importlib.import_module(module), function)()
            except Exception as error:  # one benchmark that fails must not cost the others
                missing |= dict.fromkeys(keys, f'{type(error).__name__}: {error}'.splitlines()[0])
        load = watch.load()
        found |= {name: replace(result, load=load) for name, result in group.items()}
        for key in keys:
            _say(f'  {_line(key, found, missing)}')
        _say(f'  {time.monotonic() - start:.0f} s, load of others {load.others:.1f}')
    return found, missing


def _line(name: str, found: dict[str, Measured], missing: dict[str, str]) -> str:
    if name in missing:
        return f'{name}: not measured: {missing[name]}'
    key, result = BY_NAME[name], found[name]
    if key.must is None:
        return f'{name} = {key.number(result):.3g}'
    bounds = f'must {key.bound(key.must)}, aim {key.bound(key.aim)}'
    return f'{name} = {key.number(result):.3g} ({bounds}): {key.verdict(result)}'


def main(arguments: list[str] | None = None) -> None:
    """Measure, write, and judge."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        '--only', nargs='+', metavar='KEY', choices=list(BY_NAME), help='these; nothing is written'
    )
    options = parser.parse_args(arguments)
    conditions: dict[str, Any] = {'machine': machine(), 'versions': versions()}
    found, missing = measure(set(options.only or BY_NAME))
    results = {name: asdict(result) for name, result in found.items()} | conditions
    if options.only:
        print(json.dumps(results, indent=2))
    else:
        RESULTS.write_text(json.dumps(results, indent=2) + '\n', encoding='utf-8')
        write_table(results)
        print(table(results))
    verdicts = {key.name: key.verdict(found[key.name]) for key in KEYS if key.name in found}
    missed = [name for name, verdict in verdicts.items() if verdict == 'MISSED']
    for name in (*missed, *missing):
        _say(f'missed: {_line(name, found, missing)}')
    unjudged = [name for name, verdict in verdicts.items() if verdict.startswith(NOT_JUDGED)]
    if unjudged:
        _say(f'not judged, for the load of others was above {QUIET:g}: {", ".join(unjudged)}')
    sys.exit(1 if missed or missing else NOT_ALL if unjudged else 0)


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == '__main__':
    main()
