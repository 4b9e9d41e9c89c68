"""The paper's procedure in a report: step 3 (sensitivity), samples, step 6 (discussion)."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from pyarrow import parquet

from auv_analysis.metrics.coupling import delta_pi, delta_xi
from auv_analysis.metrics.energy import kinetic_energy
from auv_analysis.metrics.quantities import VELOCITY, WRENCH, gain_mathtext, quantity
from auv_analysis.output.arrow import pa
from auv_analysis.output.new_files import write_table
from auv_analysis.output.text import Maths, fixed, join, number, plain, symbol
from auv_analysis.report import plots
from auv_analysis.report.document import Block, Section, Sentence
from auv_analysis.report.plots import Drawn, FigureRecord, HeatMap, save_figures
from auv_analysis.report.results import Shown, Table, described, make_table
from auv_analysis.runs.run import Run
from auv_analysis.studies.study.sensitivity import ROUNDING, Kpi, Row, Sensitivity
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.laws.model import ControlModel, control_model

FILE = 'sensitivity.parquet'
COLUMNS = (
    'value', 'smallest', 'largest', 'spread', 'spread_conf', 'spread_low', 'spread_high', 'rank',
    'rank_low', 'rank_high', 'gain', 'elasticity', 'S1', 'S1_conf', 'ST', 'ST_conf', 'mu_star',
    'mu_star_conf', 'sigma', 'doubled', 'alike',
)  # fmt: skip
HEADLINE = 'velocity_error.rms'
METHODS = {'sobol': 'Sobol’', 'morris': 'Morris'}
WEIGHTS = {
    'sobol': (
        'total index',
        'share of the variance that the gain makes, alone and with others (the sum may exceed 1)',
    ),
    'morris': ('effect μ*', 'mean change of the logarithm over the whole range of the gain'),
}
HEADS: dict[str, Shown] = {
    'kpi': 'KPI',
    'value': described('value', 'with the gains of the scenario'),
    'unit': 'unit',
    'spread': described(
        'spread', 'standard deviation of its logarithm: about its relative change', digits=2
    ),
    'spread_conf': described('±', 'half of its 95 % interval', digits=1),
    'rank': described('place', 'by spread among its degrees of freedom'),
    'alike': 'of',
    'gain': described('main gain', 'the gain that does most'),
    'doubled': described('× 2', 'change of the KPI when that gain is doubled', '%', digits=2),
}  # fmt: skip
OF_GAIN = 'gain.'  # begins the column of a gain, which may be called as one of these
SHOWN = (  # what is drawn of step 3
    'velocity_error.rms', 'velocity_error.max_after_2s', 'lumped_error.rms', 'effort.rms',
    'effort.max',
)  # fmt: skip
ROW = 0.185  # in, height of a row


def write_sensitivities(folder: Path, found: Sequence[Sensitivity]) -> Path:
    """Write the sensitivities of all controllers as `sensitivity.parquet`.

    Columns: controller, law, those of `Sensitivity.rows`, method, count, rollouts, span,
    span_asked, diverged (at all spans together), seed, and reason: why a KPI, or all of them, has
    no indices.

    """
    return write_table(folder / FILE, [row for of in found for row in _stored(of)])


def _stored(of: Sensitivity) -> Iterator[Row]:
    """Rows of the file: of KPIs with indices, of those without, of a refusal."""
    about = {'method': of.method, 'count': of.count, 'rollouts': of.rollouts, 'span': of.span}
    about |= {'span_asked': of.asked, 'diverged': sum(of.failed.values()), 'seed': of.seed}
    rows: list[Row] = [*of.rows]
    rows += [
        {'figure': kpi.name, 'dof': kpi.dof, 'unit': kpi.quantity.unit, 'reason': reason}
        for kpi, reason in of.excluded.items()
    ]
    rows += [{'reason': of.refusal}] if of.refusal else []
    for row in rows:
        words = {'controller': of.controller, 'law': of.law}
        words |= {name: row.get(name, '') for name in ('figure', 'dof', 'unit')}
        numbers = {name: row.get(name, '' if name == 'gain' else None) for name in COLUMNS}
        yield words | numbers | about | {'reason': row.get('reason', '')}


def sensitivity_table(found: Sequence[Sensitivity], of: Sensitivity) -> Table:
    """KPIs of one of them, without a refusal, by falling spread, with the gains that move each."""
    stored = enumerate(row for one in found for row in _stored(one))
    place = {(r['controller'], r['figure'], r['dof'], r['gain']): i for i, r in stored}
    group, meaning = WEIGHTS[of.method]
    rows = [
        {'kpi': kpi.quantity.label, **mine[0]}
        | {f'{OF_GAIN}{row["gain"]}': row[of.weight] for row in mine}
        for kpi, mine in of.kpis.items()
    ]

    def pointer(i: int, column: str) -> str:
        row = rows[i]
        gain, name = row['gain'], column
        if column.startswith(OF_GAIN):
            gain, name = column.removeprefix(OF_GAIN), of.weight
        return f'{FILE}:{name}[{place[of.controller, row["figure"], row["dof"], gain]}]'

    gains: dict[str, Shown] = {
        f'{OF_GAIN}{gain}': described(symbol(gain), meaning, group=group, decimals=2)
        for gain in of.gains
    }
    caption = (
        f'How the KPIs of {of.controller} change when every gain is multiplied by a number '
        f'of its own between 1/{plain(of.span)} and {plain(of.span)} (log-uniform): '
        f'{of.rollouts} runs, indices after {METHODS[of.method]}.'
    )
    name = f'sensitivity_{of.controller}'
    return make_table(name, caption, rows, HEADS | gains, pointer=pointer, folded=True)


def left_out_table(found: Sequence[Sensitivity]) -> Iterator[Table]:
    """KPIs and gains that have no indices, and why; no table where there are none."""
    heads = ('controller', 'what', 'why')
    rows = [
        dict(zip(heads, (of.controller, *entry), strict=True))
        for of in found
        for entry in _left_out(of)
    ]
    caption = 'What is left out of the study of gains: its logarithm does not exist or never moves.'
    shown = {name: name for name in heads}
    if rows:
        name = 'sensitivity_left_out'
        yield make_table(name, caption, rows, shown, stub=2, folded=True)


def _left_out(of: Sensitivity) -> Iterator[tuple[str, str]]:
    if of.refusal:
        yield 'all KPIs', of.refusal
    yield from ((f'gain {gain}', reason) for gain, reason in of.left_out.items())
    yield from ((kpi.quantity.label, reason) for kpi, reason in of.excluded.items())


def sensitivity_sentences(found: Sequence[Sensitivity]) -> list[Sentence]:
    """Findings of the study of gains, a few sentences for each controller."""
    return [Sentence(text, source) for of in found for text, source in _sentences(of)]


def _sentences(of: Sensitivity) -> Iterator[tuple[str, str]]:
    table = f'table-sensitivity_{of.controller}'
    if of.refusal:
        yield (
            f'How {of.controller} follows its gains is not known: {of.refusal}.',
            'table-sensitivity_left_out',
        )
        return
    for span, failed in of.failed.items():
        yield (
            f'Under {of.controller}, {failed} rollouts failed with gains within a factor of '
            f'{plain(span)}; its study takes a factor of {plain(of.span)}.',
            table,
        )
    for dof, rows in [*of.of(HEADLINE).items()][:1]:
        yield _headline(of, dof, rows[0]), table


def _headline(of: Sensitivity, dof: str, main: Row) -> str:
    """The error that follows the gains most, by the row of the gain that does most."""
    sure = (
        f'first of {main["alike"]} in 95 % of the resamplings'
        if main['rank_high'] == 1
        else f'place {main["rank_low"]} to {main["rank_high"]} of {main["alike"]}'
    )
    sign, gain = '−' if main['doubled'] < 0 else '+', main['gain']
    share = ''
    if of.method == 'sobol':
        share = f'{gain} makes {number(min(100 * main["ST"], 100), 2)} % of its variance, and '
    return (
        f'Under {of.controller} the {quantity(HEADLINE).label} that follows the gains most is that '
        f'of {dof} (spread {number(main["spread"], 2)}, {sure}): '
        f'{share}doubling {gain} changes it by about {sign}{number(abs(main["doubled"]), 2)} %.'
    )


def sensitivity_plots(found: Sequence[Sensitivity], folder: Path) -> list[FigureRecord]:
    """Draw the errors, estimates and inputs of each controller; no files where nothing follows."""
    made = {f'sensitivity_{of.controller}': partial(_plot, of) for of in found}
    return [*save_figures(folder, made).values()]


def _plot(found: Sensitivity) -> Drawn:
    title = f'Sensitivity to the gains, {found.controller}'
    shown = {kpi: rows for kind in SHOWN for kpi, rows in found.kpis.items() if kpi.name == kind}
    if not shown:
        return None, title, f'{title}: nothing to draw.'
    group, meaning = WEIGHTS[found.method]
    figure = plots.new_figure(ROW * len(shown) + 0.9)
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.5, 1.0))
    weights = np.array([
        [row[found.weight] for gain in found.gains for row in rows if row['gain'] == gain]
        for rows in shown.values()
    ])  # fmt: skip
    heads = [gain_mathtext(gain) for gain in found.gains]
    plots.draw_grid(right, HeatMap(weights, heads, '', 'Blues', decimals=2), fontsize=7.5)
    _bars(left, shown)
    plots.letter(left, 0, 'spread, 95 % interval')
    plots.letter(right, 1, group)
    caption = (
        f'{title}: (a) standard deviation of the logarithm of a KPI when every gain is '
        f'multiplied by a number of its own between 1/{plain(found.span)} and '
        f'{plain(found.span)}; (b) {group} after {METHODS[found.method]}: {meaning}.'
    )
    return figure, title, caption


def _bars(axes: Axes, shown: Mapping[Kpi, Sequence[Row]]) -> None:
    rows = np.arange(len(shown))
    spread, low, high = (
        np.array([of_gains[0][name] for of_gains in shown.values()])
        for name in ('spread', 'spread_low', 'spread_high')
    )
    colours = [plots.COLOURS[SHOWN.index(kpi.name)] for kpi in shown]
    axes.barh(rows, spread, color=colours, height=0.72)
    axes.errorbar(
        spread, rows, xerr=[np.maximum(spread - low, 0.0), np.maximum(high - spread, 0.0)],
        fmt='none', ecolor='#222222', elinewidth=0.9, capsize=1.6,
    )  # fmt: skip
    axes.set_yticks(rows, [kpi.quantity.label for kpi in shown])
    axes.set_ylim(len(shown) - 0.5, -0.5)
    axes.set_xlim(0.0, 1.04 * float(high.max()))
    axes.grid(visible=False, axis='y')
    axes.tick_params(axis='y', length=0)
    axes.set_xlabel('standard deviation of ln(KPI)')


GAINS = (
    'Every gain is multiplied by a number of its own, drawn log-uniformly; each KPI of the run '
    'is taken by its logarithm, so that its standard deviation is about a relative change. '
    'Sensitive is what has a large one. The index of a gain is the share of the variance that it '
    'makes.'
)


def sensitivity_section(out: Path, found: Sequence[Sensitivity]) -> tuple[Section, list[Sentence]]:
    """Section on the gains, and what the summary says; writes `sensitivity.parquet` and figures."""
    write_sensitivities(out, found)
    sentences = sensitivity_sentences(found)
    known = [of for of in found if not of.refusal]
    blocks: list[Block] = [GAINS, *sentences, *sensitivity_plots(known, out / 'figures')]
    blocks += (sensitivity_table(found, of) for of in known)
    blocks += left_out_table(found)
    return Section('sensitivity', 'Step 3: what a change of the gains does', blocks), sentences


def write_samples(run: Run, path: Path) -> Path:
    """Write a row for every sample, block by block.

    Parameters
    ----------
    run : of `simulate` or of a bag, of any length
    path : of the Parquet file; the columns of the run, and `xi.surge` and so on for xi,
        kinetic_energy (½ N_i xi_i² of (30), J), delta_xi (33), delta_pi (34)

    Returns
    -------
    path : the same

    """
    model = control_model(run.vehicle)
    tables = (_table(block, model) for block in run.blocks())
    first = next(tables)
    with parquet.ParquetWriter(path, first.schema, compression='zstd') as writer:
        for rows in chain([first], tables):
            writer.write_table(rows)
    return path


def _table(run: Run, model: ControlModel) -> pa.Table:
    Upsilon, inverse = model.Upsilon.reshape(6, 6), model.Upsilon_inv.reshape(6, 6)
    signals = {
        'kinetic_energy': kinetic_energy(inverse, model.N, run.nu),
        'xi': run.nu @ inverse.T,
        'delta_xi': delta_xi(inverse, run.nu),
        'delta_pi': delta_pi(Upsilon, run.tau),
    }
    columns = run.columns()
    for name, values in signals.items():
        columns |= {f'{name}.{dof}': values[:, i] for i, dof in enumerate(DOFS)}
    return pa.table(columns)


Summary = Mapping[str, Any]
MOST = 95.0  # %: share that counts as nearly all
SMALL = 0.01  # of a coupling relative to what it deforms: below it nothing is deformed
DEFORMED = {  # kind of coupling -> what is deformed by what, its own metric, units
    'delta_xi': ('velocity component', 'motion', 'velocity', VELOCITY),
    'delta_pi': ('input', 'input', 'effort', WRENCH),
}


def discussion(name: str, summary: Summary) -> list[Sentence]:
    """Step 6: sentences on the energy and the deformation of a run, in this order.

    Parameters
    ----------
    name, summary : of the run, and its `summarize(run)`

    Returns
    -------
    sentences : only those that the numbers carry

    """
    found = [*_energy(name, summary)]
    for kind in DEFORMED:
        found += _deformed(kind, summary)
    return found


def _energy(name: str, summary: Summary) -> Iterator[Sentence]:
    """Where the kinetic energy is."""
    shares = summary['kinetic_energy']['shares_percent']
    if shares is None or not any(shares):
        return
    order = np.argsort(shares)[::-1]
    count = 1 + int(np.argmax(np.cumsum(np.array(shares)[order]) >= MOST))
    count += count == len(order) - 1  # one alone that is left is named as well
    parts = [f'ξ{i + 1} ({DOFS[i]}) has {fixed(shares[i], 2)} %' for i in order[:count]]
    text = f'Of the kinetic energy of {{}} over the whole run, {join(parts)}'
    rest = float(np.array(shares)[order[count:]].sum())
    text += f'; the other {len(order) - count} have {fixed(rest, 2)} % together' if rest else ''
    yield Sentence(Maths(f'{text}.', name), 'table-energy')


def _deformed(kind: str, summary: Summary) -> Iterator[Sentence]:
    """The component that is deformed most, by how much of itself, and by which other."""
    what, cause, metric, units = DEFORMED[kind]
    largest, own = summary['coupling'][f'{kind}_max'], summary[metric]['max']
    least = ROUNDING * max(own)  # below which nothing moves by itself
    ratios = [a / b if b > least else 0.0 for a, b in zip(largest, own, strict=True)]
    i = int(np.argmax(ratios))
    if ratios[i] < SMALL:
        return
    mine = [term for term in summary['coupling_terms'][kind] if term['to'] == DOFS[i]]
    main = max(mine, key=lambda term: term['share_percent'])
    text = f'The {what} of {DOFS[i]} is deformed by up to {number(largest[i])} {units[i // 3]}'
    text += f', where it reaches {number(own[i])} {units[i // 3]} by itself'
    text += f'; the {cause} of {main["from"]} causes {fixed(main["share_percent"], 1)} % of it'
    yield Sentence(f'{text}.', 'table-terms')
