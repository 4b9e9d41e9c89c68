"""Plots of a sweep: every line, band, bar and cell against the rows that it sums up."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers import artists
from helpers.artists import bands, bars, cells, heat_maps, named, points
from helpers.made_sweeps import (
    DAMPING,
    ENERGY,
    K_D,
    MIXED,
    MORRIS,
    SALTELLI,
    SIMPLE,
    make_sweep,
    mixed,
    rows,
)
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from auv_analysis.metrics.measures import BY_NAME
from auv_analysis.report.plots import new_figure
from auv_analysis.simulation.reduction import COLUMNS
from auv_analysis.studies.sweep import plots, report
from auv_analysis.studies.sweep.analysis import Analysis, analysed
from auv_analysis.studies.sweep.dataset import numbers_of, open_sweep, short_names
from auv_analysis.studies.sweep.plots import draw, main_measures

pytestmark = pytest.mark.usefixtures('approved')

Drawn = tuple[Analysis, dict[str, Figure], dict[str, str]]
NUMBERS = [name for name in COLUMNS if name not in ('status', 'reason')]


def known(controller, values, index):
    """Every column another function of what varies, of another size under each controller."""
    factor = 1.0 if controller == 'gvc' else 2.5
    bent = 4 * (values[DAMPING] - 0.5) ** 2
    made = {
        name: factor * (1 + k) * (values[K_D] + (k % 3) * bent)
        for k, name in enumerate(NUMBERS)
    }  # fmt: skip
    late = np.where(values[K_D] > 2.0, 2 ** (6 * values[K_D]) / factor, np.nan)  # far apart
    return made | {f'velocity_error.settling_time.{dof}': late for dof in ('surge', 'heave')}


def drawn_of(folder: Path, campaign: str, figures, only: str | None = None) -> Drawn:
    """All plots of a campaign, or one of those that there are."""
    analysis = analysed(open_sweep(make_sweep(folder, campaign, figures)))
    save = plots.plots.save_figures

    def save_one(out: Path, drawn):
        return save(out, drawn if only is None else {only: drawn[only]})

    with artists.captured() as found, pytest.MonkeyPatch.context() as patch:
        patch.setattr(plots.plots, 'save_figures', save_one)
        records = draw(analysis, folder / 'figures')
    return analysis, found, {name: record.caption for name, record in records.items()}


@pytest.fixture(scope='module')
def simple(tmp_path_factory) -> Drawn:
    text = SIMPLE.replace('count: 400', 'count: 60')
    return drawn_of(tmp_path_factory.mktemp('simple'), text, known)


@pytest.fixture(scope='module')
def failing(tmp_path_factory) -> Drawn:
    def figures(controller, values, index):
        return mixed(controller, values, index) | {
            'effort.max.surge': np.arange(len(index)) + 1.0 + 10.0 * (controller == 'cl')
        }

    return drawn_of(tmp_path_factory.mktemp('mixed'), MIXED, figures)


def test_distributions_are_those_of_the_rows(simple: Drawn) -> None:
    analysis, figures, _ = simple
    panels = [axes for axes in figures['distributions'].axes if axes.lines]
    assert len(panels) == len(analysis.measures) > 10
    controllers = analysis.sweep.table(['controller'])['controller'].to_numpy()
    for k, (axes, measure) in enumerate(zip(panels, analysis.measures, strict=True)):
        assert axes.get_title(loc='left') == measure.label
        assert axes.get_xlabel() == measure.unit
        assert axes.get_ylabel() == ('' if k % 4 else 'share of rows')
        shown = named(axes, figures['distributions'].legends[0])
        assert list(shown) == ['gvc', 'cl']
        table = analysis.sweep.table(list(measure.columns))
        every = measure.of(lambda name, table=table: numbers_of(table, name))
        for name, ((x, share),) in shown.items():
            values = every[controllers == name]
            late = np.where(np.isnan(values), np.inf, values)
            assert share == pytest.approx([np.mean(late <= at) for at in x], abs=1.5 / len(late))
            assert x[-1] == pytest.approx(np.nanmax(values))
        apart = np.nanmax(analysis.values[measure.name]) > 30 * np.nanmin(
            analysis.values[measure.name]
        )
        assert axes.get_xscale() == ('log' if apart else 'linear')


def test_what_matters_stands_in_its_row_and_column(simple: Drawn) -> None:
    analysis, figures, _ = simple
    maps = heat_maps(figures['influence'])
    assert list(maps) == ['gvc: explained (%)', 'cl: explained (%)']
    short = short_names(analysis.factors)
    for label, found in maps.items():
        controller = label.partition(':')[0]
        for (measure, path), value in found.items():
            (name,) = [m.name for m in analysis.measures if m.label == measure]
            (whole,) = [p for p, s in short.items() if s == path]
            mine = rows(analysis, 'influence', controller=controller, figure=name, path=whole)
            expected = mine[0]['explained_percent'] if mine else np.nan
            assert value == pytest.approx(expected, nan_ok=True)
    shares = {}
    for row in analysis.tables['influence']:
        shares.setdefault(row['path'], []).append(row['explained_percent'])
    order = sorted(shares, key=lambda path: -np.mean(shares[path]))
    first = [path for _, path in next(iter(maps.values()))][: len(order)]
    assert first == [short[path] for path in order]


def test_of_many_controllers_three_stand_side_by_side(simple: Drawn) -> None:
    many = SimpleNamespace(controllers=['gvc', 'cl', 'gvc', 'pid'])
    figure, _, caption = plots._influence(replace(simple[0], sweep=many))
    assert sum(len(axes.images) for axes in figure.axes) == 3
    assert caption.endswith(' pid: in influence.parquet.')


def test_of_many_paths_the_six_that_matter_most_are_drawn(monkeypatch, tmp_path: Path) -> None:
    monkeypatch.setattr(plots.plots, 'save_figures', lambda _, drawn: drawn)
    empty = dict.fromkeys(('influence', 'together', 'failures', 'indices'), ())
    many = SimpleNamespace(measures=[], tables=empty | {'dependence': [{}]},
                           most_influential=lambda: [*'abcdefgh'])  # fmt: skip
    drawn = draw(many, tmp_path)
    assert list(drawn) == [f'dependence_{i}' for i in range(1, 7)]
    assert [one.args[1] for one in drawn.values()] == [*'abcdef']


def test_of_many_rows_some_from_all_over_are_drawn(simple: Drawn, monkeypatch) -> None:
    analysis, *_ = simple
    (factor,) = (f for f in analysis.factors if f.path == DAMPING)
    monkeypatch.setattr(plots, 'SAMPLE', 7)
    figure, _, caption = plots._dependence(analysis, factor, main_measures(analysis)[:1])
    dots = [points(x) for x in artists.lines(figure.axes[0]) if x.get_linestyle() == 'None']
    for controller, (x, _) in zip(('gvc', 'cl'), dots, strict=True):
        mine = analysis.sweep.finished[controller]
        assert np.array_equal(x, factor.numbers[mine[: 7 * (len(mine) // 7) : len(mine) // 7]])
    assert caption.endswith(' Points: at most 7 rows of each controller.')


def test_dependence_shows_the_quantiles_along_its_path(simple: Drawn) -> None:
    analysis, figures, captions = simple
    factors = {f.path: f for f in analysis.factors}
    seen, apart = set(), set()
    for name in (name for name in figures if name.startswith('dependence')):
        figure, path = figures[name], captions[name].split(' on ')[1].split(' ', 1)[0].rstrip(':')
        seen.add(path)
        short = short_names(analysis.factors)[path]
        assert figure.get_supxlabel().startswith(short)
        panels = [axes for axes in figure.axes if axes.lines]
        chosen = main_measures(analysis)
        assert len(panels) == len(chosen) == 6
        for axes, measure in zip(panels, chosen, strict=True):
            assert axes.get_title(loc='left') == measure.label
            assert axes.get_ylabel() == measure.unit
            shown = axes.dataLim.intervaly
            apart.add(shown[1] > 30 * shown[0])
            assert axes.get_yscale() == ('log' if shown[1] > 30 * shown[0] else 'linear')
            wide = path in (DAMPING, 'controllers.cl.k_I')
            assert axes.get_xscale() == ('log' if wide else 'linear')
            controllers = ['cl'] if path == 'controllers.cl.k_I' else ['gvc', 'cl']
            for k, controller in enumerate(controllers):
                mine = rows(
                    analysis, 'dependence', controller=controller, path=path, figure=measure.name
                )
                wanted = {
                    key: np.array([np.nan if r[key] is None else r[key] for r in mine], float)
                    for key in ('middle', 'low', 'quarter', 'median', 'three_quarters', 'high')
                }
                if factors[path].binned:
                    _banded(axes, figure, controller, k, wanted)
                    dots = [points(x) for x in artists.lines(axes) if x.get_linestyle() == 'None']
                    x, y = dots[k]
                    rows_ = analysis.sweep.finished[controller]
                    assert np.array_equal(x, factors[path].numbers[rows_])
                    assert np.array_equal(y, analysis.values[measure.name][rows_], equal_nan=True)
                else:
                    _barred(axes, k, wanted, len(controllers))
                    assert [t.get_text() for t in axes.get_xticklabels()] == ['ode5', 'rk4']
            assert [t.get_text() for t in figure.legends[0].get_texts()] == controllers
    assert seen == {K_D, DAMPING, 'controllers.cl.k_I', 'integrator'}
    assert apart == {False, True}


def _banded(axes, figure, controller: str, k: int, wanted) -> None:
    (median,) = (
        named(axes, figure.legends[0])[controller]
        if len(figure.legends[0].get_texts()) > 1
        else [points(x) for x in artists.lines(axes) if x.get_linestyle() != 'None']
    )
    assert median[0] == pytest.approx(wanted['middle'])
    assert median[1] == pytest.approx(wanted['median'], nan_ok=True)
    for band, (low, high) in zip(
        bands(axes)[2 * k : 2 * k + 2],
        (('low', 'high'), ('quarter', 'three_quarters')),
        strict=True,
    ):
        _, x, lower, upper = band
        there = np.isfinite(wanted[low]) & np.isfinite(wanted[high])
        assert x == pytest.approx(wanted['middle'][there])
        assert lower == pytest.approx(wanted[low][there])
        assert upper == pytest.approx(wanted[high][there])


def _barred(axes, k: int, wanted, count: int) -> None:
    thin, thick = axes.collections[2 * k : 2 * k + 2]
    place = np.arange(2) + 0.6 * ((k + 0.5) / count - 0.5)
    for lines, (low, high) in ((thin, ('low', 'high')), (thick, ('quarter', 'three_quarters'))):
        for j, segment in enumerate(lines.get_segments()):
            ends = (wanted[low][j], wanted[high][j])
            if np.isnan(ends).any():
                assert not len(segment)
                continue
            assert segment[:, 0] == pytest.approx(place[j])
            assert segment[:, 1] == pytest.approx(ends)
    assert thin.get_linewidth()[0] < thick.get_linewidth()[0]
    x, y = points(axes.lines[k])
    assert x == pytest.approx(place)
    assert y == pytest.approx(wanted['median'], nan_ok=True)


def test_the_two_paths_that_matter_most_stand_in_their_cells(simple: Drawn) -> None:
    analysis, figures, captions = simple
    first, second = analysis.pair
    short = short_names(analysis.factors)
    panels = [axes for axes in figures['together'].axes if axes.images]
    wanted = [(m, c) for m in main_measures(analysis)[:2] for c in ('gvc', 'cl')]
    assert len(panels) == len(wanted)
    for axes, (measure, controller) in zip(panels, wanted, strict=True):
        assert axes.get_title(loc='left') == f'{controller}: {measure.label}'
        assert (axes.get_ylabel(), axes.get_xlabel()) == (short[first.path], short[second.path])
        assert axes.images[0].colorbar.ax.get_ylabel() == measure.unit
        for (down, across), value in cells(axes).items():
            (row,) = [
                r for r in rows(analysis, 'together', controller=controller, figure=measure.name)
                if (r['value'], r['other_value']) == (down, across)
            ]  # fmt: skip
            expected = np.nan if row['median'] is None else row['median']
            assert value == pytest.approx(expected, nan_ok=True)
    assert f'each combination of {first.path} and {second.path}' in captions['together']
    many = [row | {'controller': f'{row["controller"]}{k}'}
            for k in (1, 2) for row in analysis.tables['together']]  # fmt: skip
    tables = analysis.tables | {'together': many}
    figure = plots._together(replace(analysis, tables=tables), main_measures(analysis)[:1])[0]
    heads = [axes.get_title(loc='left') for axes in figure.axes if axes.images]
    assert [head.partition(':')[0] for head in heads] == ['gvc1', 'cl1', 'gvc2']


def test_failures_are_the_shares_of_their_rows(failing: Drawn) -> None:
    analysis, figures, _ = failing
    figure = figures['failures']
    table = analysis.sweep.table(['controller', 'status', *analysis.sweep.paths]).to_pylist()
    short = short_names(analysis.factors)
    panels = [axes for axes in figure.axes if axes.patches]
    assert len(panels) == 3
    for axes in panels:
        (path,) = [p for p, s in short.items() if s == axes.get_title(loc='left')]
        assert axes.get_ylabel() == 'rows (%)'
        (factor,) = [f for f in analysis.factors if f.path == path]
        labels = [text.get_text() for text in axes.get_xticklabels()]
        found = bars(axes, figure.legends[0])
        values = list(dict.fromkeys(str(row[path]) for row in table))
        assert len(labels) == len(values) == len(factor.labels)
        for j, value in enumerate(
            sorted(
                values, key=lambda v: factor.labels.index(v.replace('-', '−').removesuffix('.0'))
            )
        ):
            mine = [
                row['status'] for row in table
                if str(row[path]) == value
                and ('gvc' not in path or row['controller'] == 'gvc')
            ]  # fmt: skip
            lost, refused = (100 * mine.count(w) / len(mine) for w in ('diverged', 'refused'))
            assert found['diverged'][j] == pytest.approx((j, 0.0, lost))
            assert found['refused'][j] == pytest.approx((j, lost, lost + refused))


def test_elementary_effects_stand_at_their_places(tmp_path: Path) -> None:
    analysis, figures, _ = drawn_of(tmp_path, MORRIS, known, 'elementary_effects')
    figure = figures['elementary_effects']
    assert figure.get_supxlabel().startswith(r'$\mu^*$')
    assert figure.get_supylabel().startswith(r'$\sigma$')
    key = dict(zip((t.get_text() for t in figure.legends[0].get_texts()),
                   figure.legends[0].legend_handles, strict=True))  # fmt: skip
    short = short_names(analysis.factors)
    shown = [m for m in main_measures(analysis) if rows(analysis, 'indices', figure=m.name)]
    panels = [axes for axes in figure.axes if axes.lines]
    for axes, measure in zip(panels, shown, strict=True):
        assert axes.get_title(loc='left') == f'{measure.label} ({measure.unit})'
        dots = [line for line in artists.lines(axes) if len(line.get_xdata()) == 1]
        mine = rows(analysis, 'indices', figure=measure.name)
        assert len(dots) == len(mine) == 4
        for row in mine:
            (dot,) = [
                d for d in dots
                if d.get_color() == key[short[row['path']]].get_color()
                and d.get_marker() == key[row['controller']].get_marker()
            ]  # fmt: skip
            assert [v[0] for v in points(dot)] == pytest.approx([row['mu_star'], row['sigma']])
        (ends,) = [points(x) for x in artists.lines(axes) if len(x.get_xdata()) == 2]
        assert np.array_equal(ends[0], ends[1])
        assert ends[0][1] == pytest.approx(1.1 * max(row['mu_star'] for row in mine))
    alone = replace(analysis, tables=analysis.tables | {
        'indices': [row for row in analysis.tables['indices'] if row['controller'] == 'gvc']
    })  # fmt: skip
    figure = plots._effects(alone, [*shown, replace(shown[0], name='absent')])[0]
    assert len([axes for axes in figure.axes if axes.axison]) == len(shown)
    legend = figure.legends[0]
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts == [short[path] for path in (K_D, DAMPING)], 'one controller needs no name'


def test_total_indices_stand_in_their_cells(tmp_path: Path) -> None:
    def some(*of):
        shown = (ENERGY, 'effort.rms.surge', 'effort.rms.roll', 'effort.max.roll')
        return {name: column for name, column in known(*of).items() if name in shown}

    analysis, figures, captions = drawn_of(tmp_path, SALTELLI, some, 'total_indices')
    maps = heat_maps(figures['total_indices'])
    assert list(maps) == ['(a) $S_T$', '(b) $S_T$']
    assert '(a) gvc; (b) cl' in captions['total_indices']
    short = short_names(analysis.factors)
    for controller, found in zip(('gvc', 'cl'), maps.values(), strict=True):
        for (label, path), value in found.items():
            (row,) = [
                r for r in rows(analysis, 'indices', controller=controller, **{'with': None})
                if BY_NAME[r['figure']].label == label and short[r['path']] == path
            ]  # fmt: skip
            assert value == pytest.approx(row['ST'])
    for cases, said in ((2, ''), (3, ' The first 4 of 6 cases; all are in indices.parquet.')):
        many = [row | {'case': f'{k}'} for k in range(cases) for row in analysis.tables['indices']]
        told = plots._total_indices(replace(analysis, tables=analysis.tables | {'indices': many}))
        assert told[2].endswith(f'(d) cl, 1.{said}')


def test_measures_of_errors_and_settling_are_drawn_first(simple: Drawn) -> None:
    names = [m.name for m in main_measures(simple[0])]
    assert names == [
        'overall.velocity_error.settling_time', 'overall.velocity_error.rms.linear',
        'overall.velocity_error.rms.angular', ENERGY, 'overall.effort.rms.linear',
        'overall.coupling.delta_xi_max.angular',
    ]  # fmt: skip


def test_no_plot_is_without_an_oracle(simple: Drawn, failing: Drawn) -> None:
    checked = {'distributions', 'influence', 'together', 'failures'}
    checked |= {f'dependence_{i}' for i in (1, 2, 3, 4)}
    assert set(simple[1]) | set(failing[1]) == checked


def test_what_does_not_vary_is_said(failing: Drawn) -> None:
    caption = failing[2]['distributions']
    assert 'The same in every row:' in caption
    assert 'RMS error, linear' in caption


def test_measures_that_are_alike_in_all_rows_are_named_by_their_kind() -> None:
    (zero, none, same), labels = list(BY_NAME)[:3], [one.label for one in BY_NAME.values()]
    assert plots._fixed({zero: 0.0, none: None, same: 2.0}) == (
        f' Zero in every row and not drawn: {labels[0]}. The same in every row: {labels[2]}.'
        f' Without a value in any row: {labels[1]}.'
    )
    assert plots._fixed({}) == ''


@pytest.mark.parametrize(
    ('words', 'angle'), [(('a' * 10, 'b' * 10), 0), (('a' * 10, 'b' * 11), 60)]
)
def test_words_below_an_axis_are_turned_where_they_are_long(words, angle: int) -> None:
    axes = new_figure(2.0).subplots()
    axes.plot([0, 1], [1.0, 2.0])
    factor = SimpleNamespace(binned=False, numbers=None, labels=words)
    plots._finish(axes, factor, next(iter(BY_NAME.values())))
    assert artists.angles(axes) == {angle}


@pytest.mark.parametrize(('count', 'angle'), [(4, 0), (5, 60)])
def test_values_across_are_turned_where_they_are_many(count: int, angle: int) -> None:
    axes = new_figure(2.0).subplots()
    cells = [{'value': 'a', 'other_value': f'{i}', 'median': 1.0 + i} for i in range(count)]
    plots._one_pair(axes, cells, 'label', Normalize(0.0, 9.0))
    assert artists.angles(axes) == {angle}


def test_a_campaign_that_is_gone_is_not_listed(tmp_path: Path) -> None:
    assert report._listings(tmp_path) == []
    (tmp_path / 'campaign.yaml').write_text('name: x')
    assert report._listings(tmp_path) == [('campaign.yaml', 'name: x')]


@pytest.mark.parametrize(
    ('values', 'scale'),
    [((1.0, 29.5), 'linear'), ((1.0, 30.5), 'log'), ((0.0, 99.0), 'linear'),
     ((-1.0, 99.0), 'linear'), ((), 'linear'), ((1.0, np.nan, 40.0), 'log')],
)  # fmt: skip
def test_values_far_apart_have_a_logarithmic_axis(values, scale: str) -> None:
    axes = new_figure(2.0).subplots()
    plots._logarithmic(axes, 'x', np.array(values))
    assert axes.get_xscale() == scale


@pytest.mark.parametrize(('count', 'angle'), [(2, 0), (3, 90)])
def test_paths_above_columns_are_turned_where_they_are_more_than_two(count: int, angle) -> None:
    grid = plots.HeatMap(np.ones((1, count)), ['path'] * count, 'x')
    figure = plots.heat_map(['row'], [grid])
    plots._small_heads(figure, [grid])
    assert artists.angles(figure.axes[0]) == {angle}


def test_notes_stand_behind_what_was_swept(simple: Drawn, monkeypatch, tmp_path: Path) -> None:
    told: list = []
    monkeypatch.setattr(report, 'write_document', lambda *of: told.extend(of))
    report.write_report(tmp_path, replace(simple[0], notes=['odd', 'even']), {})
    _, _, _, sentences, sections, _ = told
    blocks = sections[0].blocks
    assert [getattr(one, 'name', one) for one in blocks] == ['paths', 'counts', 'odd', 'even']
    assert [one.text for one in sentences][-2:] == ['Odd.', 'Even.']
