"""The numbers of the example's README are those of its code."""

import re

import numpy as np
import pytest
from ardusub_mixer import thrust
from helpers.mavlink_relay import EXAMPLE
from wrench_mapping import FOUR, WrenchMapping, command_of

from auv_dynamics import load_vehicle

TEXT = (EXAMPLE / 'README.md').read_text(encoding='utf-8')
ROWS = {
    'bluerov2_heavy, `rc_override`, 16 V': ('bluerov2_heavy', 16.0, range(6), 1.0),
    'the same at 12 V': ('bluerov2_heavy', 12.0, range(6), 1.0),
    'the same, `manual_control`, pilot gain 0.5': ('bluerov2_heavy', 16.0, FOUR, 0.5),
    'bluerov2, `rc_override`, 16 V': ('bluerov2', 16.0, range(6), 1.0),
}


@pytest.mark.parametrize('row', ROWS)
def test_largest_wrenches(row: str) -> None:
    name, voltage, dofs, reach = ROWS[row]
    cells = re.search(rf'\| {re.escape(row)} \| (.*) \|', TEXT)[1].split(' | ')
    mapping = WrenchMapping(load_vehicle(name), tuple(dofs), voltage)
    for dof, cell in enumerate(cells):
        if cell == 'none':
            assert dof not in mapping.dofs
            continue
        written = [float(number) for number in cell.split(', ')]
        found = [1e4 * mapping.axes(1e4 * sign * np.eye(6)[dof], reach)[1] for sign in (1, -1)]
        assert [round(value, 1) for value in found] == (written * 2)[:2]


@pytest.mark.parametrize(
    ('asked', 'written'), [(1, (1.7, 2.1)), (10, (1.3, 1.7)), (20, (1.1, 1.3)), (30, (0.9, 1.0))]
)
def test_what_a_measured_thruster_makes_of_it(asked: float, written: tuple) -> None:
    assert f'{written[0]:g} to {written[1]:.1f} at {asked}' in ' '.join(TEXT.split())
    limits = np.array([40.2]), np.array([51.5])
    shares = []
    for sign in (1.0, -1.0):
        pulses = 1500 + 400 * command_of(np.array([sign * asked]), *limits)
        shares.append(thrust(pulses, 'measured', 16.0)[0] / (sign * asked))
    assert sorted(round(share, 1) for share in shares) == list(written)
