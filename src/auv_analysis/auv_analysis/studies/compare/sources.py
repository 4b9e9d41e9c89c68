"""Arguments of `auv analyze`: bags, samples, result folders, scenarios; sweeps apart."""

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from auv_analysis.bag.any_bag import survey
from auv_analysis.bag.attachments import folder_name
from auv_analysis.bag.foreign_topics import TopicMap, other_odometries, with_candidates
from auv_analysis.bag.load import Recording, open_bag
from auv_analysis.bag.metadata import IN_FOLDERS, files_of, is_csv, is_mcap
from auv_analysis.bag.step_topics import NotOursError
from auv_analysis.output.folder import SWEEP
from auv_analysis.runs.run import Hold
from auv_analysis.runs.samples import ENDING, load_samples
from auv_analysis.scenario.scenario import Scenario, load_scenario
from auv_analysis.simulation.simulate import announce, simulate
from auv_dynamics.files.errors import InputError, refusing
from auv_dynamics.files.shipped import shipped_by_name
from auv_dynamics.files.yaml_files import read_yaml
from auv_dynamics.ros.interface import ODOM
from auv_gvc_controller.laws.law import is_unasked

EXPECTED = 'a bag, a folder of results or of a sweep, or a scenario'
YAML = ('.yaml', '.yml')


@dataclass(frozen=True)
class RunSource:
    """Where one run comes from.

    Attributes
    ----------
    kind : 'bag', 'samples' of `auv simulate`, or 'scenario' that is simulated now
    path : of the bag, the samples or the scenario
    controller : its name; '' of a bag, which says so itself
    scenario : of samples and scenarios, loaded
    mapping : of a bag of another system, what its topics hold; None: nothing was told
    namespace : of the vehicle in a bag; None: what the bag says

    """

    kind: Literal['bag', 'samples', 'scenario']
    path: Path
    controller: str = ''
    scenario: Scenario | None = None
    mapping: TopicMap | None = None
    namespace: str | None = None

    @property
    def files(self) -> list[Path]:
        """Files that are read, which no result may take the place of."""
        if self.kind == 'bag':
            return files_of(self.path)
        inputs = self.scenario.inputs if self.scenario else ()
        return [*([self.path] if self.kind == 'samples' else []), *inputs]


def is_sweep(argument: str) -> bool:
    """Whether an argument is a folder of `auv sweep`."""
    return os.path.isfile(os.path.join(argument, SWEEP))


def sources_of(
    arguments: Sequence[str], mapping: TopicMap | None = None, namespace: str | None = None
) -> list[RunSource]:
    """The runs that arguments stand for, in their order.

    Parameters
    ----------
    arguments : an .mcap, .db3 or .bag file or a folder with such is a bag; a folder of
        `auv simulate`, `auv run` or `auv study` is all runs in it; an .npz file is one simulated
        run; a .yaml file or the bare name of a shipped scenario is simulated, all its controllers
    mapping : of all bags; None: they are those of our nodes
    namespace : of the vehicle in all bags; None: what each says

    Raises
    ------
    InputError : it is none of them, or two of them

    """
    found = [source for argument in arguments for source in _sources(argument)]
    return [
        replace(one, mapping=mapping, namespace=namespace) if one.kind == 'bag' else one
        for one in found
    ]


def _sources(argument: str) -> list[RunSource]:
    path = Path(argument)
    if os.path.isdir(path):
        _refuse_two_meanings(argument, path)
        return _of_folder(path)
    if path.suffix in YAML:
        return _simulated(load_scenario(path))
    if os.path.isfile(path):
        return _of_file(argument, path)
    if len(path.parts) == 1 and not path.suffix:
        return _simulated(load_scenario(_shipped(argument)))
    raise InputError(path, '', EXPECTED, 'no such file or folder')


def _of_file(argument: str, path: Path) -> list[RunSource]:
    if path.suffix == ENDING:
        scenario = _scenario_beside(path)
        scenario.controller(path.stem)
        return [RunSource('samples', path, path.stem, scenario)]
    _refuse_two_meanings(argument, path)
    return [RunSource('bag', path)]


def _scenario_beside(samples: Path) -> Scenario:
    beside = samples.parent / 'scenario.yaml'
    if not beside.is_file():
        expected = 'the scenario.yaml that `auv simulate` wrote beside it'
        raise InputError(samples, '', expected, 'no such file')
    return _brought(beside)


def _brought(path: Path) -> Scenario:
    """Scenario that came with results: it was not asked for, and neither was code that it names."""
    listed = read_yaml(path, 'scenario').get('controllers')
    for name, entry in listed.items() if isinstance(listed, dict) else ():
        law = entry.get('law') if isinstance(entry, dict) else None
        if is_unasked(law):
            expected = 'a shipped law, or --law for one whose module may be imported'
            raise InputError(path, f'controllers.{name}.law', expected, law)
    return load_scenario(path)


def _refuse_two_meanings(argument: str, path: Path) -> None:
    if argument != path.name:
        return  # with a slash in it, it is no bare name
    try:
        named = shipped_by_name('scenarios', argument)
    except InputError:
        return
    kind = 'folder' if os.path.isdir(path) else 'file'
    expected = f'./{argument} for the {kind}, or {named} for the shipped scenario'
    raise InputError(argument, '', expected, 'a name of both')


def _shipped(name: str) -> Path:
    try:
        return shipped_by_name('scenarios', name)
    except InputError as error:
        _, _, names = error.expected.partition('scenarios: ')
        found = 'no such file, folder or name'
        raise InputError(name, '', f'{EXPECTED}, shipped: {names}', found) from None


def _of_folder(folder: Path) -> list[RunSource]:
    """Runs of a folder: a bag is one, results are as many as lie in them."""
    with refusing(folder, '', EXPECTED):
        entries = sorted(folder.iterdir())
    if _make_a_bag(entries):
        return [RunSource('bag', folder)]
    names = _controllers(folder)
    bags = [entry for entry in entries if entry.is_dir() and _make_a_bag(entry.glob('*'))]
    samples = [folder / f'{name}{ENDING}' for name in names]
    samples = [path for path in samples if path.is_file()]
    if bags and samples:
        found = f'both {bags[0].name}/ and {samples[0].name}'
        raise InputError(folder, '', 'bags or samples in a folder, or name one of them', found)
    if samples:
        scenario = _brought(folder / 'scenario.yaml')
        return [RunSource('samples', path, path.stem, scenario) for path in samples]
    if not bags and is_csv(folder):
        return [RunSource('bag', folder)]
    if not bags:
        raise InputError(folder, '', EXPECTED, 'a folder without .mcap files or samples')
    order = {name: i for i, name in enumerate(names)}
    bags.sort(key=lambda bag: order.get(bag.name, len(order)))
    return [RunSource('bag', bag) for bag in bags]


def _make_a_bag(files: Iterable[Path]) -> bool:
    """Whether any of them is one of those that a bag in a folder consists of."""
    return any(file.name.endswith(IN_FOLDERS) for file in files)


def _controllers(folder: Path) -> list[str]:
    """Controllers of the scenario of a folder of results, in its order; none without it."""
    try:
        data = read_yaml(folder / 'scenario.yaml', 'scenario')
        return [str(name) for name in data['controllers']]
    except (OSError, ValueError, TypeError, KeyError):
        return []


def _simulated(scenario: Scenario) -> list[RunSource]:
    return [RunSource('scenario', scenario.path, name, scenario) for name in scenario.controllers]


DEEPEST = 4  # folders of a path in a name


def open_source(source: RunSource, vehicle: str | None = None) -> Recording:
    """Run of a source, with the texts of its scenario and its vehicle where they are known.

    Parameters
    ----------
    source : of `sources_of`
    vehicle : for bags that do not carry their own

    Raises
    ------
    InputError : it cannot be read
    DivergedError : it is simulated and diverges

    """
    scenario = source.scenario
    if scenario is None:
        return _open_bag(source, vehicle)
    if source.kind == 'samples':
        run = load_samples(source.path, scenario)
    else:
        announce(scenario, [source.controller])
        hold: Hold = 'zoh' if scenario.sampled else 'continuous'
        run = simulate(scenario, source.controller, hold)
    return Recording(run, scenario.attachments)


def _open_bag(source: RunSource, vehicle: str | None) -> Recording:
    bag = source.path
    if source.mapping is not None:
        from auv_analysis.bag.foreign_run import load_foreign

        return load_foreign(bag, source.mapping)
    try:
        if not is_mcap(bag):
            raise NotOursError(bag, '', 'an MCAP bag of our nodes', 'a bag of another kind')
        recording = open_bag(bag, vehicle, namespace=source.namespace)
        _check_moving(bag, recording)
        return recording
    except NotOursError as error:
        raise with_candidates(error) from None
    except InputError as error:
        raise _with_others(bag, error) from None


def _check_moving(bag: Path, recording: Recording) -> None:
    """Refuse an odometry of zeros where there is another one."""
    if any(part.nu.any() or part.eta[:, :3].any() for part in recording.run.blocks()):
        return
    types = survey(bag).types
    topic = next((name for name in types if name.endswith(f'/{ODOM}')), ODOM)
    others = other_odometries(types, topic)
    if others:
        raise InputError(bag, topic, f'a motion{others}', 'position and velocity all zero')


def _with_others(bag: Path, error: InputError) -> InputError:
    """The refusal of an odometry, with others that the bag has."""
    if error.key.rpartition('/')[2] != ODOM:
        return error
    others = other_odometries(survey(bag).types, error.key)
    return InputError(error.file, error.key, f'{error.expected}{others}', error.found)


def named(runs: Sequence[tuple[RunSource, Any]], join: str = '/') -> list[str]:
    """Names that tell runs apart, as short as that allows.

    The controller alone where that is enough, else `scenario/controller`; runs of equal names are
    told apart by where they come from, and at last by a number.

    Parameters
    ----------
    runs : where each run comes from, and the run, which has a `scenario` and a `controller`
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


def _by_folder(sources: Sequence[RunSource]) -> list[tuple[str, ...]]:
    """Folders that tell sources apart, as few as do; none where they are all the same."""
    options = [[_folders(source, depth) for source in sources] for depth in range(1, DEEPEST + 1)]
    apart = [len(set(parts)) for parts in options]
    best = max(apart)
    return options[apart.index(best)] if best > 1 else [()] * len(sources)


def _folders(source: RunSource, depth: int) -> tuple[str, ...]:
    """Last folders of the path that a run was read from, without the part that names the run."""
    if source.kind == 'scenario':
        return ('simulated', source.path.stem)
    parts = Path(source.path).resolve().parent.parts[1:][-depth:]
    return tuple(map(folder_name, parts))


def numbered(names: Sequence[str]) -> list[str]:
    """The same names, with a number behind those that have been there."""
    found: list[str] = []
    for name in names:
        number, free = 2, name
        while free in found or (free != name and free in names):
            free, number = f'{name}_{number}', number + 1
        found.append(free)
    return found
