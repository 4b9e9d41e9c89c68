"""The panels as Bokeh models, without data and looks: those are dressed in the browser."""

import math
from collections.abc import Sequence
from typing import Any

from auv_analysis.scenario.fault_words import Mark

HEIGHT = 230  # px
NUMBERS_AT, NUMBERS_APART = 170, 13  # px above the time axis, of the faults
LEFT = 68  # px, so that the time axes of all panels lie above each other
DASHES: tuple[list[int], ...] = (  # px, as in `plotting`
    [],
    [7, 3],
    [2, 2],
    [10, 2, 2, 2],
    [15, 4],
    [5, 2, 2, 2, 2, 2],
)


FAULT = '#e69f00'  # seen through, on light and on dark


def model(lines: int, kind: str, faults: Sequence[Mark] = ()) -> dict[str, Any]:
    """Bokeh's JSON of a panel; panels with as many lines share it.

    Parameters
    ----------
    lines : number of lines; renderer `line <k>` draws the one of number k
    kind : 'line'; 'log', with a logarithmic vertical axis; 'stack', of areas
    faults : that are shaded and numbered

    """
    # loads slowly
    from bokeh.embed import json_item
    from bokeh.models import ColumnDataSource, Range1d
    from bokeh.models.annotations import BoxAnnotation, Label, Span
    from bokeh.plotting import figure

    plot: Any = figure(
        height=HEIGHT,
        sizing_mode='stretch_width',
        x_range=Range1d(start=0.0, end=1.0),
        y_range=Range1d(start=0.1, end=1.0),
        y_axis_type='log' if kind == 'log' else 'linear',
        tools='xpan,xbox_zoom,xwheel_zoom',
        active_drag='xbox_zoom',
        active_scroll=None,
        toolbar_location=None,
        min_border_left=LEFT,
        min_border_right=12,
        lod_threshold=None,
        background_fill_color=None,
        border_fill_color=None,
        outline_line_color=None,
    )
    for k in range(lines):
        look = {'source': ColumnDataSource({'t': [], 'y': [], 'base': []}), 'name': f'line {k}'}
        if kind == 'stack':
            plot.varea('t', 'base', 'y', **look)
        else:
            plot.line('t', 'y', **look)
    for mark in faults:
        level = sum(other.start <= mark.start < other.end for other in faults[: mark.number - 1])
        shade: dict[str, Any] = {
            'left': mark.start,
            'right': None if math.isinf(mark.end) else mark.end,
        }
        plot.add_layout(
            BoxAnnotation(
                **shade, fill_color=FAULT, fill_alpha=0.14, line_color=None, level='underlay'
            )
        )
        plot.add_layout(
            Label(
                x=mark.start, y=NUMBERS_AT - NUMBERS_APART * (level % 4), y_units='screen',
                x_offset=3, text=f'{mark.number}', text_font_size='10px',
            )
        )  # fmt: skip
    cursor = Span(dimension='height', name='cursor', line_dash=[3, 3], line_width=1, visible=False)
    plot.add_layout(cursor)
    plot.xaxis.axis_label = 't (s)'
    for axis in (plot.xaxis, plot.yaxis):
        axis.axis_label_text_font_style = 'normal'
        axis.axis_label_standoff = 4
        axis.minor_tick_line_color = None
    return dict(json_item(plot))
