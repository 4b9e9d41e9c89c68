"""The page of a report in a browser: small, in any light, on paper, without scripts, by links."""

import csv

import numpy as np
import pytest
from helpers.browser import Watched, pixels

CELLS = """(table) => [...table.tBodies[0].rows].map((row) => [...row.cells].map(
  (cell) => cell.dataset.value ?? cell.textContent.replace(/\\s+/g, ' ').trim()))"""
FOLD = "document.querySelectorAll('details.stills').forEach((one) => { one.open = false; })"


def test_the_page_is_small_and_its_panels_replace_the_still_figures(report, report_path):
    assert report_path.stat().st_size < 6_000_000
    assert report.panel('error-linear').is_visible()
    still = report.page.locator('#errors_gvc img')
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


@pytest.mark.parametrize('theme', ['light', 'dark'])
def test_a_narrow_page_does_not_scroll_sideways(report, theme):
    usual = report.page.viewport_size
    report.page.emulate_media(color_scheme=theme)
    report.page.set_viewport_size({'width': 390, 'height': 844})
    report.panel('error-linear')
    report.page.wait_for_selector(f'[data-theme="{theme}"]')
    wide = report.page.evaluate('document.documentElement.scrollWidth')
    report.page.set_viewport_size(usual)
    report.page.emulate_media(color_scheme='light')
    assert wide <= 390


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
    assert report.page.locator('#errors_gvc img').is_visible()
    assert not report.page.locator('.panel-controls').is_visible()
    report.close()


def test_a_link_opens_what_it_leads_to_and_dark_systems_have_dark_panels(browser, report_path):
    report = Watched(browser, report_path, '#errors_cl', color_scheme='dark')
    report.page.wait_for_selector('.with-panels')
    image = report.page.locator('#errors_cl img')
    assert image.is_visible()
    assert 0.0 < report.page.locator('#errors_cl').bounding_box()['y'] < 450.0
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
