"""The recorded wrench beside that of another law, and their difference."""

import numpy as np
import pytest
from helpers.artists import named, same
from helpers.made_runs import DOFS

from auv_analysis.cli import replay as command
from auv_analysis.replay import compared as replay

pytestmark = pytest.mark.usefixtures('approved')

WRENCH = ('N', 'N m')
RNG = np.random.default_rng


def test_wrenches_of_another_law_beside_the_recorded_ones() -> None:
    rng = RNG(8)
    both = replay.Compared(np.arange(50) * 0.1, *rng.normal(size=(2, 50, 6)))
    document = {
        'answered': {'law': 'pid'}, 'recorded': {'law': 'gvc'}, 'reproduction': 'not reproduced'
    }  # fmt: skip
    figure, title, _ = replay._figure(document, both)
    key = figure.axes[1].get_legend()
    for k, axes in enumerate(figure.axes):
        i = k // 2 + 3 * (k % 2)
        symbol = rf'$\tau_{{{"XYZKMN"[i]}}}$'
        assert axes.get_ylabel() == f'{DOFS[i]}: {symbol} ({WRENCH[i // 3]})'
        shown = named(axes, key)
        assert list(shown) == ['recorded (gvc)', 'pid, open loop']
        for (curve,), wrench in zip(shown.values(), (both.recorded, both.answered), strict=True):
            same(curve, both.t, wrench[:, i])
        assert axes.get_xlabel() == ('$t$ (s)' if k > 3 else '')
    assert title == 'What pid, open loop would have commanded'
    assert figure.get_suptitle() == 'Not reproduced'


@pytest.mark.parametrize(('n', 'most'), [(1, 1), (3998, 3998), (20_000, 4000)])
def test_lines_have_as_many_points_as_can_be_seen(n: int, most: int) -> None:
    both = replay.Compared(np.arange(n) * 0.01, *RNG(9).normal(size=(2, n, 6)))
    document = {'answered': {'law': 'pid'}, 'recorded': {'law': ''}, 'reproduction': 'unknown'}
    figure, *_ = replay._figure(document, both)
    points = {len(line.get_xdata()) for axes in figure.axes for line in axes.lines}
    assert max(points) <= most
    assert min(points) >= min(n, most // 2)


def test_differences_of_wrenches_have_their_sign() -> None:
    both = replay.Compared(
        np.arange(2.0), np.full((2, 6), 3.0), np.full((2, 6), [1.0, 2, 3, 4, 5, 7])
    )
    found = replay.metrics_of(both)
    assert found['difference']['max'] == pytest.approx([2.0, 1.0, 0.0, 1.0, 2.0, 4.0])
    assert found['recorded']['rms'] == pytest.approx([3.0] * 6)
    assert found['answered']['rms'] == pytest.approx([1.0, 2, 3, 4, 5, 7])
    uneven = replay.Compared(np.arange(2.0), np.zeros((2, 6)), np.array([[3.0] * 6, [-4.0] * 6]))
    assert replay.metrics_of(uneven)['answered'] == {
        'rms': pytest.approx([np.sqrt(12.5)] * 6), 'max': [4.0] * 6
    }  # fmt: skip


def test_the_printed_table_has_each_number_in_its_column(capsys, approved) -> None:
    wrench = {
        part: {kind: [100.0 * k + 10 * j + i + 1 for i in range(6)]
               for j, kind in enumerate(('rms', 'max'))}
        for k, part in enumerate(('recorded', 'answered', 'difference'))
    }  # fmt: skip
    document = {'reproduction': 'reproduced', 'answered': {'law': 'pid'}, 'wrench': wrench,
                'notes': ['odd']}  # fmt: skip
    command._show(document)
    lines = capsys.readouterr().err.splitlines()
    approved.add(lines)
    assert lines[0] == 'reproduced'
    assert [word for line in lines[1:3] for word in line.split()] == [
        'recorded', 'pid', 'difference', *['rms', 'max'] * 3,
    ]  # fmt: skip
    for i, (dof, line) in enumerate(zip(DOFS, lines[3:9], strict=True)):
        values = [*line.replace('N m', 'N·m').split()]
        assert values[:2] == [f'{dof},', 'N' if i < 3 else 'N·m']
        wanted = [six[i] for part in wrench.values() for six in part.values()]
        assert [float(value) for value in values[2:]] == wanted
    assert lines[9] == 'note: odd'


def test_what_is_said_of_a_recorded_law_that_is_asked_again(approved) -> None:
    found = [
        replay.Reproduction(relative, within, 0.01)
        for relative, within in ((None, None), (None, 0.0), (None, 2.0), (0.005, 1.0), (0.02, 1.0))
    ]
    assert [one.holds for one in found] == [None, True, False, True, False]
    assert replay.Reproduction(0.01, 1.0, 0.01).holds
    approved.add(one.sentence() for one in found)
