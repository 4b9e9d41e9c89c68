"""The page of a report in a browser: small, in any light, on paper, without scripts, by links."""

import csv

import numpy as np
import pytest
from browser import Watched, pixels

from auv_analysis.report.packing import Packer

CELLS = """(table) => [...table.tBodies[0].rows].map((row) => [...row.cells].map(
  (cell) => cell.dataset.value ?? cell.textContent.replace(/\\s+/g, ' ').trim()))"""
READ = """async ([packed, axis, at]) => {
  document.getElementById('panel-data').textContent = packed;
  const bytes = await inflated('panel-data');
  return [[...times(bytes, axis)], [...values(bytes, at, axis.count)]];
}"""


def test_the_page_is_small_and_its_panels_replace_the_still_figures(report, report_path):
    assert report_path.stat().st_size < 6_000_000
    assert report.panel('error-linear').is_visible()
    still = report.page.locator('#errors_gvc img')
    assert not still.is_visible()
    report.page.locator('details.stills summary').first.click()
    assert still.is_visible()


@pytest.mark.parametrize('how', ['button', 'system'])
def test_dark_pages_have_light_axes(browser, report_path, how):
    report = Watched(browser, report_path, color_scheme='dark' if how == 'system' else 'light')
    report.panel('error-linear')
    button = report.page.get_by_role('button', name='Theme')
    if how == 'button':
        assert report.shown('error-linear')['ink'] == '#1a1a1a'
        button.click()
        button.click()
        assert button.inner_text() == 'Theme: dark'
    assert report.shown('error-linear')['ink'] == '#e4e4e0'
    image = pixels(report.panel('error-linear').locator('.plot'))
    assert np.median(image) < 60
    report.close()


def test_paper_gets_the_still_figures(report):
    report.panel('error-linear')
    report.page.emulate_media(media='print')
    assert not report.page.locator('.panels, .panel-controls').first.is_visible()
    images = report.page.locator('figure img').all()
    assert len(images) > 10
    assert all(image.bounding_box()['height'] > 50 for image in images)
    assert report.page.pdf().count(b'/Subtype /Image') >= len(images)


def test_without_scripts_the_still_figures_are_there(browser, report_path):
    report = Watched(browser, report_path, java_script_enabled=False)
    assert report.page.locator('#errors_gvc img').is_visible()
    assert not report.page.locator('.panel-controls').is_visible()
    report.close()


def test_a_link_opens_what_it_leads_to(browser, report_path):
    report = Watched(browser, report_path, '#errors_cl')
    report.page.wait_for_selector('.with-panels')
    image = report.page.locator('#errors_cl img')
    assert image.is_visible()
    assert 0.0 < report.page.locator('#errors_cl').bounding_box()['y'] < 450.0
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


def _column(table, column: int) -> list[float]:
    cells = table.locator(f'tbody tr > :nth-child({column + 1})')
    return [
        float(value)
        for value in cells.evaluate_all('(cells) => cells.map((cell) => cell.dataset.value)')
    ]


def test_tables_download_what_they_show(report):
    table = report.page.locator('table.data').nth(1)
    with report.page.expect_download() as download:
        table.locator('.csv').click()
    assert download.value.suggested_filename == f'{table.get_attribute("data-name")}.csv'
    with download.value.path().open(newline='', encoding='utf-8') as file:
        rows = list(csv.reader(file))
    shown = table.evaluate(CELLS)
    assert len(rows) == len(shown) + 1
    assert rows[1:] == shown


def test_packed_lines_are_read_as_they_were_written(report):
    t = 3.0 + 0.01 * np.array([0, 1, 5, 70_000, 90_000_000])
    y = np.array([0.0, -1.25, 3.0e-7, 4.0e9, -(2.0**-100)])
    packer = Packer()
    packer.add_values(np.ones(3))
    packer.add_axis(t, 0.01)
    at = packer.add_values(y)
    times, values = report.page.evaluate(READ, [packer.packed(), packer.axes[0], at])
    assert times == pytest.approx(t.tolist(), abs=1e-9)
    assert values == pytest.approx(y.tolist(), rel=2.0**-16)
