"""Mutation testing: `make mutation MUTANTS=<count or all> SEED=<seed> ONLY=<kinds or paths>`.

Cosmic-ray changes one operator, comparison or number of a formula at a time, `wiring.py` arguments,
keys, names and statements of nodes and of what is shown; a test that `mutation.toml` names for the
file has to fail then. What survives stands in `equivalent.toml` with the reason why no test can
tell, and is subtracted; README.md says more.
"""

import argparse
import random
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue
from typing import Any, NamedTuple

from copies import Copy, Verdict, copies
from cosmic_ray.work_item import MutationSpec
from mutants import mutants

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
WANTED = 0.95  # share of killed mutants, without the equivalent ones


class Tests(NamedTuple):
    """Tests of a file in stages, and whether the kernels that they call are compiled."""

    stages: list[list[str]]
    compiled: bool


def arguments() -> argparse.Namespace:
    """What was asked for."""
    parser = argparse.ArgumentParser(description='Mutation testing.')
    parser.add_argument('--mutants', default='500', help='how many, drawn at random, or all')
    parser.add_argument('--seed', type=int, default=0, help='of the draw')
    parser.add_argument(
        '--only', nargs='*', default=[''], help='kinds of files, or parts of their paths'
    )
    parser.add_argument('--workers', type=int, default=2)
    parser.add_argument(
        '--python', type=Path, default=ROOT / '.venv/bin/python', help='of the tests'
    )
    given = parser.parse_args()
    if given.mutants != 'all' and not given.mutants.isdecimal():
        parser.error(f'MUTANTS: expected a count or all, found {given.mutants}')
    return given


def verdicts(
    chosen: list[MutationSpec], tests: dict[Path, Tests], python: Path, workers: int
) -> Iterator[Verdict]:
    """Verdicts in the order of the mutants, as they come."""
    with copies(ROOT, workers, python) as made, ThreadPoolExecutor(workers) as pool:
        used = [tests[path] for path in {mutant.module_path for mutant in chosen}]
        first = sorted(
            {(one.compiled, name) for one in used for stage in one.stages for name in stage}
        )
        complaints = list(
            pool.map(Copy.complaint, made, (first[i::workers] for i in range(workers)))
        )
        if any(complaints):
            sys.exit('without any mutant the tests fail\n' + ''.join(complaints))
        free: SimpleQueue[Copy] = SimpleQueue()
        for one in made:
            free.put(one)

        def judge(mutant: MutationSpec) -> Verdict:
            copy = free.get()
            try:
                return copy.verdict(mutant, *tests[mutant.module_path])
            finally:
                free.put(copy)

        try:
            yield from pool.map(judge, chosen)
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def squeezed(line: str) -> str:
    """A line without blanks: cosmic-ray leaves some before a number."""
    return ''.join(line.split())


def equivalents() -> set[tuple[str, str, str]]:
    """File, line before and line after of the mutants that are known to be equivalent."""
    groups = tomllib.loads((HERE / 'equivalent.toml').read_text(encoding='utf-8'))['equivalent']
    return {
        (group['file'], squeezed(before), squeezed(after))
        for group in groups
        for before, after in group['mutants']
    }


def files_of(plan: dict[str, Any], kind: str) -> Iterator[tuple[Path, list[str]]]:
    """Files of a kind and their tests; of a folder those that no kind lists by name."""
    named = {ROOT / 'src' / place for one in plan['quick'] for place in plan[one]}
    for place, own in plan[kind].items():
        path = ROOT / 'src' / place
        inside = set(path.rglob('*.py')) - named
        yield from ((file, own) for file in (inside if path.is_dir() else [path]))


def main() -> int:
    """Draw mutants, try them, print what survived and the ratio; 1 below 95 %."""
    given = arguments()
    plan = tomllib.loads((HERE / 'mutation.toml').read_text(encoding='utf-8'))
    equivalent = equivalents()
    tests = {
        path: Tests([plan['quick'][kind], own], kind in plan['compiled'])
        for kind in plan['quick']
        for path, own in files_of(plan, kind)
        if any(part in f'{kind} {path.relative_to(ROOT / "src")}' for part in given.only)
    }
    wiring = {path for kind in plan['wiring'] for path, _ in files_of(plan, kind)}
    every = mutants(sorted(tests), wiring)
    count = len(every) if given.mutants == 'all' else min(int(given.mutants), len(every))
    chosen = sorted(random.Random(given.seed).sample(range(len(every)), count))
    print(f'{count} of {len(every)} mutants of {len(tests)} files, seed {given.seed}', flush=True)

    tally: Counter[str] = Counter()
    for i, one in enumerate(
        verdicts([every[k] for k in chosen], tests, given.python, given.workers), start=1
    ):
        listed = (one.file, squeezed(one.before), squeezed(one.after)) in equivalent
        outcome = 'equivalent' if listed and one.outcome == 'survived' else one.outcome
        tally[outcome] += 1
        where = f'{one.file}:{one.line}: {one.operator}\n    - {one.before}\n    + {one.after}'
        if outcome == 'survived':
            print(f'{i}/{count} survived: {where}', flush=True)
        elif listed and outcome != 'equivalent':
            print(f'{i}/{count} listed as equivalent, but {outcome}: {where}', flush=True)
        elif i % 25 == 0:
            print(f'{i}/{count}', flush=True)
    dead, tried = tally['killed'] + tally['timeout'], count - tally['equivalent']
    ratio = dead / tried if tried else 1.0
    print(
        f'{count} mutants, {tally["equivalent"]} equivalent: of the other {tried}, {dead} killed '
        f'({tally["timeout"]} by the clock), {tally["survived"]} survived: {100 * ratio:.1f} %'
    )
    return 0 if ratio >= WANTED else 1


if __name__ == '__main__':
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit('interrupted: the copies are removed, the checkout was not touched')
