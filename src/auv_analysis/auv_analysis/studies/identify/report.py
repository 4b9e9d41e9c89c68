"""The report of an identification: tables, verdict, terminal, page and files."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from auv_analysis.output.progress import TextConsole
from auv_analysis.output.text import capital, join, number
from auv_analysis.report.document import Block, Section, Sentence, write_document
from auv_analysis.report.results import Column, Results, Shown, described, terminal
from auv_analysis.studies.identify.couplings import couplings
from auv_analysis.studies.identify.identified import Identified
from auv_analysis.studies.identify.plausibility import (
    contradictions,
    excitation,
    too_coarse,
    too_short,
)
from auv_analysis.studies.identify.prediction import by_name
from auv_analysis.studies.identify.record import Record
from auv_analysis.studies.identify.record import described as of_record
from auv_analysis.studies.identify.whiteness import reservation, told, whiteness
from auv_dynamics.vehicle import DOFS

VEHICLE, NAME = 'vehicle.yaml', 'identify'
NARROW: Mapping[str, tuple[str, ...]] = {  # tables in a terminal, and what they leave out there
    'coefficients': ('left', 'status', 'bootstrap_low', 'bootstrap_high', 'profile_low',
                     'profile_high'),
    'inertia': tuple(f'Upsilon{k}' for k in ('', '_prior', '_low', '_high')),
    'predictions': ('linear', 'angular'),
}  # fmt: skip
JUDGED = 0.5  # s: shorter horizons tell of noise rather than of the model
PROFILED = (
    'Profile likelihoods: the rise of the cost where a coefficient is held and all others are '
    'refitted, in the scale of the sandwich. The parabola that an interval takes for granted has '
    'the square of the deviations.'
)
METHOD = (
    'The start is a weighted linear least squares fit of (1) on local polynomials. Output error '
    'refines it: the model alone is simulated along segments under the recorded command, each from '
    'a start of its own, and the misfit of velocity and attitude is made small. No acceleration is '
    'measured or needed. Inertia stays positive definite (by its Cholesky factor), damping takes '
    'energy.',
    'Intervals are those of a jackknife over segments, a sandwich covariance without its bias: '
    'what disturbs a segment may be correlated inside it. A coefficient of which more than 30 % of '
    'the prior’s own uncertainty is left counts as prior and has no interval.',
    'Errors of predictions are measured by kinetic energy, so that metres and radians add: '
    'sqrt(e^T M e / M_11) with M of the prior.',
)


def results_of(found: Identified, notes: Sequence[str], *, accepted: bool = False) -> Results:
    """All numbers of an identification, and what they say.

    `accepted`: whether there is a vehicle file even if something contradicts it.
    """
    rows, tables = found.coefficients(), couplings(found)
    wrong = contradictions(found)
    white = whiteness(list(found.problem.misfit(found.fit)), found.problem.step)
    identified = [row['name'] for row in rows if row['status'] == 'identified']
    results = Results(
        NAME,
        {
            'vehicle': found.vehicle.name,
            'records': [of_record(record) for record in found.training],
            'held_out': [of_record(record) for record in found.held.record],
            'segments': len(found.problem.segments),
            'segment_length': len(found.problem.segments[0].command) * found.problem.step,
            'observer': found.problem.observer,
            'residual_rms': float((found.fit.cost / found.fit.rows) ** 0.5),
            'residuals': told(white, current=any(r['name'].startswith('current.') for r in rows)),
            'noise': found.problem.noise.tolist(),
            'identified': identified,
            'not_identified': [row['name'] for row in rows if row['status'] != 'identified'],
            'hardly_moving': [entry.name for entry in found.still],
            'combinations': found.combinations(),
            'contradictions': wrong,
            'excitation': [
                *excitation(found.training),
                *too_short(found),
                *([] if wrong else too_coarse(found)),
            ],
            'verdict': verdict(found.predictions, [] if accepted else wrong, reservation(white)),
            'file': '' if wrong and not accepted else VEHICLE,
            'notes': list(notes),
            **_listed(rows, found.predictions, tables),
        },
    )
    known: Mapping[str, Shown] = {
        'name': described('', 'coefficient'),
        'prior': Column('prior', digits=4),
        'value': described('identified', 'or what is left of the prior', digits=4),
        'low': described('low', '95 % interval', digits=4),
        'high': Column('high', digits=4),
        'unit': 'unit',
        'left': described('left', 'of the prior’s uncertainty', decimals=1, scale=100.0),
        'status': described('', 'whether the recording tells it', look='badge'),
    }
    asked = {'bootstrap': len(found.resampled), 'profile': len(found.profiles)}
    for kind in [kind for kind, count in asked.items() if count]:
        known = {**known, f'{kind}_low': Column('low', group=kind, digits=4),
                 f'{kind}_high': Column('high', group=kind, digits=4)}  # fmt: skip
    results.add('coefficients', 'Coefficients of (1), lag, delay and gains.', rows, known)
    add_predictions(results, found.predictions)
    _add_whiteness(results, white)
    if found.profiles:
        points = [
            {'name': p.name, 'unit': p.unit, 'value': x, 'rise': y,
             'deviations': (x - p.value) / p.deviation}
            for p in found.profiles for x, y in zip(p.values.tolist(), p.rise.tolist(), strict=True)
        ]  # fmt: skip
        rise = f'of the cost; a 95 % interval ends at {found.fit.quantile**2:.3g}'
        results.add('profiles', PROFILED, points, {
            'name': described('', 'coefficient'), 'value': Column('held at', digits=4),
            'unit': 'unit', 'rise': described('rise', rise),
            'deviations': described('deviations', 'by the sandwich, from the minimum'),
        })  # fmt: skip
    pairs: Mapping[str, Shown] = {
        'pair': described('pair', 'degrees of freedom'),
        **_interval('M'),
        'M_low': described('low', '95 % interval'),
        'unit': 'unit',
        **_interval('Upsilon', 'Υ'),
        'verdict': described('', 'whether the interval of M excludes zero', look='badge'),
    }
    results.add('inertia', 'Couplings in M and in Υ of (4).', tables['inertia'], pairs)
    for name, symbols, caption in (
        ('deformation', ('delta_xi', 'delta_pi'),
         'Root mean squares of Δξ (33) and Δπ (34) in the motion of the recording.'),
        ('shares', ('N', 'share'), 'N of (4), and shares of the mean kinetic energy (12).'),
    ):  # fmt: skip
        shown: dict[str, Shown] = {'dof': described('', 'degree of freedom')}
        for symbol in symbols:
            shown |= _interval(symbol, symbol)
        results.add(name, caption, tables[name], shown)
    return results


def _interval(symbol: str, group: str = '') -> dict[str, Shown]:
    """Columns of what has a prior, a value and an interval."""
    labels = {'_prior': 'prior', '': 'identified', '_low': 'low', '_high': 'high'}
    return {f'{symbol}{key}': Column(label, group) for key, label in labels.items()}


def _listed(
    rows: Sequence[Mapping[str, Any]],
    predictions: Sequence[Mapping[str, Any]],
    tables: Mapping[str, Sequence[Mapping[str, Any]]],
) -> dict[str, list[dict[str, Any]]]:
    """Parameters, predictions and couplings as programs ask for them, without a reader of Parquet.

    Entries of matrices are named by their indices, from 0.
    """
    predicted: dict[float, dict[str, Any]] = {}
    for row in predictions:
        predictor = 'model' if row['predictor'] == 'new' else row['predictor'].replace(' ', '_')
        predicted.setdefault(row['horizon'], {})[predictor] = row['error']
    sizes = (
        ('deformation', 'dof', ('delta_xi_max', 'delta_pi_max')),
        ('shares', 'dof', ('N', 'share')),
        ('inertia', 'pair', ('Upsilon',)),
    )
    return {
        'parameters': [
            {'name': _indexed(row['name']), 'std': row['deviation'],
             'identifiable': row['status'] == 'identified',
             **{key: row[key] for key in ('unit', 'value', 'low', 'high', 'prior')}}
            for row in rows
        ],
        'prediction': [{'horizon': horizon, **found} for horizon, found in predicted.items()],
        'couplings': [
            {'name': f'{symbol}.{row[key].replace(", ", ".")}', 'value': row[symbol],
             **{part: row[f'{symbol}_{part}'] for part in ('prior', 'low', 'high')}}
            for table, key, symbols in sizes for row in tables[table] for symbol in symbols
        ],
    }  # fmt: skip


def _indexed(name: str) -> str:
    """M.pitch.surge as M[4][0], D_linear.roll as D_linear[3][3]; other names as they are."""
    group, *axes = name.split('.')
    if group not in ('M', 'D_linear', 'D_quadratic'):
        return name
    row, column = axes[0], axes[-1]
    return f'{group}[{DOFS.index(row)}][{DOFS.index(column)}]'


def _add_whiteness(results: Results, rows: Sequence[Mapping[str, Any]]) -> None:
    """Add the table of the residuals of velocities."""
    if rows:
        shown: Mapping[str, Shown] = {
            'dof': described('', 'degree of freedom'),
            'rms': described('rms', 'in standard deviations of the noise'),
            'ljung_box': described('Ljung-Box', 'sum over 20 lags, about 20 if white'),
            'p': described('p', 'how probable that is for white noise'),
            'largest': described('largest', 'autocorrelation'),
            'slow': described('below 1 Hz', 'share of the power', decimals=1, scale=100.0),
            'slow_if_white': described('if white', decimals=1, scale=100.0),
            'verdict': described('', 'whether the model explains all but noise', look='badge'),
        }
        results.add('whiteness', 'Residuals of the velocities: are they white?', rows, shown)


def add_predictions(results: Results, rows: Sequence[Mapping[str, Any]]) -> None:
    """Add the table of predictions."""
    shown: Mapping[str, Shown] = {
        'predictor': 'predictor',
        'horizon': described('horizon, s', 'how far ahead', look='plain'),
        'error': described('error, m/s', 'velocity error by kinetic energy, root mean square'),
        'linear': Column('linear, m/s'),
        'angular': Column('angular, rad/s'),
        'ratio': described('ratio', 'error of the first predictor by that of this one'),
        'ratio_low': described('low', '95 % interval by a bootstrap over blocks of time'),
        'ratio_high': Column('high'),
    }  # fmt: skip
    results.add('predictions', 'Open-loop prediction of what was held out.', rows,
                shown, stub=2)  # fmt: skip


def prediction_results(
    vehicle: str, held: Sequence[Record], rows: Sequence[Mapping[str, Any]], notes: Sequence[str]
) -> Results:
    """Results of a vehicle that only predicts."""
    results = Results(
        'predict',
        {'vehicle': vehicle, 'held_out': [of_record(record) for record in held],
         'verdict': verdict_alone(vehicle, rows), 'notes': list(notes)},
    )  # fmt: skip
    add_predictions(results, rows)
    return results


def _judged(rows: Sequence[Mapping[str, Any]], predictor: str) -> Sequence[Mapping[str, Any]]:
    """Rows of one predictor at horizons that tell of the model, else all of them."""
    every = by_name(rows, predictor)
    return [row for row in every if row['horizon'] >= JUDGED] or every


def verdict_alone(vehicle: str, rows: Sequence[Mapping[str, Any]]) -> str:
    """Whether a vehicle predicts better than what knows nothing of it, in a sentence."""
    said = []
    for name in ('persistence', 'black box'):
        some = _judged(rows, name)
        better = [r for r in some if r['ratio_high'] < 1.0]
        worse = [r for r in some if r['ratio_low'] > 1.0]
        if len(better) == len(some):
            said.append(f'better than {name}')
        elif worse:
            at = join([f'{r["horizon"]:g}' for r in worse])
            said.append(f'worse than {name} at {at} s')
        else:
            said.append(f'not clearly better than {name}')
    return f'{vehicle} predicts {join(said)}.' if rows else 'Nothing was held out, or too little.'


def verdict(
    rows: Sequence[Mapping[str, Any]], contradicted: Sequence[str], reserved: str = ''
) -> str:
    """Whether the new model is better than the old, in a sentence, with what it is reserved by."""
    if contradicted:
        return f'No vehicle file: {contradicted[0]}.'
    if not rows:
        text = 'Nothing was held out, or too little: how good the model is has not been tried'
        return f'{text}{reserved}.'
    first = _judged(rows, 'prior')
    better = [row for row in first if row['ratio_high'] < 1.0]
    worse = [row for row in first if row['ratio_low'] > 1.0]
    row = (worse or better or first)[-1]
    found = (
        f'{number(row["ratio"], 2)} times its error at {row["horizon"]:g} s '
        f'({number(row["ratio_low"], 2)} to {number(row["ratio_high"], 2)})'
    )
    if better and not worse:
        text = f'The new model predicts what it has not seen better than the prior: {found}'
    elif worse:
        text = f'The new model is not better than the prior: {found}'
    else:
        text = f'The new model cannot be told from the prior on what was held out: {found}'
    rivals = [
        name for name in ('persistence', 'black box')
        if any(r['ratio_high'] >= 1.0 for r in by_name(rows, name) if r['horizon'] >= JUDGED)
    ]  # fmt: skip
    beaten = f'; not clearly better than {join(rivals)}' if rivals else ''
    return f'{text}{beaten}{reserved}.'


def sentences(results: Results) -> list[str]:
    """The result in sentences, the most important first."""
    facts = results.facts
    count = len(facts['identified'])
    wrong = facts['contradictions'][0 if facts['file'] else 1 :]
    said = [facts['verdict'], *(f'{capital(text)}.' for text in wrong)]
    every = count + len(facts['not_identified'])
    said.append(f'{count} of {every} coefficients are identified.')
    real = [row for row in results.tables['inertia'].records() if row['verdict'] == 'real']
    for row in sorted(real, key=lambda r: -abs(r['Upsilon']))[:4]:
        half = (row['M_high'] - row['M_low']) / 2
        said.append(f'The coupling of {row["pair"].replace(", ", " with ")} is real: '
                    f'{number(row["M"])} ± {number(half, 2)} {row["unit"]}.')  # fmt: skip
    if facts['hardly_moving']:
        said.append(f'Not searched, as it hardly moves: {join(facts["hardly_moving"])}.')
    said.append(f'{facts["residuals"]}.')
    said += [f'Open: {one["words"]}.' for one in facts['combinations'][:4]]
    return said + [f'{capital(text)}.' for text in facts['excitation']]


def narrow(results: Results, name: str) -> Any:
    """A table for a terminal, without the columns that do not fit there."""
    table = results.tables[name]
    shown = {key: column for key, column in table.shown.items() if key not in NARROW[name]}
    return terminal(replace(table, shown=shown), title=True)


def print_results(results: Results, folder: Path) -> None:
    """Print tables and verdict."""
    out = TextConsole(highlight=False)
    for name in NARROW:
        out.print(narrow(results, name))
        out.print('')
    for text in [*sentences(results), f'folder: {folder}']:
        out.print(text, markup=False, soft_wrap=True)


def _asked(found: Identified) -> list[str]:
    """How what was asked for was done."""
    gain, count = found.problem.observer, len(found.resampled)
    said = [
        f'Along segments the simulated state follows the measurements by a gain of {gain:g} a '
        'step; residuals are errors of prediction, which a slow disturbance makes less wrong.'
    ] if gain else []  # fmt: skip
    if count:
        said.append(f'The bootstrap has {count} draws of blocks of time, each refitted by two '
                    'Gauss-Newton steps, the second one simulated anew.')  # fmt: skip
    return said


def write_report(found: Identified, results: Results, out: Path) -> Path:
    """Write report.html with its figures; returns its path."""
    from auv_analysis.studies.identify.plots import draw

    tables = {name: table.records() for name, table in results.tables.items()}
    figures = draw(found, tables, out / 'figures')
    facts, t = results.facts, results.tables
    told = [Sentence(text, 'predictions' if i == 0 else '')
            for i, text in enumerate(sentences(results))]  # fmt: skip
    open_: list[Block] = [f'{capital(one["words"])}: '
                          f'by the data alone to {100 * one["left"]:.0f} % of its prior deviation.'
                          for one in facts['combinations']]  # fmt: skip
    sections = [
        Section('predictions', 'Judged on what it has not seen',
                [figures['prediction'], t['predictions']]),
        Section('couplings', 'Couplings before and after',
                [figures['inertia'], t['inertia'], t['deformation'], t['shares']]),
        Section('coefficients', 'What was identified',
                [t['coefficients'], *(x['profiles'] for x in (figures, t) if 'profiles' in x)]),
        Section('open', 'What the data cannot tell', open_),
        Section('fit', 'Predicted against recorded', [figures['trace'], figures['residuals'],
                 *([t['whiteness']] if 'whiteness' in t else [])]),
        Section('method', 'How it was found', [*METHOD, *_asked(found), *facts['notes']]),
    ]  # fmt: skip
    listings = [(VEHICLE, (out / VEHICLE).read_text('utf-8'))] if (out / VEHICLE).exists() else []
    names = join([*dict.fromkeys(record['name'] for record in facts['records'])])
    title = f'Identification of {facts["vehicle"]}'
    return write_document(out, title, f'from {names}', told, sections, listings)
