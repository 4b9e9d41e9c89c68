"""Campaign file, format 1: the rollouts of a scenario, resolved and checked."""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from auv_analysis.runs.run import Hold
from auv_analysis.scenario.changes import (
    VEHICLE,
    Parts,
    check_paths,
    split,
)
from auv_analysis.scenario.scenario import SAMPLED, Scenario, load_scenario, vehicle_path_of
from auv_analysis.simulation.simulate import check_hold
from auv_analysis.studies.sweep.variation import Group, Values, kind_of, make_group
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.nearest import meant, one_of
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import check, dotted, read_yaml
from auv_dynamics.vehicle.vehicle_file import vehicle_from_dict
from auv_gvc_controller.laws.law import SHIPPED

SCHEMA = Path(__file__).with_name('campaign.schema.json')
EVERY = 'controllers.*.'  # begins a path into each controller of the sweep
NOT_VARIED = {
    'seed': "nothing: a rollout's seed follows from the campaign's",
    'name': 'nothing: a sweep has one name',
    'format': 'nothing: there is one format',
    'setpoint.file': 'nothing: one file, or a set-point of offsets and terms',
    'controllers': 'a path into one of them, or into each, such as controllers.*.k_D',
}
MOST_ROLLOUTS = 2**53
STEPS_AT_ONCE = 1_000_000  # of a block, about: a fraction of a second, compiled
PLAIN_BLOCK = 8  # rollouts of a user's own law: as plain Python a second or more each
SMALLEST_BLOCK, LARGEST_BLOCK = 16, 1024
BLOCKS_AT_LEAST = 8  # so that every core has something to do
MOST_PARTS = 256  # files of a result, about
# of NumPy's SeedSequence, which is O'Neill's `seed_seq_fe`: starts and factors of its hashes
HASH_POOL, TIMES_POOL = 0x43B0D7E5, 0x931E8875
HASH_STATE, TIMES_STATE = 0x8B51F9DD, 0x58F38DED
TIMES_BEFORE, TIMES_HASHED = 0xCA01F9DD, 0x4973F715


@dataclass(frozen=True, eq=False)
class Campaign:
    """A checked campaign.

    Attributes
    ----------
    path : of the campaign file
    data : its contents with every default filled in
    scenario : as it is in its file
    scenarios : name of a vehicle -> the scenario with it, which other values may have to make
        valid; '' -> the scenario as it is, where the vehicle does not vary
    groups : what varies together, the last one fastest

    """

    path: Path
    data: dict[str, Any]
    scenario: Scenario
    scenarios: dict[str, Scenario]
    groups: list[Group]

    @property
    def name(self) -> str:
        """Name, which is also that of the results' folder."""
        return self.data['name']

    @property
    def controllers(self) -> list[str]:
        """Names of the controllers that are swept."""
        return self.data['controllers']

    @property
    def hold(self) -> Hold:
        """Whether the law is inside every stage, or sampled and held."""
        return self.data['hold']

    @property
    def own_laws(self) -> dict[str, type]:
        """Controller -> its law, where that is a user's own."""
        laws = {name: type(self.scenario.gains(name)) for name in self.controllers}
        return {name: law for name, law in laws.items() if law not in SHIPPED.values()}

    @property
    def inputs(self) -> list[Path]:
        """Files that the campaign was read from."""
        scenarios = (self.scenario, *self.scenarios.values())
        files = [file for scenario in scenarios for file in scenario.inputs]
        return list(dict.fromkeys([self.path, *files]))

    @cached_property
    def rollouts(self) -> int:
        """Number of rollouts, of every controller the same."""
        return int(np.prod([group.size for group in self.groups], dtype=object))

    @property
    def block(self) -> int:
        """Rollouts that are simulated and stored at once."""
        if 'block' in self.data:
            return self.data['block']
        by_length = STEPS_AT_ONCE // self.scenario.steps
        shared = min(by_length, -(-self.rollouts // BLOCKS_AT_LEAST))
        size = min(max(shared, SMALLEST_BLOCK), LARGEST_BLOCK)
        if self.own_laws:
            size = min(size, PLAIN_BLOCK)
        return max(size, -(-self.rollouts // MOST_PARTS))

    def values(self, first: int, last: int) -> dict[str, Values]:
        """Path -> values of the rollouts from `first` up to, not including, `last`."""
        found: dict[str, Values] = {}
        index, inner = np.arange(first, last), self.rollouts
        for group in self.groups:
            inner //= group.size
            found |= group.at(index // inner % group.size)
        return found

    def seeds(self, first: int, last: int) -> np.ndarray:
        """Seeds (n,) of these rollouts, each a function of the root seed and its index alone."""
        words = first_words(self.data['seed'], np.arange(first, last, dtype=np.uint64))
        return (words >> np.uint64(1)).astype(np.int64)


def first_words(root: int, indices: np.ndarray) -> np.ndarray:
    """First 64-bit word of NumPy's `SeedSequence(root, spawn_key=(i,))`, of many i at once.

    Parameters
    ----------
    root : from 0 on
    indices : (n,) uint64, the i

    Returns
    -------
    words : (n,) uint64

    """
    pool = [np.full(len(indices), word) for word in np.random.SeedSequence(root).pool]
    low, high = indices.astype(np.uint32), (indices >> np.uint64(32)).astype(np.uint32)
    rounds = 4 * max(4, -(-root.bit_length() // 32))  # that the root took, four for each word
    factor = HASH_POOL * pow(TIMES_POOL, rounds, 1 << 32) % (1 << 32)
    for word, there in ((low, np.ones(len(low), bool)), (high, high > 0)):
        for i, before in enumerate(pool):
            hashed, factor = _hashed(word, factor, TIMES_POOL)
            mixed: np.ndarray = np.uint32(TIMES_BEFORE) * before - np.uint32(TIMES_HASHED) * hashed
            pool[i] = np.where(there, mixed ^ mixed >> np.uint32(16), before)
    first, factor = _hashed(pool[0], HASH_STATE, TIMES_STATE)
    second, _ = _hashed(pool[1], factor, TIMES_STATE)
    return first | second.astype(np.uint64) << np.uint64(32)


def _hashed(words: np.ndarray, factor: int, times: int) -> tuple[np.ndarray, int]:
    """Words (n,) after one round of the hash, and the factor of the next round."""
    following = factor * times % (1 << 32)
    words = (words ^ np.uint32(factor)) * np.uint32(following)
    return words ^ words >> np.uint32(16), following


def load_campaign(campaign: str | Path) -> Campaign:
    """Campaign of a file or of a shipped bare name.

    Parameters
    ----------
    campaign : path of a campaign file, or a bare name such as 'case1_gains'

    Returns
    -------
    campaign : Campaign, checked with its scenario and vehicles

    Raises
    ------
    InputError : naming file, key, expected and found

    """
    path = shipped('campaigns', campaign)
    data = read_yaml(path, 'campaign')
    check(data, SCHEMA, path)
    scenario = _scenario(data['scenario'], path)
    data = {
        'format': 1,
        'controllers': list(scenario.controllers),
        'hold': 'continuous',
        'seed': 0,
        **data,
    }
    data |= {key: int(data[key]) for key in ('seed', 'block') if key in data}  # 5.0 is 5
    for i, name in enumerate(data['controllers']):
        if name not in scenario.controllers:
            expected = one_of(name, scenario.controllers)
            raise InputError(path, f'controllers[{i}]', expected, name)
    check_hold(scenario, data['hold'])
    groups = [make_group(spec, data['seed'], i, path) for i, spec in enumerate(data['vary'])]
    result = Campaign(path, data, scenario, _scenarios(scenario, data, path), groups)
    if result.rollouts > MOST_ROLLOUTS:
        raise InputError(path, 'vary', f'at most {MOST_ROLLOUTS} rollouts', f'{result.rollouts}')
    _check_varied(result)
    return result


def _scenario(named: str, campaign: Path) -> Scenario:
    beside = campaign.parent / named
    if beside.is_file():
        return load_scenario(beside)
    try:
        path = shipped('scenarios', named)
    except InputError as error:
        raise InputError(campaign, 'scenario', error.expected, named) from None
    return load_scenario(path if path != Path(named) else beside)


def _scenarios(scenario: Scenario, data: dict[str, Any], path: Path) -> dict[str, Scenario]:
    """The scenario with each vehicle that is named."""
    for number, spec in enumerate(data['vary']):
        kind = kind_of(spec)
        if VEHICLE in spec[kind]:
            named = spec[kind][VEHICLE]
            names = named.get('choice') if isinstance(named, dict) else named
            if not names or not all(isinstance(name, str) for name in names):
                expected = 'a list of names or paths of vehicles'
                raise InputError(path, f'vary[{number}].{kind}.{VEHICLE}', expected, named)
            return {name: _with_vehicle(scenario, name) for name in names}
    return {'': scenario}


def _with_vehicle(scenario: Scenario, name: str) -> Scenario:
    path = vehicle_path_of(name, scenario.path)
    contents = read_yaml(path, 'vehicle')
    vehicle = vehicle_from_dict(contents, path)
    data = {**scenario.data, VEHICLE: name}
    return replace(scenario, vehicle_path=path, vehicle=vehicle, vehicle_data=contents, data=data)


def _check_varied(campaign: Campaign) -> None:
    """Refuse paths that lead nowhere, that must not vary or that stand twice."""
    seen: dict[Parts, str] = {}
    for number, spec in enumerate(campaign.data['vary']):
        for path in spec[kind_of(spec)]:
            place = f'vary[{number}].{kind_of(spec)}.{path}'
            try:
                _check_path(campaign, path)
            except InputError as error:
                raise InputError(campaign.path, place, error.expected, error.found) from None
            for parts in {split(of_controller(path, name)) for name in campaign.controllers}:
                if parts in seen:
                    found = f'{dotted(parts)} in {seen[parts]} as well'
                    raise InputError(campaign.path, place, 'each value varied once', found)
                seen[parts] = f'vary[{number}]'


def _check_path(campaign: Campaign, path: str) -> None:
    parts, names = split(path), campaign.controllers
    if (name := dotted(parts)) in NOT_VARIED:
        raise InputError(path, '', NOT_VARIED[name], path)
    if campaign.hold == 'continuous' and parts[0] in SAMPLED:
        expected = 'hold: zoh in the campaign: they act on samples'
        raise InputError(path, '', expected, 'hold: continuous')
    for scenario in campaign.scenarios.values():
        check_paths(scenario, [of_controller(path, name) for name in names])
    if parts[0] == 'controllers' and parts[1] not in ('*', *names):
        expected = f'a controller that is swept: {", ".join(names)}{meant(parts[1], names)}'
        raise InputError(path, '', expected, str(parts[1]))


def concerns(path: str, controller: str) -> bool:
    """Whether what varies at a path of a campaign affects a controller's loop."""
    parts = split(path)
    return parts[0] != 'controllers' or parts[1] in ('*', controller)


def of_controller(path: str, controller: str) -> str:
    """Path of a campaign as it reads for one controller: `controllers.*` is each of them."""
    if not path.startswith(EVERY):
        return path
    key = f"'{controller}'" if '.' in controller else controller
    return f'controllers.{key}.{path.removeprefix(EVERY)}'
