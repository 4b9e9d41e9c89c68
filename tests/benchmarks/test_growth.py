"""The slope that is fitted to a growth curve, and the page that shows it."""

import growth
import pytest
from curves import CURVES

CONDITIONS = {
    'machine': {'cpu': 'a processor', 'cores': 2, 'memory_gb': 8.0, 'kernel': 'Linux 6'},
    'versions': {'python': '3.11.7'},
}


@pytest.mark.parametrize('power', [-1.0, 0.5, 1.0, 2.0])
def test_a_power_law_has_its_exponent_as_slope(power):
    points = [(size, 3.0 * size**power) for size in (1, 10, 100, 1000)]
    assert growth.slope(points) == pytest.approx(power, abs=1e-12)


def test_what_starting_costs_does_not_hide_how_cost_grows():
    points = [(size, 5.0 + 0.01 * size) for size in (1, 10, 1e4, 1e5, 1e6)]
    assert growth.slope(points) == pytest.approx(1.0, abs=0.02)


def test_every_curve_has_its_table_and_figure(tmp_path):
    measured = {
        curve.name: {
            'unit': curve.unit,
            'cost_unit': 's',
            'points': list(zip(curve.sizes, (0.1, 0.3, 2.0, 9.0, 80.0, 700.0), strict=False)),
            'slope': 0.97,
        }
        for curve in CURVES
    }
    text = growth.text({**measured, **CONDITIONS})
    for curve in CURVES:
        assert f'## {curve.what}\n\nSlope **0.97**; {curve.expected}.' in text
    rows = [line for line in text.splitlines() if line.startswith('| ') and line[2].isdigit()]
    assert len(rows) == sum(len(curve.sizes) for curve in CURVES)
    growth.plot({**measured, **CONDITIONS}, tmp_path / 'growth.png')
    assert (tmp_path / 'growth.png').read_bytes().startswith(b'\x89PNG')
