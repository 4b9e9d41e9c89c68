"""The scenario in words: what acts on the plant, and what lies between it and the law."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from auv_analysis.output.text import join, number, plain
from auv_analysis.runs.run import FOREIGN, Facts
from auv_analysis.scenario.fault_words import Mark, marks_of
from auv_analysis.scenario.scenario import SCHEMA
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import check, matrix6, parse_yaml
from auv_dynamics.plant.faults import ACTING, SENSING
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.control.gains import sampling_warning

VELOCITY, WRENCH = ('m/s', 'rad/s'), ('N', 'N m')
FOLDERS = re.compile(r'^.*?(?=[^/\s]+\.ya?ml: )')  # before a file's name: a report is passed on
ELSEWHERE = 'not known: another system ran the law; the notes say how its bag was read'


@dataclass(frozen=True)
class SetUp:
    """What the report says of the scenario beside its controllers.

    Attributes
    ----------
    name : of the scenario that the words are about, '' where its file is not at hand
    rows : what, and lines about it
    limit : (6,) axis limits of the actuators, N and N m; None where there are none
    data : contents of the scenario's file

    """

    name: str
    rows: list[tuple[str, list[str]]]
    limit: np.ndarray | None
    data: Mapping[str, Any] = field(default_factory=dict)


def set_up(runs: Mapping[str, Facts], summaries: Mapping[str, Any], scenario_text: str) -> SetUp:
    """Words about the scenario of some runs.

    Parameters
    ----------
    runs, summaries : by name
    scenario_text : the scenario's file; a text that is none, or that of other runs, says nothing

    """
    data = scenario_data(scenario_text)
    if data is None or data['name'] not in {run.scenario for run in runs.values()}:
        return SetUp('', [*_of_the_runs(runs), *_shared(runs, summaries)], None)
    mine = {name: run for name, run in runs.items() if run.scenario == data['name']}
    actuators, sensors = data.get('actuators'), data.get('sensors')
    rows = [('set-point', [_setpoint(data['setpoint'])])]
    start = _start(data.get('initial', {}))
    rows += [('start', [start])] if start else []
    rows += [('disturbances', _disturbances(data.get('disturbance', [])))]
    faults = data.get('faults', [])
    marks = marks_of(faults, next(iter(mine.values())).vehicle)
    rows += [('actuators', _but(_actuators(actuators, mine), marks, ACTING))]
    if actuators and ('limit' in actuators or actuators.get('thrusters')):
        rows += [('anti-windup', [_anti_windup(data['controllers'], mine)])]
    rows += [('sensors', _but([_sensors(sensors)], marks, SENSING))]
    rows += [('faults', [f'{mark.label}, {mark.times}' for mark in marks])] if marks else []
    seed, drawn = f'{data.get("seed", 0)}', any('probability' in spec for spec in faults)
    quiet = f'{seed}; nothing in this scenario is random'
    rows += [('seed', [seed if sensors or drawn else quiet])]
    rows += _shared(runs, summaries, str(data.get('integrator', 'ode5')))
    limit = (actuators or {}).get('limit')
    bounds = None if limit is None else np.broadcast_to(np.asarray(limit, float), 6)
    return SetUp(data['name'], rows, bounds, data)


def scenario_data(text: str) -> dict[str, Any] | None:
    """Contents of a scenario's text; None where it is not one."""
    try:
        data = parse_yaml(text, 'scenario', 'scenario')
        check(data, SCHEMA, 'scenario')
    except InputError:
        return None
    return data


def sampling_warnings(runs: Mapping[str, Facts], summaries: Mapping[str, Any]) -> list[str]:
    """Runs whose velocity gain is too fast for their control period, in words."""
    found = []
    for name, run in runs.items():
        K_D = summaries[name]['gains']['K_D']
        if run.hold == 'zoh' and K_D is not None:
            text = sampling_warning(np.array(K_D), run.vehicle.M, run.step)
            found += [f'{name}: {text}'] if text else []
    return found


def _of_the_runs(runs: Mapping[str, Facts]) -> list[tuple[str, list[str]]]:
    """What the runs themselves say where their scenario is not at hand."""
    rows = []
    for name, run in runs.items():
        words = 'not known' if run.kinds is None else join(sorted(run.kinds)) or 'none'
        line = f'disturbances {words}'
        line += '; the actuators are not ideal' if run.acting else ''
        line += '; the law sees measurements' if run.sensing else ''
        rows.append((name, [line]))
    return rows


def _shared(
    runs: Mapping[str, Facts], summaries: Mapping[str, Any], integrator: str = ''
) -> list[tuple[str, list[str]]]:
    """How the law is run, and what is odd about it."""
    words = {
        'zoh': 'the law is sampled once per step and its wrench held, as on a computer',
        'continuous': 'the law is evaluated in every stage of the integrator, as in the paper',
    }
    holds: dict[str, list[str]] = {}
    for name, run in runs.items():
        text = ELSEWHERE if run.source == FOREIGN else words.get(run.hold, run.hold)
        holds.setdefault(text, []).append(name)
    lines = [
        text + (f' ({join(names)})' if len(holds) > 1 else '') for text, names in holds.items()
    ]
    if integrator:
        lines[0] = f'{integrator}; {lines[0]}'
    odd = sampling_warnings(runs, summaries)
    told = (warning for run in runs.values() for warning in run.vehicle.warnings)
    odd += dict.fromkeys(FOLDERS.sub('', warning) for warning in told)
    return [('integration', lines), *([('warnings', odd)] if odd else [])]


def _setpoint(spec: Mapping[str, Any]) -> str:
    if 'file' in spec:
        return 'read from a CSV file'
    return harmonics(spec, DOFS, VELOCITY) or 'zero'


def _start(initial: Mapping[str, Any]) -> str:
    eta, nu = initial.get('eta', [0.0] * 6), initial.get('nu', [0.0] * 6)
    parts = []
    if any(eta):
        parts.append(f'η = ({", ".join(plain(x) for x in eta)}) m, rad')
    if any(nu):
        parts.append(f'ν = ({", ".join(plain(x) for x in nu)}) m/s, rad/s')
    return '; '.join(parts)


def _disturbances(specs: Any) -> list[str]:
    specs = specs if isinstance(specs, list) else [specs]
    return [KINDS[spec['kind']](spec) for spec in specs] or ['none: F is zero']


def _actuators(spec: Mapping[str, Any] | None, runs: Mapping[str, Facts]) -> list[str]:
    if spec is None:
        return ['ideal: the commanded wrench is the applied one']
    parts = []
    if spec.get('thrusters'):
        parts.append(_thrusters(next(iter(runs.values()))))
    if 'limit' in spec:
        parts.append(f'axis limits ± {per_axis(spec["limit"], WRENCH)}')
    if 'rate' in spec:
        parts.append(f'slew rate at most {per_axis(spec["rate"], ("N/s", "N m/s"))}')
    slow = [f'{key} {plain(spec[key])} s' for key in ('lag', 'delay') if spec.get(key)]
    parts += [', '.join(slow)] if slow else []
    return parts or ['ideal: the commanded wrench is the applied one']


def _but(lines: list[str], marks: Sequence[Mark], kinds: Sequence[str]) -> list[str]:
    """The same lines, and that there are faults of these kinds as well."""
    if not any(mark.kind in kinds for mark in marks):
        return lines
    return [*lines[:-1], f'{lines[-1]}; but for the faults']


def _thrusters(run: Facts) -> str:
    thrusters = run.vehicle.thrusters
    if thrusters is None:
        return 'thrusters of the vehicle file'
    n = len(thrusters.names)
    reverse, forward = thrusters.reverse, thrusters.forward
    most = f'{_span(-reverse)} to {_span(forward)} N'
    return (
        f'{n} thrusters of {run.vehicle.name} (T of rank {thrusters.rank} of 6) with thrusts from '
        f'{most}, allocated by the pseudo-inverse and scaled down together'
    )


def _span(values: np.ndarray) -> str:
    texts = dict.fromkeys(number(x) for x in (values.min(), values.max()))
    return '…'.join(texts)


def _anti_windup(controllers: Mapping[str, Any], runs: Mapping[str, Facts]) -> str:
    off = [name for name in runs if not controllers.get(name, {}).get('anti_windup', True)]
    on = [name for name in runs if name not in off]
    parts = [f'on for {join(on)}'] if on else []
    return '; '.join(parts + ([f'off for {join(off)}'] if off else []))


def _sensors(spec: Mapping[str, Any] | None) -> str:
    if spec is None:
        return 'perfect: the law sees the true state'
    parts = []
    if np.any(spec.get('velocity_noise', 0.0)):
        parts.append(f'velocity noise {per_axis(spec["velocity_noise"], VELOCITY)}')
    if np.any(spec.get('attitude_noise', 0.0)):
        parts.append(f'attitude noise {rotations(spec["attitude_noise"])} rad')
    text = f'{join(parts)} (standard deviations)' if parts else ''
    lost = spec.get('drop_out', 0.0)
    lost_text = f'a sample is lost with probability {plain(lost)}' if lost else ''
    return '; '.join(filter(None, [text, lost_text])) or 'perfect: the law sees the true state'


AXES = ('north', 'east', 'down')
RELATIVE = {
    'mass': 'mass',
    'added_mass': 'added mass',
    'damping': 'damping',
    'buoyancy': 'buoyancy',
}


def gain_text(value: Any) -> str:
    """A gain as '12 I', 'diag(...)' or 'full matrix'."""
    matrix = np.asarray(matrix6(value))
    diagonal = np.diagonal(matrix)
    if np.any(matrix != np.diag(diagonal)):
        return 'full matrix, in the listing'
    if np.all(diagonal == diagonal[0]):
        return f'{plain(diagonal[0], 6)} I'
    return f'diag({", ".join(plain(x, 6) for x in diagonal)})'


def harmonics(spec: Mapping[str, Any], axes: Sequence[str], units: Sequence[str]) -> str:
    """Offsets and sinusoids per axis: 'surge 0.2 + 1 sin(0.157 t) m/s; heave 0.1 m/s'.

    Parameters
    ----------
    spec : axis -> offset and terms
    axes : names, in the order in which they are said
    units : of the first three and of the others

    """
    parts = []
    for i, axis in enumerate(axes):
        text = _signal(spec.get(axis, {}))
        parts += [f'{axis} {text} {units[i // 3]}'] if text else []
    return '; '.join(parts)


def herman2018(spec: Mapping[str, Any]) -> str:
    """F of (39) and what multiplies it."""
    sign = '−' if spec.get('exponent_sign', -1) < 0 else '+'
    scale = spec.get('scale', 1)
    text = f'equation (39), exponents read with {sign}'
    if isinstance(scale, int | float):
        return text if scale == 1 else f'{text}, times {plain(scale)}'
    words = gain_text(scale)
    return f'{text}, times {"a " if words.startswith("full") else ""}{words}'


def model_error(spec: Mapping[str, Any]) -> str:
    """How the plant differs from the vehicle file."""
    parts = [f'{word} {signed(100 * spec[key])} %' for key, word in RELATIVE.items() if key in spec]
    parts += [f'{key} = {gain_text(spec[key])}' for key in ('dM', 'dD') if key in spec]
    return f'model error of the plant: {", ".join(parts)}'


def current(spec: Mapping[str, Any]) -> str:
    """Velocity of the water in NED."""
    parts = []
    if 'velocity' in spec:
        parts.append(f'{", ".join(fixed_two(x) for x in spec["velocity"])} m/s NED, constant')
    waves = harmonics(spec, AXES, ('m/s', 'm/s'))
    return f'current {" and ".join(filter(None, [*parts, waves]))}'


def per_axis(value: Any, units: Sequence[str]) -> str:
    """One number or six with their units: '3000, 3000, 4000 N and 800, 800, 500 N m'."""
    six = np.broadcast_to(np.asarray(value, float), 6)
    if np.all(six == six[0]):
        return f'{plain(six[0], 6)} {units[0]} and {units[1]}'
    halves = zip((six[:3], six[3:]), units, strict=True)
    return join([f'{_three(half)} {unit}' for half, unit in halves])


def rotations(value: Any) -> str:
    """One number, or three about the body axes."""
    return _three(np.broadcast_to(np.asarray(value, float), 3))


def signed(value: float) -> str:
    """Text of a number with its sign."""
    return f'{"−" if value < 0 else "+"}{plain(abs(value))}'


def fixed_two(value: float) -> str:
    """At least two decimals, as many as the number needs."""
    text = plain(value)
    whole, _, decimals = text.partition('.')
    return text if '·' in text else f'{whole}.{decimals:0<2}'


def _three(values: np.ndarray) -> str:
    """Three numbers, or the one that all of them are."""
    texts = [plain(x, 6) for x in values]
    return texts[0] if len(set(texts)) == 1 else ', '.join(texts)


def _signal(entry: Mapping[str, Any]) -> str:
    offset = entry.get('offset', 0.0)
    text = plain(offset) if offset else ''
    for term in entry.get('terms', []):
        amplitude, phase = term['amplitude'], term.get('phase', 0.0)
        angle = f'{plain(term["omega"])} t'
        if phase:
            angle += f' {"−" if phase < 0 else "+"} {plain(abs(phase))}'
        wave = f'{plain(abs(amplitude))} sin({angle})'
        sign = '−' if amplitude < 0 else '+' if text else ''
        text = f'{text} {sign} {wave}' if text else f'{sign}{wave}'
    return text


KINDS = {
    'herman2018': herman2018,
    'harmonic': lambda spec: f'harmonic, opposing τ: {harmonics(spec, DOFS, WRENCH)}',
    'model_error': model_error,
    'current': current,
}
