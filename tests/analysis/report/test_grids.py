"""Numbers as coloured cells: their scale, their texts and what is marked."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm, to_hex

from auv_analysis.output.text import number, typeset
from auv_analysis.report import plots
from auv_analysis.report.plots import HeatMap, draw_grid, heat_map

pytestmark = pytest.mark.usefixtures('approved')


def texts(grid: HeatMap) -> list[str]:
    axes = plots.new_figure(2.0).subplots()
    draw_grid(axes, grid)
    return [text.get_text() for text in axes.texts]


def test_scale_is_logarithmic_only_where_it_has_to_be() -> None:
    columns = ('a', 'b')
    assert not isinstance(HeatMap(np.array([[1.0, 10.0]]), columns, '').norm(), LogNorm)
    assert not isinstance(HeatMap(np.array([[1.0, 19.5]]), columns, '').norm(), LogNorm)
    assert isinstance(HeatMap(np.array([[0.0, 1.0, 20.5]]), 'abc', '').norm(), LogNorm)
    far = HeatMap(np.array([[1.0, 1e9]]), columns, '').norm()
    assert isinstance(far, LogNorm)
    assert (far.vmin, far.vmax) == pytest.approx((1e5, 1e9)), 'four decades at most'
    assert (HeatMap(np.array([[-1.0, 1e9]]), columns, '').norm().vmin) == -1.0
    assert HeatMap(np.array([[np.nan, 0.0]]), columns, '').norm().vmax == 0.0
    assert HeatMap(np.array([[np.nan]]), ('a',), '').norm().vmax == 1.0


def test_cells_say_zero_and_nothing() -> None:
    grid = HeatMap(np.array([[0.0, np.nan, 1.25e-7]]), 'abc', '')
    assert texts(grid) == ['0', r'$1.2\cdot10^{-7}$']
    rounded = HeatMap(np.array([[-0.04, 2.26, 0.0, -1.0]]), 'abcd', '', decimals=1)
    assert texts(rounded) == ['0.0', '2.3', '0', '−1.0']


def test_names_and_numbers_give_way_where_rows_are_many() -> None:
    many = heat_map([f'run {i}' for i in range(150)], [HeatMap(np.ones((150, 3)), 'abc', 'x')])
    axes = many.axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()][:2] == ['run 0', 'run 3']
    assert len(axes.texts) == 0
    for count, texts in ((60, 60), (61, 0)):
        axes = heat_map([f'{i}' for i in range(count)], [HeatMap(np.ones((count, 1)), 'a', 'x')])
        assert len(axes.axes[0].texts) == texts


@pytest.mark.parametrize('value', [1.5e9, -2.5e-7, 0.25, -12345.0])
def test_numbers_of_figures_have_no_raised_digits(value: float) -> None:
    text = typeset(number(value))
    assert not set(text) & set('⁻⁰¹²³⁴⁵⁶⁷⁸⁹')
    if text.startswith('$'):
        mantissa, power = text.strip('$').replace('}', '').split(r'\cdot10^{')
        assert float(mantissa) * 10.0 ** int(power) == pytest.approx(value)


def _axes(*points: float):
    axes = plots.new_figure(2.0).subplots()
    axes.plot(range(len(points)), points)
    return axes


def test_an_axis_is_logarithmic_where_something_positive_is_to_be_seen() -> None:
    for points, scale in (((1.0, 10.0, 1e7), 'log'), ((-1.0, 10.0, 1e7), 'linear'),
                          ((0.0, 0.0, 0.0), 'linear'), ((1.0, 2.0), 'linear'),
                          ((0.0, 1.0, 2.0), 'log'), ((1.0, np.nan, 1e7), 'log'),
                          ((np.nan,) * 3, 'linear')):  # fmt: skip
        axes = _axes(*points)
        plots.logarithmic(axes, 'y')
        assert (axes.get_xscale(), axes.get_yscale()) == ('linear', scale), points
    axes = _axes(-1.0, 10.0, 1e7)
    axes.plot([0.0, 1.0, 2.0], [1.0, 10.0, 1e7])
    plots.logarithmic(axes, 'y')
    assert axes.get_yscale() == 'log', 'one of them has a place on it'
    text = _logarithmic(1.0, 10.0, 1e7).yaxis.get_major_formatter()
    assert [text(x, 0) for x in (1e-4, 0.01, 1e5)] == ['0.0001', '0.01', '100000']
    assert [text(x, 0) for x in (1e-5, 1e6)] == ['$10^{-5}$', '$10^{6}$']


def _logarithmic(*points: float):
    axes = _axes(*points)
    plots.logarithmic(axes, 'y')
    return axes


def test_a_symmetric_axis_marks_where_it_becomes_logarithmic() -> None:
    axes = _axes(-30.0, 0.0, 5000.0)
    plots.symmetric(axes, 4.0)
    borders = [line.get_ydata()[0] for line in axes.lines[1:]]
    assert borders == [-10.0, 10.0]
    assert axes.get_yscale() == 'symlog'
    assert axes.yaxis.get_transform().linthresh == 10.0
    named = dict(
        zip(axes.get_yticks(), (t.get_text() for t in axes.get_yticklabels()), strict=True)
    )
    assert named == {
        0.0: '0', 10.0: '$10^{1}$', 100.0: '$10^{2}$', 1000.0: '$10^{3}$', -10.0: '$-10^{1}$'
    }  # fmt: skip
    axes = _axes(-100.0, 0.0, 1000.0)
    plots.symmetric(axes, 4.0)
    ends = sorted(axes.get_yticks())
    assert [ends[0], ends[-1]] == [-100.0, 1000.0], 'the ends of the data have their numbers'
    axes = _axes(-1.0, 0.0, 2.0)
    plots.symmetric(axes, 0.2)
    assert axes.yaxis.get_transform().linthresh == 0.1
    axes = _axes(-1.0, 0.0, 1e4)
    plots.symmetric(axes, 1.0)
    assert sorted(axes.get_yticks()) == [-1.0, 0.0, 1.0, 1e2, 1e4], 'every other of five powers'


def test_a_small_bar_has_its_colour_in_the_png() -> None:
    with plots.style():
        figure = plots.new_figure(3.0)
        left, right = figure.subplots(1, 2)
        left.barh(range(6), [9.0, 9.0, 9.0, 0.3, 9.0, 9.0], color=plots.COLOURS)
        values = np.linspace(0.0, 1.0, 120).reshape(10, 12)
        plots.draw_grid(
            right, HeatMap(values, [f'{i}' for i in range(12)], '', 'Blues'), fontsize=4.0
        )
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
    image = plots._few_colours(np.asarray(canvas.buffer_rgba()))
    pixels = np.asarray(image.convert('RGB')).reshape(-1, 3).astype(int)
    assert pixels[1].tolist() == [255, 255, 255]
    for colour in plots.COLOURS:
        wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
        assert np.abs(pixels - wanted).max(axis=1).min() <= 12, colour


def test_as_many_lines_as_a_panel_may_have_are_told_apart() -> None:
    colours = {to_hex(plots.look(i)['color']) for i in range(plots.MOST_LINES)}
    assert len(colours) == plots.MOST_LINES == 8


@pytest.mark.parametrize('location', ['bottom', 'right'])
def test_the_scale_of_far_values_is_told_in_few_numbers_on_either_axis(location: str) -> None:
    figure = plots.new_figure(3.0)
    axes = figure.subplots()
    draw_grid(axes, HeatMap(np.array([[1.0, 40.0]]), 'ab', ''))
    plots.scale_bar(figure, axes.images[0], 'x', ax=axes, location=location)
    bar = figure.axes[1]
    axis = bar.xaxis if location == 'bottom' else bar.yaxis
    figure.draw_without_rendering()
    low, high = axes.images[0].get_clim()
    told = [label.get_text() for label, at in zip(axis.get_ticklabels(), axis.get_ticklocs(),
                                                  strict=True) if low <= at <= high]  # fmt: skip
    assert told == ['1', '2', '5', '10', '20']
