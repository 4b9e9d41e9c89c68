"""The panels of a report in a browser: every control does what it says."""

import numpy as np
import pytest
from helpers.browser import coloured, pixels

from auv_analysis.report.plots import COLOURS

PANELS = ('error-linear', 'error-angular', 'tau-linear')


def test_a_panel_shows_the_colours_of_its_degrees_of_freedom_until_they_are_switched_off(report):
    plot = report.panel('error-linear').locator('.plot')
    before = pixels(plot)
    assert all(coloured(before, colour) > 20 for colour in COLOURS[::2][:2])
    assert len(report.shown('tau-linear')['lines']) == 6
    report.page.get_by_role('checkbox', name='heave').click()
    for name in ('error-linear', 'tau-linear'):
        assert report.shown(name)['lines'] == ['gvc surge', 'gvc sway', 'cl surge', 'cl sway']
    assert len(report.shown('error-angular')['lines']) == 6
    report.page.get_by_role('checkbox', name='heave').click()
    assert len(report.shown('tau-linear')['lines']) == 6


def test_a_controller_is_switched_off_in_all_panels(report):
    switch = report.page.locator('.panel-controls').get_by_role('checkbox', name='gvc')
    switch.click()
    assert {line.split()[0] for line in report.shown('error-linear')['lines']} == {'cl'}
    assert {line.split()[0] for line in report.shown('kinetic')['lines']} == {'cl'}
    switch.click()
    assert {line.split()[0] for line in report.shown('kinetic')['lines']} == {'cl', 'gvc'}


def test_panels_share_one_time_axis(report):
    plot = report.panel('error-linear').locator('.plot')
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    row = box['y'] + 110
    windows = [[0.0, 5.0]]
    for _ in range(3):  # a busy page may miss the beginning of a drag
        report.page.mouse.move(box['x'] + 150, row)
        report.page.mouse.down()
        report.page.mouse.move(box['x'] + 300, row, steps=4)
        report.page.mouse.up()
        report.settle()
        windows = [report.shown(name)['window'] for name in PANELS]
        if windows[0] != [0.0, 5.0]:
            break
    assert windows[0] == windows[1] == windows[2]
    start, end = windows[0]
    assert 0.0 < start < end < 5.0
    report.page.get_by_role('button', name='after 2 s', exact=True).click()
    assert report.shown('error-angular')['window'] == [2.0, 5.0]
    report.page.get_by_role('button', name='whole run').click()
    assert report.shown('tau-linear')['window'] == [0.0, 5.0]


def test_values_are_shown_at_the_time_pointed_at(report):
    plot = report.panel('error-linear').locator('.plot')
    plot.hover(position={'x': 250, 'y': 110})
    tooltip = report.page.locator('.bk-tooltip-row-value, [class*="tooltip"]').first
    tooltip.wait_for(state='attached')


BEFORE_ALL = """() => {
  const start = document.createElement('a');
  start.tabIndex = -1;
  document.body.prepend(start);
  start.focus();  // wherever the test before has pointed
  start.remove();
}"""


def test_every_control_is_reached_by_the_tabulator(report):
    reached = set()
    report.page.evaluate(BEFORE_ALL)
    for _ in range(40):
        report.page.keyboard.press('Tab')
        reached.add(report.page.evaluate('document.activeElement.value || ""'))
    assert {'surge', 'yaw', 'gvc', 'cl'} <= reached


@pytest.mark.parametrize('theme', ['light', 'dark'])
def test_still_figures_have_the_ground_of_the_page(report, theme):
    report.page.emulate_media(color_scheme=theme)
    report.page.wait_for_selector(f'[data-theme="{theme}"]')
    image = pixels(report.page.locator('#settling img'))
    report.page.emulate_media(color_scheme='light')
    assert (np.median(image) > 200) == (theme == 'light')
