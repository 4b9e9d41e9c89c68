"""The panels of a report in a browser: every control does what it says."""

import numpy as np
import pytest
from browser import coloured, pixels

from auv_analysis.report.plotting import COLOURS
from auv_dynamics.vehicle import DOFS

SUPERSCRIPTS = str.maketrans('⁻⁰¹²³⁴⁵⁶⁷⁸⁹', '-0123456789')
PANELS = ('error-linear', 'error-angular', 'tau-linear')


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
    panel = report.panel('error-linear')
    report.settle()  # what is drawn above it moves it
    plot = panel.locator('.plot').bounding_box()
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
    report.page.get_by_role('button', name='after 2 s', exact=True).click()
    assert report.shown('error-angular')['window'] == [2.0, 5.0]


def test_the_vertical_axis_fits_what_is_shown(report, short_runs):
    report.panel('error-linear')
    report.page.get_by_role('button', name='after 2 s', exact=True).click()
    late = [run.part(run.t >= 2.0) for run in short_runs.values()]
    errors = np.concatenate([(run.nu_d - run.nu)[:, :3] for run in late])
    low, high = report.shown('error-linear')['values']
    margin = 0.06 * (errors.max() - errors.min())
    assert errors.min() - margin < low < errors.min()
    assert errors.max() < high < errors.max() + margin


def test_values_are_those_of_the_sample_pointed_at(report, short_runs):
    report.panel('error-angular')
    panel = report.panel('error-linear')
    panel.locator('.plot').hover(position={'x': 420, 'y': 100})
    time = report.shown('error-linear')['cursor']
    assert report.shown('error-angular')['cursor'] == time
    for row, run in zip(panel.locator('tbody tr').all(), short_runs.values(), strict=True):
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
