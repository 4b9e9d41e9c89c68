"""A run: its parts and columns, what is known of it, and cuts in time."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.block_runs import in_blocks, joined
from helpers.strategies import examples
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from auv_analysis import load_scenario, simulate
from auv_analysis.runs.run import Run, Windows
from auv_dynamics import load_vehicle
from auv_dynamics.vehicle import DOFS


@pytest.fixture(scope='module')
def run() -> Run:
    scenario = load_scenario('case1')
    return simulate(replace(scenario, data=scenario.data | {'duration': 4.0}), 'gvc', 'zoh')


@given(
    rows=st.integers(1, 40) | st.integers(100, 450), margin=st.integers(0, 20), wide=st.booleans()
)
@examples(10)
def test_blocks_are_the_run(run, rows, margin, wide) -> None:
    if not wide:
        whole = joined([*run.blocks(rows)])
    else:
        parts = [*run.wide_blocks(margin, rows)]
        whole = joined([block.part(inside) for block, inside in parts])
        for i, (block, _) in zip(range(0, len(run.t), rows), parts, strict=True):
            first, last = max(i - margin, 0), min(i + rows + margin, len(run.t))
            assert_array_equal(block.t, run.t[first:last])
    assert whole.arrays().keys() == run.arrays().keys()
    for name, values in run.arrays().items():
        assert_array_equal(whole.arrays()[name], values)


def test_a_part_has_the_gaps_between_its_samples(run: Run) -> None:
    first, second = (run.t[9], run.t[10]), (run.t[29], run.t[30])
    holed = replace(run, gaps=(first, second))
    for keep, gaps in (
        (slice(9, 31), (first, second)), (slice(10, 31), (second,)), (slice(9, 30), (first,)),
        (9, ()), (run.t < 0.0, ()),
    ):  # fmt: skip
        assert holed.part(keep).gaps == gaps


def test_a_run_is_printed_in_a_line(run: Run) -> None:
    for one in (run, in_blocks(run, 100)):
        text = repr(one)
        assert len(text.splitlines()) == 1
        words = 'case1', 'law gvc', 'vehicle herman2018', 'by simulate (zoh)', 'from 0 to 4 s'
        assert all(word in text for word in (*words, '401 samples'))


def test_a_run_is_a_data_frame(run: Run) -> None:
    groups = {
        'eta': run.eta, 'nu': run.nu, 'nu_d': run.nu_d, 'nu_d_dot': run.nu_d_dot, 'tau': run.tau,
        'F': run.disturbance, 'f': run.disturbance_estimate,
    }  # fmt: skip
    frame = run.to_pandas()
    assert frame.index.name == 't'
    assert_array_equal(frame.index, run.t)
    assert [*frame] == [f'{name}.{dof}' for name in groups for dof in DOFS], 'no actuators'
    assert_array_equal(frame, np.concatenate([*groups.values()], axis=1))
    devices = replace(run, applied=2 * run.tau, measured=3 * run.nu).to_pandas()
    assert_array_equal(devices[[f'applied.{dof}' for dof in DOFS]], 2 * run.tau)
    assert_array_equal(devices[[f'measured.{dof}' for dof in DOFS]], 3 * run.nu)


@pytest.mark.parametrize(
    ('signal', 'fact', 'needed'),
    [
        ('nu_d', 'knows_setpoint', 1),
        ('tau', 'knows_wrench', 1),
        ('disturbance_estimate', 'knows_disturbance', 6),
    ],
)
def test_how_many_components_a_signal_needs_to_be_known(run, signal, fact, needed) -> None:
    for known in (0, 1, 5, 6):
        values = np.where(np.arange(6) < known, getattr(run, signal), np.nan)
        assert getattr(replace(run, **{signal: values}), fact) == (known >= needed)


def test_what_is_known_of_a_run(run: Run) -> None:
    assert (run.samples, run.start, run.duration) == pytest.approx((401, 0.0, 4.0))
    late = run.part(slice(100, 301))
    assert (late.samples, late.start, late.duration) == pytest.approx((201, 1.0, 2.0))
    assert (run.sensing, run.acting, run.unknown) == (False, False, ())
    assert not replace(run, disturbance=None).knows_disturbance
    blind = replace(run, measured=run.nu, nu=np.where(np.eye(6)[4], np.nan, run.nu))
    assert (blind.sensing, blind.acting, blind.unknown) == (True, False, ('pitch',))
    driven = replace(run, applied=2 * run.tau)
    assert (driven.sensing, driven.acting) == (False, True)
    assert driven.tau_applied is driven.applied
    assert run.tau_applied is run.tau
    assert blind.nu_measured is blind.measured
    assert run.nu_measured is run.nu


def test_the_valid_share_is_that_of_the_samples_that_are_there(run: Run) -> None:
    """Of 401 samples those between the ends of each gap are missing: 99 and 49."""
    holed = replace(run, gaps=((0.5, 1.5), (2.0, 2.5)))
    assert holed.valid_share == pytest.approx((401 - 99 - 49) / 401)
    assert run.valid_share == 1.0


def test_a_sample_at_a_cut_belongs_to_what_is_behind_it() -> None:
    windows = Windows([5.0, 2.0, 5.0])
    assert windows.parts == 3
    found = [*windows.split(np.array([1.0, 2.0, 4.0, 5.0]))]
    assert found == [(0, slice(0, 1)), (1, slice(1, 3)), (2, slice(3, 4))]
    assert [*windows.split(np.array([0.5, 7.0]))] == [(0, slice(0, 1)), (2, slice(1, 2))]
    assert windows.between() == range(3)
    assert (windows.between(2.0), windows.between(None, 2.0)) == (range(1, 3), range(1))
    assert windows.between(2.0, 5.0) == range(1, 2)


def test_a_run_of_which_no_more_is_said_is_that_of_a_bag() -> None:
    six = np.zeros((2, 6))
    run = Run(
        vehicle=load_vehicle('herman2018'), scenario='', controller='', law='', gains={}, step=1.0,
        source='bag', t=np.arange(2.0), eta=six, nu=six, nu_d=six, nu_d_dot=six, tau=six,
        disturbance=None, disturbance_estimate=six,
    )  # fmt: skip
    told = run.kinds, run.notes, run.gaps, run.faults, run.unrecorded, run.acceleration
    assert told == (None, (), (), (), frozenset(), None)
    assert run.hold == 'zoh', 'nodes hold the wrench'
