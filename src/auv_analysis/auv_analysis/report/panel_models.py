"""The panels as Bokeh models, without their data: those come packed, see `packing`."""

from typing import Any

from auv_analysis.report.panels import INK, Panel

HEIGHT = 230  # px
LEFT = 68  # px, so that the time axes of all panels lie above each other
DASHES: tuple[list[int], ...] = (
    [],
    [7, 3],
    [2, 2],
    [10, 2, 2, 2],
    [15, 4],
    [5, 2, 2, 2, 2, 2],
)  # px, as in `plotting`
TEXT = '#1a1a1a'  # where the page says nothing else


def item(panel: Panel, runs: list[str], *, logarithmic: bool) -> dict[str, Any]:
    """Bokeh's JSON of a panel.

    Parameters
    ----------
    panel : what it shows; source `line <k>` and renderer `line <k>` are those of `lines[k]`
    runs : names of all runs, of which each has its dashes
    logarithmic : its vertical axis

    """
    # loads slowly
    from bokeh.embed import json_item
    from bokeh.models import ColumnDataSource, Range1d
    from bokeh.models.annotations import Span
    from bokeh.plotting import figure

    plot: Any = figure(
        name=panel.name,
        height=HEIGHT,
        sizing_mode='stretch_width',
        x_range=Range1d(start=0.0, end=1.0, name='time'),
        y_range=Range1d(start=0.1, end=1.0, name='values'),
        y_axis_type='log' if logarithmic else 'linear',
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
    for k, line in enumerate(panel.lines):
        key = panel.keys[line.key]
        look = {'source': ColumnDataSource({'t': [], 'y': [], 'base': []}), 'name': f'line {k}'}
        if panel.kind == 'stack':
            plot.varea('t', 'base', 'y', fill_color=key.colour, **look)
            continue
        dash = DASHES[runs.index(line.run) % len(DASHES)]
        shown = TEXT if key.colour == INK else key.colour
        plot.line('t', 'y', line_color=shown, line_dash=dash, line_width=key.width, **look)
    cursor = Span(dimension='height', name='cursor', line_dash=[3, 3], line_width=1, visible=False)
    plot.add_layout(cursor)
    label = f'|{panel.label}|' if logarithmic and panel.kind == 'both' else panel.label
    plot.yaxis.axis_label = f'{label} ({panel.unit})'
    plot.xaxis.axis_label = 't (s)'
    for axis in (plot.xaxis, plot.yaxis):
        axis.axis_label_text_font_style = 'normal'
        axis.axis_label_standoff = 4
        axis.minor_tick_line_color = None
    return dict(json_item(plot))
