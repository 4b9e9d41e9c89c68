"""Sources opened as runs, with names that tell them apart."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

from auv_analysis.bag import open_bag
from auv_analysis.bag.contents import NotOursError
from auv_analysis.bag.files import is_mcap
from auv_analysis.bag.load import Recording
from auv_analysis.comparison.sources import Source
from auv_analysis.foreign.candidates import with_candidates
from auv_analysis.run import AnyRun
from auv_analysis.samples import load_samples
from auv_analysis.simulation import Hold, simulate
from auv_analysis.warm_up import announce

DEEPEST = 4  # folders of a path in a name


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
        run, texts = _open_bag(source, vehicle)
    else:
        scenario, texts = source.scenario, source.scenario.attachments
        if source.kind == 'samples':
            run = load_samples(source.path, scenario)
        else:
            announce(scenario, [source.controller])
            hold: Hold = 'zoh' if scenario.sampled else 'continuous'
            run = simulate(scenario, source.controller, hold)
    return Opened(run, texts.get('scenario.yaml', ''), texts.get('vehicle.yaml', ''))


def _open_bag(source: Source, vehicle: str | None) -> Recording:
    bag = source.path
    if source.mapping is not None:
        from auv_analysis.foreign.load import load_foreign  # with libraries that load slowly

        return load_foreign(bag, source.mapping)
    try:
        if not is_mcap(bag):
            raise NotOursError(bag, '', 'an MCAP bag of our nodes', 'a bag of another kind')
        return open_bag(bag, vehicle, namespace=source.namespace)
    except NotOursError as error:
        raise with_candidates(error) from None


def named(runs: Sequence[tuple[Source, Named]], join: str = '/') -> list[str]:
    """Names that tell runs apart, as short as that allows.

    The controller alone where that is enough, else `scenario/controller`; runs of equal names are
    told apart by where they come from, and at last by a number.

    Parameters
    ----------
    runs : each run and where it comes from
    join : stands between the parts of a name

    """
    controllers = [run.controller for _, run in runs]
    if len(set(controllers)) == len(runs):
        return controllers
    names = [f'{run.scenario}{join}{run.controller}' for _, run in runs]
    for name in set(names):
        same = [i for i, other in enumerate(names) if other == name]
        found = _by_folder([runs[i][0] for i in same])
        for i, parts in zip(same, found, strict=True):
            names[i] = join.join((*parts, runs[i][1].controller)) if parts else name
    return numbered(names)


def _by_folder(sources: Sequence[Source]) -> list[tuple[str, ...]]:
    """Folders that tell sources apart, as few as do; none where they are all the same."""
    options = [[_folders(source, depth) for source in sources] for depth in range(1, DEEPEST + 1)]
    apart = [len(set(parts)) for parts in options]
    best = max(apart)
    return options[apart.index(best)] if best > 1 else [()] * len(sources)


def _folders(source: Source, depth: int) -> tuple[str, ...]:
    """Last folders of the path that a run was read from, without the part that names the run."""
    if source.kind == 'scenario':
        return ('simulated', source.path.stem)
    return Path(source.path).resolve().parent.parts[1:][-depth:]


def numbered(names: Sequence[str]) -> list[str]:
    """The same names, with a number behind those that have been there."""
    found: list[str] = []
    for name in names:
        number, free = 2, name
        while free in found or (free != name and free in names):
            free, number = f'{name}_{number}', number + 1
        found.append(free)
    return found
