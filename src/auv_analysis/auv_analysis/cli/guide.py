"""`auv` without a command: where the user is, and the next steps."""

import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from shlex import quote
from typing import NamedTuple

from auv_dynamics.files.errors import printable

RUNS = 'runs'
LOOKED_AT = 200  # files and folders: an answer must not take long
LONGEST = 1 << 16  # bytes of a YAML file that are looked at
SHOWN = 3
KINDS = {  # what only a file of its kind has at its beginning of a line, or none of those below
    'campaign': re.compile(rb'^vary:', re.M),
    'scenario': re.compile(rb'^controllers:', re.M),
    'vehicle': re.compile(rb'^rigid_body:', re.M),
}


class Step(NamedTuple):
    """Something that can be typed, and what it does."""

    line: str
    text: str


def print_guide(folder: Path) -> None:
    """Print what is there and a few lines that could be typed next.

    Parameters
    ----------
    folder : that one works in

    """
    results, files = _results(folder / RUNS), _files(folder)
    found = [*_of_results(results), *_of_files(files)]
    heading = 'Nothing has been run here yet. To begin with:'
    if found:
        heading = 'What could come next:'
    steps = found or [
        Step('auv simulate case1', "the paper's Case 1 in seconds, with a report"),
        Step('auv run case1', 'the same on real ROS 2 nodes, recorded'),
        Step('auv check-vehicle rexrov', 'what the file of a vehicle means for control'),
    ]
    if not files:
        steps += [Step('auv new vehicle NAME', 'a commented file of your own; or scenario, law')]
    steps += [
        Step('auv doctor', 'whether the set-up is sound'),
        Step('auv --help', 'all commands'),
    ]
    width = max(len(step.line) for step in steps)
    lines = [f'  {step.line:<{width}}  {step.text}' for step in steps]
    print(printable('\n'.join([heading, *lines])))


def _results(runs: Path) -> list[Path]:
    """Folders of results, the newest first."""
    try:
        there = [path for path in islice(runs.iterdir(), LOOKED_AT) if path.is_dir()]
        return sorted(there, key=lambda path: -path.stat().st_mtime)
    except OSError:
        return []


def _files(folder: Path) -> list[tuple[str, Path]]:
    """Kind and path of the YAML files of this project that lie in a folder."""
    found = []
    try:
        names = sorted(islice((p for p in folder.iterdir() if p.suffix == '.yaml'), LOOKED_AT))
        for path in names:
            with path.open('rb') as file:
                text = file.read(LONGEST)
            found += [(kind, path) for kind, mark in KINDS.items() if mark.search(text)][:1]
    except OSError:
        pass  # what cannot be read is not proposed
    return found


def _of_results(results: list[Path]) -> Iterator[Step]:
    if not results:
        return
    newest = results[0]
    if (newest / 'report.html').is_file():
        yield Step(f'xdg-open {quote(str(newest / "report.html"))}', 'the newest report')
    if (newest / 'sweep.json').is_file():
        yield Step(f'auv analyze {quote(str(newest))}', 'what the sweep says')
    bag = next((path.parent for path in newest.glob('*/metadata.yaml')), None)
    if bag is not None:
        yield Step(f'auv replay {quote(str(bag))}', 'the recorded run again, as live topics')
    compared = [quote(str(path)) for path in results if _has_runs(path)][:2]
    if len(compared) == 2:
        yield Step(f'auv analyze {compared[1]} {compared[0]}', 'the two newest, side by side')


def _has_runs(folder: Path) -> bool:
    """Whether results have runs that can be analysed again: samples or bags."""
    parts = ('*.npz', '*/metadata.yaml')
    return (folder / 'summary.json').is_file() and any(any(folder.glob(part)) for part in parts)


def _of_files(files: list[tuple[str, Path]]) -> Iterator[Step]:
    lines = {
        'scenario': Step('auv simulate {}', 'your scenario; auv run {} takes real nodes'),
        'vehicle': Step('auv check-vehicle {}', 'what your vehicle means for control'),
        'campaign': Step('auv sweep {}', 'your campaign'),
    }
    for kind, path in files[:SHOWN]:
        yield Step(*(text.format(quote(path.name)) for text in lines[kind]))
