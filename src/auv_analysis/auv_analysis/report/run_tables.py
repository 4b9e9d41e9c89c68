"""Tables of a report of runs, along the paper's procedure: views of `summary.json`."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from auv_analysis.metrics.coupling import input_deformation, velocity_deformation
from auv_analysis.metrics.quantities import METRICS, SIGNALS, VELOCITY, WRENCH, Quantity
from auv_analysis.metrics.settling import TRANSIENT
from auv_analysis.output.text import join, number, plain
from auv_analysis.report.results import (
    Column,
    Results,
    Table,
    described,
    document_table,
    json_pointer,
    make_table,
)
from auv_analysis.report.scenario_text import SetUp, gain_text
from auv_analysis.runs.run import FOREIGN, RunInfo
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.laws.law import SHIPPED
from auv_gvc_controller.laws.model import inverse_upper

Summaries = Mapping[str, Mapping[str, Any]]
ORIGIN = {
    'bag': 'recorded on the node graph',
    'simulate': 'simulated in process',
    FOREIGN: 'recorded by another system',
}


def controllers_table(runs: Mapping[str, RunInfo]) -> Table:
    """Name, law, gains and origin of each run; a gain left to its default says so."""
    rows = [
        {
            'controller': name,
            'law': run.law,
            'gains': _gains(run),
            'duration': run.duration,
            'step': run.step,
            'samples': run.samples,
            'origin': ORIGIN.get(run.source, run.source),
        }
        for name, run in runs.items()
    ]
    shown = {
        'controller': described('controller', 'name of the run'),
        'law': described('law', 'the control law, shipped or module:Class'),
        'gains': described('gains', 'as the scenario gives them; I is the identity'),
        'duration': described('length', 'from the first to the last sample', 's', look='plain'),
        'step': described('step', 'control period and integration step', 's', look='plain'),
        'samples': described('samples', 'number of samples, steps + 1'),
        'origin': described('origin', 'recorded from nodes, or computed in one process'),
    }
    caption = 'Controllers: law, gains and origin of the run.'
    names = list(runs)
    where = lambda row, column: json_pointer(names[row], column)  # noqa: E731
    return make_table('controllers', caption, rows, shown, pointer=where)


def _gains(run: RunInfo) -> str:
    defaults = getattr(SHIPPED.get(run.law), '_field_defaults', {}) if run.gains else {}
    texts = [f'{gain} = {gain_text(value)}' for gain, value in run.gains.items()]
    texts += [
        f'{gain} = {gain_text(value)} (default)'
        for gain, value in defaults.items()
        if gain not in run.gains
    ]
    return ', '.join(texts)


def set_up_table(name: str, scene: SetUp, runs: Sequence[str], *, several: bool) -> Table:
    """The scenario beside its controllers, in words.

    Parameters
    ----------
    name : of the table
    scene : what is said
    runs : names of those that it is about
    several : whether the report has other scenes beside it

    """
    caption = f'Set-up of {scene.name}' if scene.name else 'Set-up, as far as the runs say it'
    caption += f': {join(runs)}.' if several else '.'
    rows = [{'what': what, 'how': '\n'.join(lines)} for what, lines in scene.rows]
    return make_table(name, caption, rows, {'what': 'what', 'how': 'how'})


def gains_tables(runs: Mapping[str, RunInfo], summaries: Summaries) -> Iterator[Table]:
    """Upsilon and N of each vehicle that differs, then K_D and K_f that are no multiples of I."""
    vehicles = decompositions(runs, summaries)
    for index, (names, parts) in enumerate(vehicles, start=1):
        tail = f'_{index}' if len(vehicles) > 1 else ''
        whose = runs[names[0]].vehicle.name + (f' ({join(names)})' if tail else '')
        base = names[0], 'decomposition'
        yield _matrix(f'Upsilon{tail}', f'Υ of {whose}, (4).', parts['Upsilon'], *base, 'Upsilon')
        caption = f'Diagonal of N of {whose}, (9), kg and kg m².'
        yield _matrix(f'N{tail}', caption, [parts['N']], *base, 'N', digits=6)
    for index, (symbol, names, gain) in enumerate(_body_gains(summaries), start=1):
        if _multiple(gain) is None:
            caption = f'{SYMBOLS[symbol]} of {join(names)} in the body frame.'
            yield _matrix(f'gain_{symbol}_{index}', caption, gain, names[0], 'gains', symbol)


SYMBOLS = {'K_D': 'Velocity gain K_D', 'K_f': 'Adaptation gain K_f'}


def _matrix(name: str, caption: str, values: Any, *where: str, digits: int = 4) -> Table:
    """Matrix (r, 6) at a place of `summary.json`, a row per degree of freedom."""
    square = len(values) == len(DOFS)
    heads = DOFS if square else ['N']
    rows = [
        {'': head, **dict(zip(DOFS, row, strict=True))}
        for head, row in zip(heads, values, strict=True)
    ]
    shown: dict[str, Column | Quantity | str] = {'': ''}
    shown |= {dof: Column(dof, digits=digits, look='plain') for dof in DOFS}

    def at(row: int, column: str) -> str:
        return json_pointer(*where, *([row] if square else []), DOFS.index(column))

    return make_table(name, caption, rows, shown, pointer=at)


def shared(of_runs: Iterable[tuple[str, Any]]) -> list[tuple[list[str], Any]]:
    """Names that have something in common, and what that is, in the order of the first ones."""
    found: list[tuple[list[str], Any]] = []
    for name, value in of_runs:
        same = next((names for names, known in found if known == value), None)
        if same is None:
            found.append(([name], value))
        else:
            same.append(name)
    return found


def decompositions(
    runs: Mapping[str, RunInfo], summaries: Summaries
) -> list[tuple[list[str], Mapping[str, Any]]]:
    """Runs that share a decomposition, and that decomposition."""
    return shared((name, summaries[name]['decomposition']) for name in runs)


def _body_gains(summaries: Summaries) -> list[tuple[str, list[str], Any]]:
    """K_D and K_f, once for those that share them."""
    every = ((n, (k, s['gains'][k])) for n, s in summaries.items() for k in SYMBOLS)
    return [(symbol, names, K) for names, (symbol, K) in shared(every) if K is not None]


def scalar_gains(summaries: Summaries) -> list[dict[str, Any]]:
    """Gains that a sentence says: multiples of I, and zero."""
    return [
        {'symbol': symbol, 'controllers': names, 'text': text}
        for symbol, names, gain in _body_gains(summaries)
        if (text := _multiple(gain)) is not None
    ]


def _multiple(gain: Any) -> str | None:
    """A matrix as a multiple of I in words; None where it is none."""
    matrix = np.array(gain)
    if not matrix.any():
        return 'zero (no adaptive term)'
    scalar = np.array_equal(matrix, matrix[0, 0] * np.eye(6))
    return f'{plain(matrix[0, 0], 6)} I' if scalar else None


ERROR, ESTIMATE, INPUT = 'velocity error', 'estimation error w', 'input τ'
LATE = f'max after {TRANSIENT:g} s'
KEY_FIGURES = {  # metric -> group, head
    'velocity_error.rms': (ERROR, 'RMS'),
    'velocity_error.max_after_2s': (ERROR, LATE),
    'velocity_error.settling_time': (ERROR, 'settled'),
    'lumped_error.rms': (ESTIMATE, 'RMS'),
    'lumped_error.max_after_2s': (ESTIMATE, LATE),
    'effort.rms': (INPUT, 'RMS'),
    'effort.max': (INPUT, 'max'),
}
UNITS = 'Linear rows in m/s and N, angular rows in rad/s and N m.'


def key_figures_table(summaries: Summaries, without_estimate: Sequence[str]) -> Table:
    """Errors, estimates and inputs of every run and degree of freedom.

    Parameters
    ----------
    summaries : name -> `summarize(run)`
    without_estimate : names of runs whose law has no adaptive term

    """
    caption = f'Metrics of the runs. {UNITS} An en dash (–): not known, or not settled.'
    if without_estimate:
        caption += f' Under {join(without_estimate)} nothing is estimated: there w is −F.'
    shown: dict[str, Column | Quantity | str] = {'controller': 'controller', 'dof': ''}
    for metric, (group, head) in KEY_FIGURES.items():
        time = metric.endswith('settling_time')
        meaning = METRICS[metric].meaning + ('' if time else f'; {METRICS[metric].unit}')
        decimals = 2 if time else None
        shown[metric] = described(head, meaning, 's' * time, group=group, decimals=decimals)
    return _by_dof('key_figures', caption, summaries, shown)


def _by_dof(
    name: str,
    caption: str,
    summaries: Summaries,
    shown: Mapping[str, Column | Quantity | str],
    **about: Any,
) -> Table:
    """A row per run and degree of freedom; columns named by the keys of their summaries."""
    rows = [
        {'controller': run, 'dof': dof, 'unit': WRENCH[i // 3],
         **{metric: (run, *metric.split('.'), i) for metric in shown if '.' in metric}}
        for run in summaries for i, dof in enumerate(DOFS)
    ]  # fmt: skip
    results = Results('summary', dict(summaries))
    return document_table(results, name, caption, rows, shown, stub=2, **about)


ESTIMATED = {  # key of the summary -> head, symbol, caption, note
    'unexplained': (
        'F by (1)', 'F',
        'Unexplained wrench: F of (1) from measured motion and wrench.',
        ' The law’s own estimate f is not recorded, so there is no w.',
    ),
    'required_wrench': (
        'required wrench', 'it',
        'Required wrench: M ν̇ + C ν + D ν + g of the measured motion, τ − F of (1).',
        ' No wrench was recorded, so F, the inputs and Δπ are not known.',
    ),
}  # fmt: skip


def estimate_table(summaries: Summaries, kind: str) -> Table | None:
    """A wrench by inverse dynamics of the runs of which it was estimated; None: of none.

    Parameters
    ----------
    summaries : name -> `summarize(run)`
    kind : of `ESTIMATED`

    """
    there = {n: s for n, s in summaries.items() if s[kind] is not None}
    if not there:
        return None
    group, symbol, caption, remark = ESTIMATED[kind]
    shown: dict[str, Column | Quantity | str] = {
        'controller': 'controller',
        'dof': '',
        f'{kind}.mean': described('mean', f'mean of {symbol} over the samples', group=group),
        f'{kind}.rms': described('RMS', f'root mean square of {symbol}', group=group),
        f'{kind}.max': described('max', f'largest magnitude of {symbol}', group=group),
        f'{kind}.error_rms': described('error', 'RMS of its standard error', group=group),
    }
    if kind == 'unexplained':
        meaning = 'root mean square of the recorded command'
        shown['effort.rms'] = described('RMS of τ', meaning)
    shown |= {
        'acceleration.window': described('window', 'of the rate filter', 's', group='rates'),
        'acceleration.error_rms': described(
            'error', 'RMS of the standard error of ν̇; m/s², rad/s²', group='rates'
        ),
        'unit': 'unit',
    }
    parts = [
        f'of {name} over the {number(100.0 * s["gaps"]["valid_share"])} % of its length that have '
        f'samples, rates by {s["acceleration"]["filter"]}'
        for name, s in there.items()
    ]
    note = f'O{"; ".join(parts)[1:]}.{remark}'
    return _by_dof(kind, caption, there, shown, note=note)


CERTIFICATE = (  # label, unit, key of summary.json, factor
    ('identity (26): largest residual', '% of max |(26)|', 'identity_residual', 100.0),
    ('identity (26): RMS residual', '% of the RMS of (26)', 'identity_residual_rms', 100.0),
    ('identity (26): largest after 2 s', '% of max', 'identity_residual_after_2s', 100.0),
    ('L increases by (26)', '% of the samples', 'share_of_time_increasing', 100.0),
    ('condition (27) holds', '% of the samples', 'share_condition_27', 100.0),
    ('bound (28) holds', '% of the samples', 'share_bound_28', 100.0),
    ('largest ρ of (28)', 'W', 'rho_max', 1.0),
    ('sup ‖s‖', 'm/s, rad/s', 'sup_s', 1.0),
    ('sup ‖z‖', 'm, rad', 'sup_z', 1.0),
    ('sup ‖w‖', 'N, N m', 'sup_w', 1.0),
    ('L at the start', 'J', 'L_first', 1.0),
    ('L at the end', 'J', 'L_last', 1.0),
)


def certificate_table(summaries: Summaries) -> Table | None:
    """A row per metric of the certificate, a column per run; None where none is known."""
    rows = []
    for label, unit, key, factor in CERTIFICATE:
        found = {n: s['lyapunov'].get(key) for n, s in summaries.items()}
        values = {n: None if v is None else factor * v for n, v in found.items()}
        rows.append({'metric': label, 'unit': unit, **_columns(values)})
    names = _columns({name: name for name in summaries})
    if all(row[column] is None for row in rows for column in names):
        return None
    shown: dict[str, Column | Quantity | str] = {'metric': '', **names, 'unit': 'unit'}

    def at(row: int, column: str) -> str:
        _, _, key, factor = CERTIFICATE[row]
        where = json_pointer(names[column], 'lyapunov', key)
        return where if factor == 1.0 else f'{where}*{factor:g}'

    caption = 'The certificate (23) to (28) of each run; the residual is that of an identity only '
    caption += 'where the certificate applies.'
    return make_table('certificate', caption, rows, shown, pointer=at)


def _columns(of_runs: Mapping[str, Any]) -> dict[str, Any]:
    """The same by column names that no other column has."""
    return {f'run {name}': value for name, value in of_runs.items()}


def reasons(summaries: Summaries) -> list[str]:
    """Why a certificate does not apply, each reason once with the runs that it is of."""
    found: dict[str, list[str]] = {}
    for name, summary in summaries.items():
        entry = summary['lyapunov']
        if not entry['applicable']:
            for reason in (entry['reason'] or 'not applicable').split('; '):
                found.setdefault(reason, []).append(name)
    return [f'No certificate of {join(names)}: {text}.' for text, names in found.items()]


def energy_table(summaries: Summaries) -> Table:
    """Mean kinetic energy and its shares by run and window."""
    rows: list[dict[str, Any]] = []
    for name, summary in summaries.items():
        for i in range(len(summary['kinetic_energy_windows'])):
            at = name, 'kinetic_energy_windows', i
            row = {'controller': name, 'mean': (*at, 'mean')}
            row |= {f'window.{k}': (*at, 'window', k) for k in range(2)}
            rows.append(row | {f'shares_percent.{k}': (*at, 'shares_percent', k) for k in range(6)})
    shown: dict[str, Column | Quantity | str] = {
        'controller': 'controller',
        'window.0': described('from', 'begin of the window', 's', look='plain'),
        'window.1': described('to', 'end of the window', 's', look='plain'),
        'mean': Column(METRICS['kinetic_energy.mean'], decimals=2),
    }
    for k in range(6):
        shown[f'shares_percent.{k}'] = described(f'ξ{k + 1}', SIGNALS['share'].meaning, '%')

    caption = 'Mean kinetic energy and the shares of its components, by window.'
    return document_table(Results('summary', dict(summaries)), 'energy', caption, rows, shown)


def components_table(summaries: Summaries) -> Table | None:
    """Mean energies of the components that are known where the total is not; None: of no run."""
    of_runs = {n: s for n, s in summaries.items() if s['kinetic_energy']['mean'] is None}
    there = {n: s for n, s in of_runs.items() if s['kinetic_energy']['mean_by_component']}
    if not there:
        return None
    metric = 'kinetic_energy.mean_by_component'
    shown: dict[str, Column | Quantity | str] = {
        'controller': 'controller',
        'dof': '',
        metric: described('mean', METRICS[metric].meaning, 'J'),
    }
    caption = 'Mean kinetic energy of the components of runs in which not every velocity is known.'
    return _by_dof('energy_components', caption, there, shown)


KINDS: dict[str, tuple[str, tuple[str, str], list[str], Callable[[np.ndarray], np.ndarray]]] = {
    'delta_xi': (
        'Δξ', VELOCITY, [*'uvwpqr'], lambda Upsilon: velocity_deformation(inverse_upper(Upsilon))
    ),
    'delta_pi': ('Δπ', WRENCH, [f'τ_{axis}' for axis in 'XYZKMN'], input_deformation),
}  # fmt: skip


def couplings_table(summaries: Summaries, vehicle: str) -> Table:
    """Rows of delta_xi and delta_pi: the rule, and each run's largest magnitude.

    Parameters
    ----------
    summaries : name -> `summarize(run)`
    vehicle : whose rule is shown where there are several, else ''

    """
    first = next(iter(summaries.values()))
    rows = []
    for kind, (symbol, units, signals, matrix) in KINDS.items():
        weights = matrix(np.array(first['decomposition']['Upsilon']))
        zeros = first['coupling']['structural_zeros'][kind]
        for i, dof in enumerate(DOFS):
            peaks = {n: (n, 'coupling', f'{kind}_max', i) for n in summaries}
            rule = 'structural zero' if dof in zeros else _linear(weights[i], signals)
            rows.append({
                'symbol': f'{symbol}_{i + 1}', 'dof': dof, 'rule': rule, 'unit': units[i // 3],
                'kind': 'zero' if dof in zeros else '', **_columns(peaks),
            })  # fmt: skip
    names = _columns({name: name for name in summaries})
    shown: dict[str, Column | Quantity | str] = {
        'symbol': Column('', look='maths'),
        'dof': described('', 'degree of freedom that is deformed'),
        'rule': described('rule', 'what adds to it, by (31) and (32)', look='maths'),
        **{n: described(name, 'largest magnitude', kind='kind') for n, name in names.items()},
        'unit': 'unit',
    }

    caption = 'Couplings: the rule, and the largest magnitude over the run'
    caption += f'; the rule is that of {vehicle}.' if vehicle else '.'
    results = Results('summary', dict(summaries))
    return document_table(results, 'couplings', caption, rows, shown, stub=2)


def terms_table(name: str, summary: Mapping[str, Any]) -> Table | None:
    """Pieces of (31) and (32) of a run, with their part in what they add to; None without any.

    Parameters
    ----------
    name : of the run
    summary : `summarize(run)`

    """
    rows = []
    for kind, (symbol, units, signals, _) in KINDS.items():
        for k, term in enumerate(summary['coupling_terms'][kind]):
            i, j = DOFS.index(term['to']), DOFS.index(term['from'])
            about = {'symbol': f'{symbol}_{i + 1}', 'times': signals[j], 'unit': units[i // 3]}
            at = name, 'coupling_terms', kind, k
            numbers = {key: (*at, key) for key in ('coefficient', 'rms', 'max', 'share_percent')}
            rows.append({**term, **about, **numbers})
    if not rows:
        return None
    part = 'part of the mean square of the whole deformation; those of one component add to 100 %'
    shown: dict[str, Column | Quantity | str] = {
        'symbol': Column('', look='maths'),
        'to': described('of', 'degree of freedom that is deformed'),
        'from': described('by', 'degree of freedom that deforms it'),
        'coefficient': described('coefficient', 'entry of Υ⁻¹ in (31), of Υᵀ in (32)'),
        'times': described('times', 'what the coefficient multiplies', look='maths'),
        'rms': described('RMS', 'root mean square of the piece over the run'),
        'max': described('max', 'largest magnitude of the piece over the run'),
        'unit': 'unit',
        'share_percent': described('part', part, '%'),
    }
    caption = f'The pieces that add to the couplings of {name}: which motion or input causes which.'
    results = Results('summary', {name: summary})
    return document_table(results, 'terms', caption, rows, shown, stub=3)


def _linear(row: np.ndarray, signals: list[str]) -> str:
    """A linear form such as '−0.015 p + 0.075 r'; entries that are rounding are left out."""
    scale = 1e-12 * max(1.0, np.abs(row).max())
    terms = [(value, name) for value, name in zip(row, signals, strict=True) if abs(value) > scale]
    text = ' '.join(f'{"+" if v > 0 else "−"} {plain(abs(v), 3)} {name}' for v, name in terms)
    return (text.removeprefix('+ ') if text[:1] == '+' else text.replace('− ', '−', 1)) or '0'


def notes(runs: Mapping[str, RunInfo]) -> list[str]:
    """Notes of the runs, each once."""
    return list(
        dict.fromkeys(f'{name}: {note}' for name, run in runs.items() for note in run.notes)
    )
