"""The report in a browser: it needs nothing but itself, and every control does what it says."""

from collections.abc import Iterator
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from browser import Watched, chromium, coloured, pixels
from PIL import Image

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.report import plotting
from auv_analysis.report.page import write_report
from auv_analysis.report.plotting import COLOURS
from auv_analysis.run import Run
from auv_dynamics.signals import DOFS

SUPERSCRIPTS = str.maketrans('⁻⁰¹²³⁴⁵⁶⁷⁸⁹', '-0123456789')
PANELS = ('error-linear', 'error-angular', 'tau-linear')


@pytest.fixture(scope='module')
def browser() -> Iterator:
    with chromium() as found:
        yield found


@pytest.fixture(scope='module')
def runs() -> dict[str, Run]:
    scenario = load_scenario('case1')
    found = {name: simulate(scenario, name) for name in scenario.controllers}
    return {name: run.part(run.t <= 5.0) for name, run in found.items()}


@pytest.fixture(scope='module')
def path(browser, runs, tmp_path_factory) -> Path:
    """Of a report whose still figures are composed but not rendered: that takes long."""

    heights = count()  # the same image twice would be one in a PDF

    def save(figure, folder, name):
        png, pdf = folder / f'{name}.png', folder / f'{name}.pdf'
        Image.new('RGB', (720, 300 + next(heights)), 'white').save(png)
        return png, pdf

    out = tmp_path_factory.mktemp('report')
    summaries = {name: summarize(run) for name, run in runs.items()}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plotting, 'save', save)
        return write_report(out, runs, summaries, 'a: 1', 'b: 2')


@pytest.fixture
def report(browser, path) -> Iterator[Watched]:
    watched = Watched(browser, path)
    watched.page.wait_for_selector('.with-panels')
    yield watched
    watched.close()


def test_the_page_is_small_and_its_panels_replace_the_still_figures(report, path):
    assert path.stat().st_size < 6_000_000
    assert report.panel('error-linear').is_visible()
    still = report.page.locator('#errors_gvc img')
    assert not still.is_visible()
    report.page.locator('details.stills summary').first.click()
    assert still.is_visible()


def test_a_panel_shows_the_colours_of_its_degrees_of_freedom_until_they_are_switched_off(report):
    for name in PANELS:
        report.panel(name)
    plot = report.panel('error-linear').locator('.plot')
    before = pixels(plot)
    assert all(coloured(before, colour) > 20 for colour in COLOURS[::2][:2])
    assert len(report.shown('tau-linear')['lines']) == 6
    report.page.get_by_role('checkbox', name='heave').click()
    for name in ('error-linear', 'tau-linear'):
        assert report.shown(name)['lines'] == ['line 0', 'line 1', 'line 3', 'line 4']
    assert len(report.shown('error-angular')['lines']) == 6
    after = pixels(report.panel('error-linear').locator('.plot'))
    assert coloured(after, COLOURS[2]) == 0
    assert coloured(after, COLOURS[0]) > 20


def test_a_controller_is_switched_off_in_all_panels(report):
    report.panel('error-linear')
    report.panel('kinetic')
    report.page.locator('.panel-controls').get_by_role('checkbox', name='gvc').click()
    assert report.shown('error-linear')['lines'] == ['line 3', 'line 4', 'line 5']
    assert report.shown('kinetic')['lines'] == ['line 2', 'line 3']


def test_panels_share_one_time_axis(report):
    for name in PANELS:
        report.panel(name)
    plot = report.panel('error-linear').locator('.plot').bounding_box()
    row = plot['y'] + 80
    report.page.mouse.move(plot['x'] + 300, row)
    report.page.mouse.down()
    report.page.mouse.move(plot['x'] + 500, row, steps=4)
    report.page.mouse.up()
    windows = [report.shown(name)['window'] for name in PANELS]
    assert windows[0] == windows[1] == windows[2]
    start, end = windows[0]
    assert 0.0 < start < end < 5.0
    assert float(report.page.locator('[name=from]').input_value()) == pytest.approx(start, rel=1e-5)
    report.page.locator('[name=to]').fill('3.5')
    report.page.locator('[name=to]').press('Enter')
    assert report.shown('tau-linear')['window'] == pytest.approx([start, 3.5], abs=1e-4)
    report.page.get_by_role('button', name='after 2 s').click()
    assert report.shown('error-angular')['window'] == [2.0, 5.0]


def test_the_vertical_axis_fits_what_is_shown(report, runs):
    report.panel('error-linear')
    report.page.get_by_role('button', name='after 2 s').click()
    late = [run.part(run.t >= 2.0) for run in runs.values()]
    errors = np.concatenate([(run.nu_d - run.nu)[:, :3] for run in late])
    low, high = report.shown('error-linear')['values']
    margin = 0.06 * (errors.max() - errors.min())
    assert errors.min() - margin < low < errors.min()
    assert errors.max() < high < errors.max() + margin


def test_values_are_those_of_the_sample_pointed_at(report, runs):
    report.panel('error-angular')
    panel = report.panel('error-linear')
    panel.locator('.plot').hover(position={'x': 420, 'y': 100})
    time = report.shown('error-linear')['cursor']
    assert report.shown('error-angular')['cursor'] == time
    for row, run in zip(panel.locator('tbody tr').all(), runs.values(), strict=True):
        sample = int(np.argmin(np.abs(run.t - time)))
        cells = [_number(cell) for cell in row.locator('td').all_inner_texts()]
        wanted = (run.nu_d - run.nu)[sample, :3]
        assert cells == pytest.approx(wanted.tolist(), rel=6e-4)


def _number(text: str) -> float:
    """Number that a page writes."""
    return float(text.replace('−', '-').translate(SUPERSCRIPTS).replace('·10', 'e'))


def test_errors_on_a_logarithmic_axis(report):
    report.panel('error-linear')
    report.panel('tau-linear')
    report.page.get_by_role('checkbox', name='log |error|').click()
    shown = report.shown('error-linear')
    assert shown['axis'] == 'LogAxis'
    assert shown['values'][0] > 0.0
    assert report.shown('tau-linear')['axis'] == 'LinearAxis'


def test_keys_move_along_the_time_axis(report):
    panel = report.panel('error-linear')
    panel.focus()
    assert panel.evaluate('(element) => getComputedStyle(element).outlineStyle') == 'solid'
    for key, window in (('+', [1.25, 3.75]), ('ArrowRight', [1.75, 4.25]), ('Home', [0.0, 5.0])):
        report.page.keyboard.press(key)
        assert report.shown('error-linear')['window'] == pytest.approx(window)
    report.page.keyboard.press('Shift+ArrowRight')
    assert report.shown('error-linear')['cursor'] == pytest.approx(0.05)
    assert 't = 0.05' in report.page.locator('.panel-controls output').inner_text()


def test_every_control_is_reached_by_the_tabulator(report):
    reached = set()
    for _ in range(60):
        report.page.keyboard.press('Tab')
        reached.add(
            report.page.evaluate(
                'document.activeElement.value || document.activeElement.dataset.panel || ""'
            )
        )
    assert {*DOFS, 'gvc', 'cl', 'zoom'} <= reached


def test_the_wheel_scrolls_the_page_unless_the_panel_has_the_focus(report):
    panel = report.panel('error-linear')
    panel.locator('.plot').hover(position={'x': 420, 'y': 100})
    before = report.page.evaluate('scrollY')
    report.page.mouse.wheel(0, 40)
    report.page.wait_for_function('(before) => scrollY > before', arg=before)
    assert report.shown('error-linear')['window'] == [0.0, 5.0]
    panel.focus()
    report.settle()
    panel.locator('.plot').hover(position={'x': 420, 'y': 100})
    report.page.mouse.wheel(0, -40)
    report.page.wait_for_function('document.querySelector("[name=to]").valueAsNumber < 5')


@pytest.mark.parametrize('how', ['button', 'system'])
def test_dark_pages_have_light_axes(browser, path, how):
    report = Watched(browser, path, color_scheme='dark' if how == 'system' else 'light')
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


def test_without_scripts_the_still_figures_are_there(browser, path):
    report = Watched(browser, path, java_script_enabled=False)
    assert report.page.locator('#errors_gvc img').is_visible()
    assert not report.page.locator('.panel-controls').is_visible()
    report.close()


def test_a_link_opens_what_it_leads_to(browser, path):
    report = Watched(browser, path, '#errors_cl')
    report.page.wait_for_selector('.with-panels')
    image = report.page.locator('#errors_cl img')
    assert image.is_visible()
    assert 0.0 < report.page.locator('#errors_cl').bounding_box()['y'] < 450.0
    report.close()
