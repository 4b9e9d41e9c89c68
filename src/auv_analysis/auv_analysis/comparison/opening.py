"""Sources opened as runs, with names that tell them apart."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

from auv_analysis.bag import open_bag
from auv_analysis.comparison.sources import Source
from auv_analysis.run import AnyRun
from auv_analysis.samples import load_samples
from auv_analysis.simulation import Hold, simulate
from auv_analysis.warm_up import announce


class Named(Protocol):
    """What tells runs apart."""

    @property
    def scenario(self) -> str:
        """Name of the scenario."""

    @property
    def controller(self) -> str:
        """Name of the controller."""


class Opened(NamedTuple):
    """A run and the texts of its scenario and its vehicle, '' where they are not known."""

    run: AnyRun
    scenario_text: str
    vehicle_text: str


def open_source(source: Source, vehicle: str | None = None) -> Opened:
    """Run of a source.

    Parameters
    ----------
    source : of `sources_of`
    vehicle : for bags that do not carry their own

    Raises
    ------
    InputError : it cannot be read
    DivergedError : it is simulated and diverges

    """
    if source.scenario is None:
        run, attachments = open_bag(source.path, vehicle)
        texts = attachments
    else:
        scenario, texts = source.scenario, source.scenario.attachments
        if source.kind == 'samples':
            run = load_samples(source.path, scenario)
        else:
            announce(scenario, [source.controller])
            sampled = 'actuators' in scenario.data or 'sensors' in scenario.data
            hold: Hold = 'zoh' if sampled else 'continuous'
            run = simulate(scenario, source.controller, hold)
    return Opened(run, texts.get('scenario.yaml', ''), texts.get('vehicle.yaml', ''))


def named(runs: Sequence[tuple[Source, Named]], join: str = '/') -> list[str]:
    """Names that tell runs apart, as short as that allows.

    The controller alone where that is enough, else `scenario/controller`; runs of equal names are
    told apart by where they come from, and at last by a number.

    Parameters
    ----------
    runs : each run and where it comes from
    join : stands between the parts of a name

    """
    candidates = [
        (
            run.controller,
            f'{run.scenario}{join}{run.controller}',
            join.join((*_folder(source), run.controller)),
        )
        for source, run in runs
    ]
    for level in range(2):
        names = [candidate[level] for candidate in candidates]
        if len(set(names)) == len(names):
            return names
    doubled = Counter(names)
    names = [c[2] if doubled[c[1]] > 1 else c[1] for c in candidates]
    return numbered(names)


def _folder(source: Source) -> tuple[str, ...]:
    """Last parts of the path that a run was read from, without the part that names the run."""
    if source.kind == 'scenario':
        return ('simulated', source.path.stem)
    parts = Path(source.path).resolve().parent.parts
    return parts[-2:] if len(parts) > 2 else parts[-1:]


def numbered(names: Sequence[str]) -> list[str]:
    """The same names, with a number behind those that have been there."""
    found: list[str] = []
    for name in names:
        number, free = 2, name
        while free in found or (free != name and free in names):
            free, number = f'{name}_{number}', number + 1
        found.append(free)
    return found
