"""The scenario in a report: what acts on the plant, and what lies between it and the law."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from auv_analysis.metrics.quantities import VELOCITY, WRENCH
from auv_analysis.output.text import join, plain
from auv_analysis.runs.run import FOREIGN, RunInfo
from auv_analysis.scenario.fault_words import Mark, marks_of
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import check, matrix6, parse_yaml, yaml_text
from auv_dynamics.plant.faults import ACTING, SENSING
from auv_dynamics.plant.parameters import SCHEMA
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.control.gains import sampling_warning, state_warning
from auv_gvc_controller.laws.law import make_gains

IDEAL = 'ideal: the commanded wrench is the applied one'
PERFECT = 'perfect: the law sees the true state'
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


def set_up(runs: Mapping[str, RunInfo], summaries: Mapping[str, Any], scenario_text: str) -> SetUp:
    """What the report says of the scenario of some runs.

    Parameters
    ----------
    runs, summaries : by name, which may be another than that of the controller
    scenario_text : the scenario's file; a text that is none, or that of other runs, says nothing

    """
    data = scenario_data(scenario_text)
    if data is None or data['name'] not in {run.scenario for run in runs.values()}:
        return SetUp('', [*_of_the_runs(runs), *_shared(runs, summaries)], None)
    mine = {name: run for name, run in runs.items() if run.scenario == data['name']}
    actuators, sensors = data.get('actuators'), data.get('sensors')
    rows = [('set-point', [_setpoint(data['setpoint'])])]
    if 'excitation' in data:
        rows += [('open-loop wrench', [harmonics(data['excitation'], DOFS, WRENCH) or 'zero'])]
    rows += [('start', [_entries(data['initial'])])] if data.get('initial') else []
    rows += [('disturbances', _disturbances(data.get('disturbance', [])))]
    faults = data.get('faults', [])
    marks = marks_of(faults, next(iter(mine.values())).vehicle)
    acts = _entries(actuators) if actuators else IDEAL
    rows += [('actuators', [acts + _but(marks, ACTING)])]
    if actuators and ('limit' in actuators or actuators.get('thrusters')):
        rows += [('anti-windup', [_anti_windup(data['controllers'], mine)])]
    sees = _entries(sensors) if sensors else PERFECT
    rows += [('sensors', [sees + _but(marks, SENSING)])]
    rows += [('faults', [f'{mark.label}, {mark.times}' for mark in marks])] if marks else []
    rows += [('seed', [f'{data.get("seed", 0)}'])]
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


def sampling_warnings(runs: Mapping[str, RunInfo], summaries: Mapping[str, Any]) -> list[str]:
    """Runs whose velocity gain, or law's own states, are too fast for the control period."""
    found = []
    for name, run in runs.items():
        K_D = summaries[name]['gains']['K_D']
        if run.hold == 'zoh' and K_D is not None:
            loop = sampling_warning(np.array(K_D), run.vehicle.M, run.step)
            own = state_warning(make_gains(run.law, run.gains), run.step)
            found += [f'{name}: {text}' for text in (loop, own) if text]
    return found


def _of_the_runs(runs: Mapping[str, RunInfo]) -> list[tuple[str, list[str]]]:
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
    runs: Mapping[str, RunInfo], summaries: Mapping[str, Any], integrator: str = ''
) -> list[tuple[str, list[str]]]:
    """Sampling of the law, and warnings."""
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


def _disturbances(specs: Any) -> list[str]:
    specs = specs if isinstance(specs, list) else [specs]
    return [_entries(spec) for spec in specs] or ['none: F is zero']


def _entries(spec: Mapping[str, Any]) -> str:
    """Entries of the scenario's file as they stand there, in one line."""
    text = yaml_text(dict(spec), default_flow_style=True, width=math.inf)
    return text.strip().removeprefix('{').removesuffix('}')


def _but(marks: Sequence[Mark], kinds: Sequence[str]) -> str:
    return '; but for the faults' if any(mark.kind in kinds for mark in marks) else ''


def _anti_windup(controllers: Mapping[str, Any], runs: Mapping[str, RunInfo]) -> str:
    own = {name: controllers.get(run.controller, {}) for name, run in runs.items()}
    off = [name for name, entry in own.items() if not entry.get('anti_windup', True)]
    on = [name for name in runs if name not in off]
    parts = [f'on for {join(on)}'] if on else []
    return '; '.join(parts + ([f'off for {join(off)}'] if off else []))


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
