"""A report in a browser: every control does what it says; in any light, on paper, by links."""

import csv

import numpy as np
import pytest
from helpers.browser import Watched, coloured, pixels

from auv_analysis.output.text import MISSING
from auv_analysis.report.plots import COLOURS

PANELS = ('error-linear', 'error-angular', 'tau-linear')
CELLS = """(table) => [...table.tBodies[0].rows].map((row) => [...row.cells].map(
  (cell) => cell.dataset.value ?? cell.textContent.replace(/\\s+/g, ' ').trim()))"""
FOLD = "document.querySelectorAll('details.stills').forEach((one) => { one.open = false; })"


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
    report.page.get_by_role('button', name='first 2 s', exact=True).click()
    assert report.shown('error-angular')['window'] == [0.0, 2.0]
    report.page.get_by_role('button', name='whole run').click()
    assert report.shown('tau-linear')['window'] == [0.0, 5.0]


def test_values_are_shown_at_the_time_pointed_at(report):
    plot = report.panel('error-linear').locator('.plot')
    tooltip = report.page.locator('.bk-tooltip-row-value, [class*="tooltip"]')
    for x in range(250, 270):  # a busy page may miss it, as the beginning of a drag
        plot.hover(position={'x': x, 'y': 110})
        report.settle()
        if tooltip.count():
            break
    tooltip.first.wait_for(state='attached')


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
    image = pixels(report.page.locator('#figure-settling img'))
    report.page.emulate_media(color_scheme='light')
    assert (np.median(image) > 200) == (theme == 'light')


def test_the_page_is_small_and_its_panels_replace_the_still_figures(report, report_path):
    assert report_path.stat().st_size < 6_000_000
    assert report.panel('error-linear').is_visible()
    still = report.page.locator('#figure-errors_gvc img')
    assert not still.is_visible()
    report.page.locator('details.stills summary').first.click()
    assert still.is_visible()
    report.page.locator('details.stills summary').first.click()
    assert not still.is_visible()


def test_the_button_makes_panels_dark(report):
    panel = report.panel('error-linear')
    button = report.page.get_by_role('button', name='Theme')
    assert np.median(pixels(panel)) > 200
    button.click()
    button.click()
    assert button.inner_text() == 'Theme: dark'
    report.settle()
    assert np.median(pixels(panel)) < 60
    button.click()
    assert button.inner_text() == 'Theme: auto'


def test_a_narrow_page_does_not_scroll_sideways(report):
    usual = report.page.viewport_size
    report.page.set_viewport_size({'width': 390, 'height': 844})
    report.panel('error-linear')
    # once the panels are laid out anew
    report.page.wait_for_function('document.documentElement.scrollWidth <= 390')
    report.page.set_viewport_size(usual)


def test_a_wide_table_scrolls_without_its_page(report):
    table = report.page.locator('.tabled table').first
    table.evaluate("(one) => { one.style.minWidth = '3000px'; }")
    across = report.page.viewport_size['width']
    assert report.page.evaluate('document.documentElement.scrollWidth') <= across
    assert table.bounding_box()['width'] >= 3000
    table.evaluate("(one) => { one.style.minWidth = ''; }")


def test_paper_gets_the_still_figures(report):
    report.panel('error-linear')
    report.page.emulate_media(media='print')
    assert not report.page.locator('.panels, .panel-controls').first.is_visible()
    images = report.page.locator('figure img').all()
    assert len(images) > 10
    assert all(image.bounding_box()['height'] > 50 for image in images)
    assert report.page.pdf().count(b'/Subtype /Image') >= len(images)
    report.page.emulate_media(media='screen')
    report.page.evaluate(FOLD)  # printing has opened them


def test_without_scripts_the_still_figures_are_there(browser, report_path):
    report = Watched(browser, report_path, java_script_enabled=False)
    assert report.page.locator('#figure-errors_gvc img').is_visible()
    assert not report.page.locator('.panel-controls').is_visible()
    report.close()


def test_a_link_opens_what_it_leads_to_and_dark_systems_have_dark_panels(browser, report_path):
    report = Watched(browser, report_path, '#figure-errors_cl', color_scheme='dark')
    report.page.wait_for_selector('.with-panels')
    image = report.page.locator('#figure-errors_cl img')
    assert image.is_visible()
    assert 0.0 < report.page.locator('#figure-errors_cl').bounding_box()['y'] < 450.0
    assert np.median(pixels(report.panel('error-linear'))) < 60
    report.close()


def test_tables_sort_by_mouse_and_by_key(report):
    table = report.page.locator(
        'table.data', has=report.page.get_by_role('button', name='RMS')
    ).first
    head = table.locator('.sort').last
    column = head.evaluate('(button) => button.parentElement.cellIndex')
    before = _column(table, column)
    head.click()
    assert _column(table, column) == sorted(before)
    head.press('Enter')
    assert _column(table, column) == sorted(before, reverse=True)
    assert head.locator('..').get_attribute('aria-sort') == 'descending'


def test_what_is_missing_is_last_however_a_table_is_sorted(report):
    table = report.page.locator('table.data[data-name="key_figures"]')
    head = table.get_by_role('button', name='settled').first
    column = head.evaluate('(button) => button.parentElement.cellIndex')
    for _ in range(2):
        head.click()
        cells = table.locator(f'tbody tr > :nth-child({column + 1})').all_text_contents()
        known = [MISSING not in cell for cell in cells]
        assert known == sorted(known, reverse=True)
        assert 0 < sum(known) < len(known)


GOOD_AND_BAD = """(names) => names.map((name) => {
  const shown = document.createElement(name.startsWith('badge') ? 'span' : 'td');
  shown.className = name;
  document.body.append(shown);
  const colour = getComputedStyle(shown).color.match(/[0-9.]+/g).map(Number);
  shown.remove();
  return colour;
})"""


def test_good_is_green_and_bad_is_red(report):
    names = ['good', 'bad', 'badge reproduced', 'badge not-reproduced']
    for i, (red, green, *_) in enumerate(report.page.evaluate(GOOD_AND_BAD, names)):
        assert (green > red) == (i % 2 == 0), names[i]


def _column(table, column: int) -> list[float]:
    cells = table.locator(f'tbody tr > :nth-child({column + 1})')
    return [
        float(value)
        for value in cells.evaluate_all('(cells) => cells.map((cell) => cell.dataset.value)')
    ]


def test_tables_download_what_they_show(report):
    table = report.page.locator('table.data[data-name="key_figures"]')
    with report.page.expect_download() as download:
        table.locator('.csv').click()
    assert download.value.suggested_filename == f'{table.get_attribute("data-name")}.csv'
    with download.value.path().open(newline='', encoding='utf-8') as file:
        rows = list(csv.reader(file))
    shown = table.evaluate(CELLS)
    assert len(rows) == len(shown) + 1
    assert rows[1:] == shown
    assert any(len(value) > 8 for value in shown[0]), 'all digits'
    assert [rows[0][i] for i in (2, -1)] == ['velocity error RMS', 'input τ max']
