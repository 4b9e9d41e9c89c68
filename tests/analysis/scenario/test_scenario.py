"""Scenario files: defaults, where the vehicle is found, the resolved data, and the schemas."""

import json
import re
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
import yaml

from auv_analysis import load_scenario
from auv_analysis.scenario import scenario as scenario_module
from auv_analysis.scenario.scenario import Scenario, check_names, write_inputs
from auv_analysis.studies.sweep import campaign
from auv_dynamics import load_vehicle
from auv_dynamics.files import yaml_files
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.shipped import shipped
from auv_dynamics.plant.parameters import SCHEMA
from auv_dynamics.vehicle import vehicle_file

ROOT = Path(__file__).resolve().parents[3]
SCHEMAS = {
    'vehicles': vehicle_file.SCHEMA, 'scenarios': SCHEMA, 'campaigns': campaign.SCHEMA,
}  # fmt: skip
SHIPPED = sorted(p for kind in SCHEMAS for p in (ROOT / 'config' / kind).glob('*.yaml'))
LEAST = {
    'name': 'least',
    'vehicle': 'rexrov',
    'duration': 4,
    'step': 0.5,
    'controllers': {'only': {'law': 'gvc', 'k_D': 1, 'k_I': 1, 'Lambda': 1, 'Gamma': 1}},
    'setpoint': {},
}
TABLE = 't,surge,sway,heave,roll,pitch,yaw\n0,0,0,0,0,0,0\n4,2,0,0,0,0,0\n'
HARMONIC = {'kind': 'harmonic', 'heave': {'offset': 5}}


def written(folder: Path, **changes: Any) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / 'scenario.yaml'
    path.write_text(yaml.safe_dump({**LEAST, **changes}))
    return path


def loaded(folder: Path, **changes: Any) -> Scenario:
    return load_scenario(written(folder, **changes))


def test_defaults_are_filled_in(tmp_path: Path) -> None:
    scenario = loaded(tmp_path)
    assert scenario.data == {
        **LEAST,
        'format': 1,
        'duration': 4.0,
        'integrator': 'ode5',
        'seed': 0,
        'initial': {'eta': [0.0] * 6, 'nu': [0.0] * 6},
        'disturbance': [],
    }
    assert (scenario.steps, scenario.step_ns) == (8, 500_000_000)
    for vector in scenario.initial:
        np.testing.assert_array_equal(vector, np.zeros(6))
    t = np.linspace(0, 4, 9)
    np.testing.assert_array_equal(scenario.setpoint.value(t), np.zeros((9, 6)))
    np.testing.assert_array_equal(scenario.uncertainty.F(t), np.zeros((9, 6)))


def test_half_an_initial_state_is_filled_up(tmp_path: Path) -> None:
    eta, nu = loaded(tmp_path, initial={'nu': [1, 2, 3, 4, 5, 6]}).initial
    np.testing.assert_array_equal(eta, np.zeros(6))
    np.testing.assert_array_equal(nu, [1, 2, 3, 4, 5, 6])


def test_whole_numbers_are_numbers(tmp_path: Path) -> None:
    data = loaded(tmp_path, step=1, seed=3.0, initial={'eta': [1] * 6}).data
    numbers = [data['step'], data['duration'], *data['initial']['eta']]
    assert {type(number) for number in numbers} == {float}
    assert (type(data['seed']), data['seed']) == (int, 3)


@pytest.mark.parametrize(
    ('step', 'duration', 'steps'),
    [(0.01, 30.0, 3000), (0.1, 0.3, 3), (1e-9, 1e-9, 1), (0.001, 1e3, 10**6), (0.3, 0.9, 3)],
)
def test_steps_are_counted_without_rounding(step, duration, steps, tmp_path) -> None:
    scenario = loaded(tmp_path, step=step, duration=duration)
    assert scenario.steps == steps
    assert scenario.step_ns * steps == round(duration * 1e9)


@pytest.mark.parametrize('spelling', ['bare', 'beside', 'no ending', 'relative', 'absolute'])
def test_vehicle_is_found(spelling, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'vehicles').mkdir()
    text = shipped('vehicles', 'rexrov').read_text()
    for name in ('vehicles/mine.yaml', 'case/mine.yaml', 'case/mine'):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    vehicle, path = {
        'bare': ('rexrov', shipped('vehicles', 'rexrov')),
        'beside': ('mine.yaml', tmp_path / 'case/mine.yaml'),
        'no ending': ('mine', tmp_path / 'case/mine'),
        'relative': ('../vehicles/mine.yaml', tmp_path / 'vehicles/mine.yaml'),
        'absolute': (str(tmp_path / 'vehicles/mine.yaml'), tmp_path / 'vehicles/mine.yaml'),
    }[spelling]
    scenario = loaded(tmp_path / 'case', vehicle=vehicle)
    assert scenario.vehicle_path.resolve() == path.resolve()
    assert scenario.inputs == [tmp_path / 'case/scenario.yaml', scenario.vehicle_path]
    np.testing.assert_array_equal(scenario.vehicle.M, load_vehicle('rexrov').M)
    assert scenario.attachments['vehicle.yaml'] == text
    assert scenario.shipped_vehicle == ('rexrov' if spelling == 'bare' else None)


@pytest.mark.parametrize('vehicle', ['mine.yaml', 'mine'])
def test_vehicle_in_the_working_directory_is_not_taken(vehicle, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)  # a path is relative to the scenario, wherever the command runs
    (tmp_path / vehicle).write_text(shipped('vehicles', 'rexrov').read_text())
    with pytest.raises(InputError, match='vehicle'):
        loaded(tmp_path / 'case', vehicle=vehicle)


def test_bare_name_is_not_hidden_by_a_file_that_happens_to_be_here(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ('rexrov', 'case1'):
        (tmp_path / name).mkdir()  # such as an earlier --out
    assert loaded(tmp_path / 'case').vehicle.name == 'rexrov'
    assert load_scenario('case1').name == 'case1'


@pytest.mark.parametrize('several', [False, True])
def test_disturbance_is_one_or_a_list(several: bool, tmp_path: Path) -> None:
    scenario = loaded(tmp_path, disturbance=[HARMONIC] if several else HARMONIC)
    assert scenario.data['disturbance'] == [HARMONIC]
    np.testing.assert_array_equal(scenario.uncertainty.F(np.zeros(1)), [[0, 0, 5, 0, 0, 0]])


def test_disturbances_add_up(tmp_path: Path) -> None:
    t = np.linspace(0, 4, 9)
    paper = loaded(tmp_path, disturbance={'kind': 'herman2018'}).uncertainty.F(t)
    both = loaded(tmp_path, disturbance=[{'kind': 'herman2018'}, HARMONIC]).uncertainty.F(t)
    np.testing.assert_allclose(both - paper, np.tile([0, 0, 5.0, 0, 0, 0], (9, 1)), atol=1e-12)


def test_setpoint_file_is_relative_to_the_scenario(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'case').mkdir()
    (tmp_path / 'case' / 'x.csv').write_text(TABLE)
    scenario = loaded(tmp_path / 'case', setpoint={'file': 'x.csv'})
    assert scenario.data['setpoint'] == {'file': str((tmp_path / 'case/x.csv').resolve())}
    assert scenario.attachments['setpoint.csv'] == TABLE
    assert scenario.inputs[-1] == (tmp_path / 'case/x.csv').resolve(), 'no result may replace it'
    assert scenario.setpoint.value(1.0)[0] == pytest.approx(0.5)


def test_setpoint_file_with_a_byte_order_mark_is_read(tmp_path: Path) -> None:
    (tmp_path / 'x.csv').write_text(TABLE, encoding='utf-8-sig')  # as spreadsheets save it
    scenario = loaded(tmp_path, setpoint={'file': 'x.csv'})
    assert scenario.setpoint.value(4.0)[0] == pytest.approx(2.0)


@pytest.mark.parametrize('setpoint', [{'surge': {'offset': 1}}, {'file': 'x.csv'}])
def test_resolved_files_load_to_the_same_scenario(setpoint, tmp_path) -> None:
    (tmp_path / 'x.csv').write_text(TABLE)
    scenario = loaded(tmp_path, setpoint=setpoint, disturbance=HARMONIC, seed=7)
    out = tmp_path / 'out'
    out.mkdir()
    again = load_scenario(write_inputs(scenario, out)['scenario.yaml'])
    different = {'vehicle', 'setpoint'} if 'file' in setpoint else {'vehicle'}
    for key in scenario.data.keys() - different:
        assert again.data[key] == scenario.data[key]
    np.testing.assert_array_equal(again.vehicle.M, scenario.vehicle.M)
    t = np.linspace(0, 4, 9)
    np.testing.assert_array_equal(again.setpoint.value(t), scenario.setpoint.value(t))


def test_unknown_controller_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r'scenario.yaml: controllers: expected .*only.* found pid'
    ):
        loaded(tmp_path).controller('pid')


@pytest.mark.parametrize('path', SHIPPED, ids=lambda path: path.stem)
def test_shipped_file_names_the_schema_that_accepts_it(path: Path) -> None:
    text = path.read_text(encoding='utf-8')
    match = re.match(r'# yaml-language-server: \$schema=(\S+)\n', text)
    assert match is not None
    schema = (path.parent / match[1]).resolve()
    assert schema == SCHEMAS[path.parent.name].resolve()
    accepts = jsonschema.Draft202012Validator(json.loads(schema.read_text(encoding='utf-8')))
    accepts.validate(yaml.safe_load(text))


@pytest.mark.parametrize('path', SHIPPED, ids=lambda path: path.stem)
def test_shipped_file_loads_by_its_bare_name(path: Path) -> None:
    load = {
        'vehicles': load_vehicle, 'scenarios': load_scenario, 'campaigns': campaign.load_campaign,
    }[path.parent.name]  # fmt: skip
    assert load(path.stem).name == path.stem
    assert shipped(path.parent.name, path.stem).samefile(path)


POWER = re.compile(r'(\d+)\^(\d+)(?: - (1))?')  # such as 2^63 - 1
RANGES = {  # in a title: what it says of a number
    r'positive()': ('exclusiveMinimum',),
    r'from (-?\d+) to (-?\d+)': ('minimum', 'maximum'),
    r'from (-?\d+) up': ('minimum',),
    r'above (-?\d+)': ('exclusiveMinimum',),
    r'up to (-?\d+)': ('maximum',),
}
SIZES = {  # and of a text, a list, a mapping
    'string': {r'at most (\d+) characters': ('maxLength',)},
    'array': {
        r'^(\d+) numbers': ('minItems', 'maxItems'),
        r', at most (\d+)$': ('maxItems',),
        r'list of at least (one)': ('minItems',),
    },
    'object': {r'mapping of at least (one)': ('minProperties',)},
}


def said(title: str, patterns: dict[str, tuple[str, ...]]) -> dict[str, int]:
    """Keys of a schema, with the numbers that a title has in words."""
    words = POWER.sub(lambda m: str(int(m[1]) ** int(m[2]) - int(m[3] or 0)), title)
    found: dict[str, int] = {}
    for pattern, keys in patterns.items():
        if match := re.search(pattern, words):
            numbers = [int(word.replace('one', '1') or 0) for word in match.groups()]
            found |= dict(zip(keys, numbers * 2, strict=False))
    return found


def contradictions(node: Any, title: str = '') -> Iterator[str]:
    """Titles, of a node or of one that it is in, whose words are not what is checked."""
    if isinstance(node, list):
        for entry in node:
            yield from contradictions(entry, title)
    if not isinstance(node, dict):
        return
    title = node['title'] if isinstance(node.get('title'), str) else title
    kind = node.get('type')
    if kind in ('number', 'integer'):
        there = {key: node[key] for keys in RANGES.values() for key in keys if key in node}
        if there != said(title, RANGES):
            yield title
    sizes = said(title, SIZES.get(kind, {})) if isinstance(kind, str) and 'title' in node else {}
    if not sizes.items() <= node.items():
        yield title
    if 'enum' in node and sorted(re.findall(r'[\w-]+', title)) != sorted(
        [*map(str, node['enum']), 'or']
    ):
        yield title
    for key, entry in node.items():
        if key not in ('title', 'description', 'default', 'examples', 'enum', 'const'):
            yield from contradictions(entry, title)


@pytest.mark.parametrize('kind', SCHEMAS)
def test_schema_is_one_and_says_what_is_expected_everywhere(kind: str) -> None:
    schema = json.loads(SCHEMAS[kind].read_text(encoding='utf-8'))
    jsonschema.Draft202012Validator.check_schema(schema)
    for name, entry in schema['properties'].items():
        assert entry.get('title'), name
    assert list(contradictions(yaml_files.schema(SCHEMAS[kind]))) == []


def test_a_run_of_too_many_steps_is_refused(tmp_path: Path) -> None:
    assert loaded(tmp_path, step=1e-3, duration=1e4).steps == scenario_module.MOST_STEPS
    with pytest.raises(InputError, match='duration: expected at most 10000000 steps'):
        loaded(tmp_path, step=1e-3, duration=10000.001)


@pytest.mark.parametrize('name', ['summary', 'gvc'])
def test_no_controller_has_the_name_of_our_own_files(name: str, tmp_path: Path) -> None:
    check_names(['gvc', name], tmp_path)
    for ours in ('summary.json', 'unfinished', 'rollouts'):
        with pytest.raises(InputError, match=f'our own files, found {ours}'):
            check_names([ours], tmp_path)
    refused = pytest.raises(InputError, match=f'controllers: .* our own files, found {name}')
    with refused if name == 'summary' else nullcontext():
        check_names(['gvc', name], tmp_path, ('.npz', '.json'))


def test_gains_of_every_controller_are_checked(tmp_path: Path) -> None:
    pid = {'law': 'pid', 'k_P': 1, 'k_I': 1, 'k_D': 1, 'omega_f': -1}
    with pytest.raises(InputError, match=r'controllers\.pid\.omega_f: expected a positive'):
        loaded(tmp_path, controllers={**LEAST['controllers'], 'pid': pid})


def test_all_kinds_of_disturbances_are_known(tmp_path: Path) -> None:
    scenario = loaded(tmp_path, disturbance=[HARMONIC, {'kind': 'herman2018'}])
    assert scenario.kinds == {'harmonic', 'herman2018'}


def test_a_scenario_is_printed_in_a_line(tmp_path: Path) -> None:
    controllers = dict.fromkeys(('one', 'other'), LEAST['controllers']['only'])
    text = repr(loaded(tmp_path, controllers=controllers))
    assert text == '<Scenario least: vehicle rexrov, one, other, 4 s>'


def test_what_is_odd_of_a_vehicle_is_warned_of(tmp_path: Path) -> None:
    scenario = load_scenario('case1')
    odd = replace(scenario, vehicle=scenario.vehicle.changed(warnings=('too light',)))
    assert odd.warnings == ['too light']


def test_initial_angles_in_degrees_are_warned_of() -> None:
    scenario = load_scenario('case1')
    before = scenario.warnings
    data = scenario.data | {'initial': {'eta': [0, 0, 0, 0, 10.0, 400.0], 'nu': [0.0] * 6}}
    turned = scenario.data | {'initial': {'eta': [0, 0, 0, 0, 0, 400.0], 'nu': [0.0] * 6}}
    assert replace(scenario, data=turned).warnings == before, 'a heading may be unwrapped'
    (warning,) = [w for w in replace(scenario, data=data).warnings if w not in before]
    assert 'initial.eta' in warning
    assert 'degrees?' in warning
    for angle, count in ((-6.3, 1), (6.2, 0)):
        data['initial']['eta'][3] = data['initial']['eta'][4] = angle
        assert len(replace(scenario, data=data).warnings) == len(before) + count
