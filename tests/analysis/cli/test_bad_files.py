"""Wrong entries in vehicle, scenario and set-point files, through the real `auv simulate`.

Each ends in one line that names file, key, expected and found, with exit code 2, before anything
is simulated, written or started.
"""

from pathlib import Path

import pytest
import yaml

from auv_analysis.cli import main, scenario_runs
from auv_dynamics.files.shipped import shipped
from auv_dynamics.files.yaml_files import parse_any_yaml

HEADER = 't,surge,sway,heave,roll,pitch,yaw'
LAST = '30,0,0,0,0,0,0'
FIRST = '0,0,0,0,0,0,0'
EYE = [[float(i == j) for j in range(6)] for i in range(6)]
GAINS = 'a number, 6 numbers or a 6x6 matrix'

# key, what stands there (nothing: the key is missing) | the key named, expected, found
VEHICLE = """
damping.linear = [1, 2, 3, 4, 5] | damping.linear | 6 numbers or a 6x6 matrix | 5 numbers
damping.linear = [1, 1, 1, 1, 1, 1, 1] | damping.linear | 6 numbers or a 6x6 matrix | 7 numbers
added_mass = [] | added_mass | 6 numbers or a 6x6 matrix | 0 numbers
added_mass = 5.0 | added_mass | 6 numbers or a 6x6 matrix | 5.0
added_mass = {surge: 1} | added_mass | 6 numbers or a 6x6 matrix | surge
added_mass = [1, 2, 3, 4, 5, six] | added_mass[5] | a number | six
added_mass = [1, 2, 3, 4, 5, true] | added_mass | number | True
added_mass = [1, 2, 3, 4, 5, null] | added_mass[5] | a number | nothing
added_mass = [1, 2, 3, 4, 5, -.inf] | added_mass[5] | a finite number | -inf
added_mass = [1, 2, 3, 4, 5, -6] | added_mass | positive semidefinite | -6
added_mass = | added_mass | 6 numbers or a 6x6 matrix | nothing
damping = [1, 2] | damping | a mapping with linear and quadratic | [1, 2]
damping = null | damping | a mapping with linear and quadratic | nothing
damping.linear = [1, 2, 3, 4, 5, -6] | damping.linear | positive semidefinite | -6
damping.cubic = [1, 1, 1, 1, 1, 1] | damping.cubic | linear, quadratic | unknown key
colour = yellow | colour | rigid_body | unknown key
rigid_body.inertia_refrence = cg | rigid_body.inertia_refrence | inertia_reference | unknown key
rigid_body.mass = 0 | rigid_body.mass | a positive number (kg) | 0
rigid_body.mass = -1862.87 | rigid_body.mass | a positive number (kg) | -1862.87
rigid_body.mass = heavy | rigid_body.mass | a positive number (kg) | heavy
rigid_body.mass = true | rigid_body.mass | a positive number (kg) | True
rigid_body.mass = .nan | rigid_body.mass | a finite number | nan
rigid_body.mass = 1e400 | rigid_body.mass | a finite number | inf
rigid_body.mass = 1.0e+200 | rigid_body.mass | a finite number, at most 1e+100 | 1e+200
rigid_body.mass = 1:30 kg | rigid_body.mass | a positive number (kg) | 1:30 kg
rigid_body.mass = | rigid_body.mass | a positive number (kg) | nothing
rigid_body.inertia = | rigid_body.inertia | 3x3 tensor | nothing
rigid_body.inertia = [1, 2, 3] | rigid_body.inertia | 3 numbers | 1
rigid_body.inertia = [[1, 0], [0, 1]] | rigid_body.inertia | a 3x3 tensor | 2x2
rigid_body.inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 9]] | rigid_body.inertia | triangle | 1, 1, 9
rigid_body.inertia = [[9, 5, 0], [0, 9, 0], [0, 0, 9]] | rigid_body.inertia | symmetric | [0][1] = 5
rigid_body.inertia = [[-1, 0, 0], [0, 1, 0], [0, 0, 1]] | rigid_body.inertia | positive | -1
rigid_body.inertia_reference = CG | rigid_body.inertia_reference | cg or co | CG
rigid_body.inertia_reference = | rigid_body.inertia_reference | cg or co | nothing
rigid_body.center_of_gravity = [5, 0] | rigid_body.center_of_gravity | 3 numbers (m) | 2 numbers
hydrostatics.volume = -1 | hydrostatics.volume | a positive number (m3) | -1
hydrostatics = | hydrostatics | volume | nothing
environment.gravity = -9.81 | environment.gravity | a positive number (m/s2) | -9.81
sign = sname | added_mass | positive semidefinite | sname
sign = minus | sign | positive or sname | minus
format = 2 | format | 1 | 2
format = '1' | format | 1 | '1'
name = '' | name | a word | ''
source = 2018 | source | a citation | 2018
"""
SCENARIO = """
colour = red | colour | vehicle | unknown key
actuators = {limits: 1} | actuators.limits | limit, rate, lag, delay, thrusters | unknown key
actuators = {limit: [1, 1, 1, 1, 1]} | actuators.limit | positive number or 6 | 5 numbers
actuators = {limit: -1} | actuators.limit | positive number | -1
actuators = {delay: 0.0123} | actuators.delay | multiple of step | 0.0123
actuators = {lag: -1} | actuators.lag | from 0 up | -1
actuators = {thrusters: true} | actuators.thrusters | a vehicle with thrusters | true
actuators = {} | actuators | a mapping with limit | {}
sensors = {} | sensors | a mapping with velocity_noise | {}
sensors = {drop_out: 1.1} | sensors.drop_out | from 0 to 1 | 1.1
sensors = {velocity_noise: 11} | sensors.velocity_noise | from 0 to 10 | 11
sensors = {velocity_noise: [1, 2]} | sensors.velocity_noise | 6 numbers | 2 numbers
sensors = {noise: 1} | sensors.noise | velocity_noise | unknown key
name = a/b | name | without blanks or slashes | a/b
name = "case1\\n" | name | without blanks or slashes | case1
name = 5 | name | a word | 5
vehicle = | vehicle | a vehicle file | nothing
vehicle = nope | vehicle | herman2018 | nope
vehicle = 5 | vehicle | a vehicle file | 5
step = 0 | step | a positive number of seconds | 0
step = -0.01 | step | a positive number of seconds | -0.01
step = fast | step | a positive number of seconds | fast
step = 1.0e-10 | step | nanoseconds | 1e-10
step = 0.0033333333333333335 | step | nanoseconds | 0.0033333333333333335
step = 0.07 | duration | a multiple of step (0.07 s) | 30.0 s
step = 60 | duration | a multiple of step (60 s) | 30.0 s
step = 1.0e-9 | duration | steps | 30000000000
duration = 0 | duration | a positive number of seconds | 0
duration = .inf | duration | a finite number | inf
duration = 1.0e9 | duration | steps | 100000000000
duration = 3.0e9 | duration | 2000000000 | 3000000000
duration = 30.005 | duration | a multiple of step (0.01 s) | 30.005 s
integrator = ode45 | integrator | ode5, rk4 or euler | ode45
seed = -1 | seed | a whole number from 0 | -1
seed = 1.5 | seed | a whole number from 0 | 1.5
seed = 9223372036854775808 | seed | a whole number from 0 | 9223372036854775808
initial = {eta: [0, 0, 0, 0, 0]} | initial.eta | 6 numbers (m, rad) | 5 numbers
initial = {pose: [0, 0, 0, 0, 0, 0]} | initial.pose | eta, nu | unknown key
initial = {nu: [0, 0, .nan, 0, 0, 0]} | initial.nu[2] | a finite number | nan
controllers = {} | controllers | at least one controller | {}
controllers = [gvc] | controllers | a mapping | gvc
controllers = {a b: {law: gvc}} | controllers | without blanks or slashes | a b
controllers = {"gvc\\n": {law: gvc}} | controllers | without blanks or slashes | gvc
controllers.gvc = null | controllers.gvc | a mapping with law and gains | nothing
controllers.gvc.law = | controllers.gvc.law | gvc, cl, pid, smc, multisine or module:Class | nothing
controllers.gvc.law = lqr | controllers.gvc.law | gvc, cl, pid, smc, multisine or module:Class | lqr
controllers.gvc.law = no_such:Law | controllers.gvc.law | module:Class | no_such
controllers.gvc.law = math:Law | controllers.gvc.law | module:Class | no Law in math
controllers.gvc.law = .here:Law | controllers.gvc.law | module:Class | .here:Law
controllers.gvc.law = collections:Counter | controllers.gvc.law | wrench | without
controllers.gvc = {law: multisine} | excitation | a mapping of degrees of freedom | nothing
excitation = {surge: {offset: 1}} | controllers | one of law multisine | cl, gvc
excitation = {} | excitation | a mapping of degrees of freedom | {}
excitation = {up: {offset: 1}} | excitation.up | surge, sway, heave | unknown key
excitation = {yaw: {terms: [{amplitude: 1}]}} | excitation.yaw.terms[0].omega | (rad/s) | nothing
controllers.gvc.Gamma = | controllers.gvc.Gamma | GAINS | nothing
controllers.gvc.k_P = 1.0 | controllers.gvc.k_P | k_D, k_I, Lambda, Gamma | unknown gain
controllers.gvc = {law: gvc, k_d: 1.0} | controllers.gvc.k_d | k_D | unknown gain
controllers.gvc.k_D = [1, 1, 1, 1, 1] | controllers.gvc.k_D | GAINS | 5 numbers
controllers.gvc.k_D = [[1, 2], [3, 4]] | controllers.gvc.k_D | GAINS | 2x2
controllers.gvc.k_D = true | controllers.gvc.k_D | GAINS | True
controllers.gvc.k_D = big | controllers.gvc.k_D | a number | big
controllers.gvc.k_D = .nan | controllers.gvc.k_D | a finite number | nan
setpoint = [] | setpoint | a mapping of degrees of freedom | []
setpoint = {surf: {offset: 1}} | setpoint.surf | surge | unknown key
setpoint = {surge: 1} | setpoint.surge | a mapping with offset and terms | 1
setpoint.surge = {ofset: 1} | setpoint.surge.ofset | offset, terms | unknown key
setpoint.surge = {terms: [{amplitude: 1}]} | setpoint.surge.terms[0].omega | rad/s | nothing
setpoint.surge = {terms: {omega: 1}} | setpoint.surge.terms | a list of terms | omega
setpoint = {file: x.csv, surge: {}} | setpoint | file alone | surge
setpoint = {file: 5} | setpoint.file | a CSV file | 5
disturbance = {kind: storm} | disturbance.kind | model_error or current | storm
disturbance = [{kind: current}] | disturbance[0] | at least one of velocity, north | current
disturbance = [{kind: current, velocity: [1, 2]}] | disturbance[0].velocity | 3 numbers | 2 numbers
disturbance = {kind: model_error} | disturbance | at least one of mass | model_error
disturbance = {kind: model_error, mass: -1.5} | disturbance.mass | above -1 | -1.5
disturbance = {kind: model_error, mass: 0.1} | disturbance[0].mass | dM and dD | relative error
disturbance = {kind: model_error, dM: -1000} | disturbance[0] | positive definite M | smallest
disturbance = {exponent_sign: 1} | disturbance.kind | model_error or current | nothing
disturbance.exponent_sign = 0 | disturbance.exponent_sign | -1 or 1 | 0
disturbance.exponent_sign = '-1' | disturbance.exponent_sign | -1 or 1 | '-1'
disturbance = [herman2018] | disturbance[0] | a mapping with kind | herman2018
disturbance = null | disturbance | a | nothing
format = null | format | 1 | nothing
"""
RAGGED = [*EYE[:5], [1.0] * 5]
INDEFINITE = [[-1.0 if i == j == 5 else x for j, x in enumerate(row)] for i, row in enumerate(EYE)]
SKEWED = [[0.5 if (i, j) == (0, 1) else x for j, x in enumerate(r)] for i, r in enumerate(EYE)]
BOTH = 'nothing beside inertia_matrix'
MATRICES = [  # vehicle, key, value, expected, found
    ('rexrov', 'added_mass', EYE[:5], '6x6', '5x6'),
    ('rexrov', 'added_mass', [row[:5] for row in EYE], '6x6', '6x5'),
    ('rexrov', 'added_mass', RAGGED, '6x6', '6 rows of 5 to 6'),
    ('rexrov', 'added_mass', [1.0] * 36, '6x6', '36 numbers'),
    ('rexrov', 'added_mass', SKEWED, 'symmetric', '[0][1] = 0.5'),
    ('rexrov', 'added_mass', INDEFINITE, 'positive semidefinite', '-1'),
    ('rexrov', 'damping.linear', INDEFINITE, 'positive semidefinite', '-1'),
    ('rexrov', 'inertia_matrix', EYE, BOTH, 'both'),
    ('herman2018', 'rigid_body.inertia', [r[:3] for r in EYE[:3]], BOTH, 'both'),
    ('herman2018', 'rigid_body.inertia_reference', 'cg', BOTH, 'both'),
    ('herman2018', 'inertia_matrix', INDEFINITE, 'positive definite', '-1'),
    ('herman2018', 'inertia_matrix', [[1.0] * 6] * 6, 'positive definite', 'eigenvalue'),
    ('herman2018', 'inertia_matrix', SKEWED, 'symmetric', '[0][1] = 0.5'),
    ('herman2018', 'inertia_matrix', [1.0] * 6, '6 numbers', '1.0'),
]
TABLES = {  # what is wrong with the CSV file -> text, key, expected, found
    'empty': ('', 'line 1', HEADER, 'nothing'),
    'header only': (f'{HEADER}\n', 't', 'two rows', '0'),
    'one row': (f'{HEADER}\n{FIRST}\n', 't', 'two rows', '1'),
    'no header': (f'{FIRST}\n{LAST}\n', 'line 1', HEADER, FIRST),
    'missing column': (f'{HEADER[:-4]}\n', 'line 1', HEADER, 'pitch'),
    'semicolons': (f'{HEADER};\n'.replace(',', ';'), 'line 1', HEADER, 't;surge'),
    'text': (f'{HEADER}\n{FIRST}\n9,a,0,0,0,0,0\n{LAST}\n', 'line 3', '7 finite numbers', '9,a'),
    'NaN': (f'{HEADER}\n{FIRST}\n9,nan,0,0,0,0,0\n{LAST}\n', 'line 3', '7 finite', '9,nan'),
    'empty cell': (f'{HEADER}\n{FIRST}\n9,,0,0,0,0,0\n{LAST}\n', 'line 3', '7 finite', '9,,0'),
    'short row': (f'{HEADER}\n{FIRST}\n9,0\n{LAST}\n', 'line 3', '7 finite numbers', '9,0'),
    'blank line before': (f'{HEADER}\n\n{FIRST}\n9,a,0,0,0,0,0\n', 'line 4', '7 finite', '9,a'),
    'backwards': (f'{HEADER}\n{FIRST}\n\n{LAST}\n9,0,0,0,0,0,0\n', 'line 5', 'later', '9'),
    'same time': (f'{HEADER}\n{FIRST}\n{LAST}\n{LAST}\n', 'line 4', 'later', '30'),
    'too short': (f'{HEADER}\n{FIRST}\n29.9,0,0,0,0,0,0\n', 't', '0 to 30 s', '29.9'),
    'late': (f'{HEADER}\n0.1,0,0,0,0,0,0\n{LAST}\n', 't', '0 to 30 s', '0.1'),
    'endless cell': (f'{HEADER}\n{FIRST}\n{"9" * 200_000},0\n', 'line 3', '7 finite', ''),
}


@pytest.fixture(autouse=True)
def no_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fail where the results' folder would be made, which comes before all work."""
    monkeypatch.setattr(
        scenario_runs, 'results_folder', lambda *_, **__: pytest.fail('work has begun')
    )


def _cases(table: str) -> list[tuple[str, str, str, str, str]]:
    cases = []
    for row in table.strip().splitlines():
        place, key, expected, found = row.split(' | ')
        path, _, text = place.partition(' =')
        cases.append((path, text.strip(), key, expected.replace('GAINS', GAINS), found))
    return cases


def _written(data: dict, key: str, text: str, path: Path) -> Path:
    """Write a file in which `key` has the value that `text` spells; without text it has none."""
    *parents, last = key.split('.')
    place = data
    for parent in parents:
        place = place[parent]
    place[last] = 'PLACEHOLDER'
    if not text:
        del place[last]
    spelt = yaml.dump(data, Dumper=yaml.CSafeDumper, width=1000)
    path.write_text(spelt.replace('PLACEHOLDER', text))
    return path


def _shipped(kind: str, name: str) -> dict:
    path = shipped(kind, name)
    return parse_any_yaml(path.read_text(encoding='utf-8'), path)


def _refused(capsys: pytest.CaptureFixture, scenario: Path) -> str:
    with pytest.raises(SystemExit) as end:
        main.main(['simulate', str(scenario), '--out', str(scenario.parent / 'out')])
    captured = capsys.readouterr()
    lines = captured.err.splitlines()
    assert (end.value.code, len(lines), captured.out) == (2, 1, ''), captured.err
    assert len(lines[0]) < 600
    return lines[0]


def _names(line: str, file: Path, key: str, expected: str, found: str) -> None:
    place, _, rest = line.partition(': expected ')
    was_expected, _, was_found = rest.partition(', found ')
    assert place.startswith(f'{file}: {key}')
    assert expected in was_expected
    assert found in was_found


@pytest.mark.parametrize(('path', 'text', 'key', 'expected', 'found'), _cases(VEHICLE))
def test_vehicle_entry(path, text, key, expected, found, tmp_path, capsys) -> None:
    vehicle = _written(_shipped('vehicles', 'rexrov'), path, text, tmp_path / 'vehicle.yaml')
    case = _written(_shipped('scenarios', 'case1'), 'vehicle', vehicle.name, tmp_path / 's.yaml')
    _names(_refused(capsys, case), vehicle, key, expected, found)


@pytest.mark.parametrize(('base', 'key', 'value', 'expected', 'found'), MATRICES)
def test_vehicle_matrix(base, key, value, expected, found, tmp_path, capsys) -> None:
    text = yaml.safe_dump(value, default_flow_style=True, width=1000).splitlines()[0]
    vehicle = _written(_shipped('vehicles', base), key, text, tmp_path / 'vehicle.yaml')
    case = _written(_shipped('scenarios', 'case1'), 'vehicle', vehicle.name, tmp_path / 's.yaml')
    line = _refused(capsys, case)
    # with both given, either may be the one that is too much
    _names(line, vehicle, '' if expected == BOTH else key, expected, found)


@pytest.mark.parametrize(('path', 'text', 'key', 'expected', 'found'), _cases(SCENARIO))
def test_scenario_entry(path, text, key, expected, found, tmp_path, capsys) -> None:
    (tmp_path / 'x.csv').write_text(f'{HEADER}\n{FIRST}\n{LAST}\n')
    case = _written(_shipped('scenarios', 'case1'), path, text, tmp_path / 's.yaml')
    _names(_refused(capsys, case), case, key, expected, found)


@pytest.mark.parametrize('name', TABLES)
def test_setpoint_file(name, tmp_path, capsys) -> None:
    text, key, expected, found = TABLES[name]
    table = tmp_path / 'x.csv'
    table.write_text(text)
    case = _written(_shipped('scenarios', 'case1'), 'setpoint', '{file: x.csv}', tmp_path / 's')
    _names(_refused(capsys, case), table, key, expected, found)


@pytest.mark.parametrize('file', ['gone.csv', '.', 'a\0b.csv', 'n' * 300])
def test_setpoint_file_that_is_none(file, tmp_path, capsys) -> None:
    text = f'{{file: "{file}"}}'.replace('\0', '\\0')
    case = _written(_shipped('scenarios', 'case1'), 'setpoint', text, tmp_path / 's.yaml')
    assert str(tmp_path) in _refused(capsys, case)


@pytest.mark.parametrize('name', ['gone.yaml', '../gone/gone.yaml', '.', 'a\0b.yaml', 'n' * 300])
def test_vehicle_that_is_no_file_is_looked_for_beside_the_scenario(name, tmp_path, capsys) -> None:
    text = f'"{name}"'.replace('\0', '\\0')
    case = _written(_shipped('scenarios', 'case1'), 'vehicle', text, tmp_path / 's.yaml')
    line = _refused(capsys, case)
    assert str(tmp_path) in line
    assert 'vehicle' in line.removeprefix(str(tmp_path))


LAWS = {  # text of a user's own module -> what the line must say
    'def (:\n': 'syntax',
    'import no_such_module\n': 'no_such_module',
    'raise RuntimeError("boom\\nand more")\n': 'boom',
    '1 / 0\n': 'division',
    'raise SystemExit(3)\n': '3',
    'Law = 5\n': 'without wrench',
    'class Law:\n    wrench = state_rate = STATES = _fields = 5\n': 'Law',
    'class Law:\n    _fields, STATES = ("k",), 6\n    wrench = state_rate = print\n': 'Law',
}


@pytest.mark.parametrize('text', LAWS)
def test_law_of_a_module_that_is_broken(text, tmp_path, capsys, monkeypatch) -> None:
    module = f'law_{abs(hash(text))}'  # a module of each name is imported once
    (tmp_path / f'{module}.py').write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    law = f'{{law: "{module}:Law", k: 1.0}}'
    case = _written(_shipped('scenarios', 'case1'), 'controllers.gvc', law, tmp_path / 's.yaml')
    line = _refused(capsys, case)
    _names(line, case, 'controllers.gvc.law', '', LAWS[text])
