"""Recordings that are short, slow, or in part no measurement, become records or one line."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from trials import DELAY, LAG, trial, wrong_prior

from auv_analysis.bag.tracks import Track
from auv_analysis.studies.identify.bags import parts
from auv_analysis.studies.identify.identify import Settings, identify, split
from auv_analysis.studies.identify.record import Record, of_tracks
from auv_analysis.studies.identify.start import least_squares_start
from auv_analysis.studies.identify.unknowns import unknowns
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.vehicle_file import load_vehicle

AHEAD = [1.0, 0.0, 0.0, 0.0]
ROWS = {'pose': [0.0, 0.0, 0.0, *AHEAD], 'twist': [0.0] * 6, 'wrench': [0.0] * 6}


@pytest.fixture(scope='module')
def herman(tmp_path_factory):
    return trial(tmp_path_factory.mktemp('herman'), 'herman2018', 3, duration=60.0)[0]


def record(duration: float, step: float = 0.01, seed: int = 0) -> Record:
    """Noise as motion and as command."""
    n, rng = round(duration / step), np.random.default_rng(seed)
    t = step * np.arange(n + 1)
    nu, command = rng.normal(size=(n + 1, 6)), rng.normal(size=(n, 6))
    return Record('x', t, np.tile(AHEAD, (n + 1, 1)), t, nu, step, command, 0.0)


def tracks(stamps: dict[str, np.ndarray]) -> dict[str, Track]:
    """A vehicle at rest, of which something is recorded at these stamps, ns."""
    return {
        role: Track(role, f'/{role}', ns, np.tile(ROWS[role], (len(ns), 1)), 2e8, role == 'wrench')
        for role, ns in stamps.items()
    }


@pytest.mark.parametrize('duration', [30.1, 60.02])
def test_four_equal_records_leave_no_empty_one(duration):
    training, held = split([record(duration)] * 4, 0.25)
    assert [len(one.command) for one in training] == [round(100 * duration)] * 3
    assert [len(one.command) for one in held] == [round(100 * duration)]


def test_nothing_to_learn_from_is_told():
    with pytest.raises(InputError, match=r'to learn from, found 0\.9 of 8 s'):
        split([record(8.0)], 0.9)
    with pytest.raises(InputError, match=r'--part: expected .* for a second and more'):
        parts([record(30.0)], [(10.0, 10.1)])
    assert parts([record(30.0)], [(10.0, 11.0)])


def test_between_two_pauses_close_together_there_is_no_record():
    t = np.arange(0.0, 10.0, 0.02)
    ns = (1e9 * t[(t < 4) | ((t > 5) & (t < 5.9)) | (t > 7)]).astype(np.int64)
    tracks = {
        role: Track(role, '/x', ns, np.tile(row, (len(ns), 1)), 2e8, role == 'wrench')
        for role, row in (
            ('pose', [0.0] * 3 + [*AHEAD]),
            ('twist', [0.0] * 6),
            ('wrench', [0.0] * 6),
        )
    }
    assert [round(one.end) for one in of_tracks('x', tracks)] == [4, 10]


def test_a_segment_fits_into_a_record(herman):
    with pytest.raises(InputError, match=r'--segment: expected at most 7\.4 s, found 100 s'):
        identify([herman.part(0.0, 8.0)], [], load_vehicle('herman2018'), Settings(segment=100.0))


def test_many_short_stretches_are_enough(herman):
    """Twenty stretches of 3 s are together longer than the longest segment."""
    stretches = [herman.part(2.9 * i, 2.9 * i + 3.0) for i in range(20)]
    few = Settings(('M.diagonal',))
    found = identify(stretches, [], load_vehicle('herman2018'), few)
    assert len(found.problem.segments) == 20


@pytest.mark.parametrize('rate', [5.0, 9.5, 10.0, 10.4, 12.0])
def test_a_start_is_found_from_a_slow_velocity(herman, rate):
    """As a Doppler log gives it; the prior is 25 % off."""
    rows = np.rint(np.arange(0.0, herman.end, 1.0 / rate) / herman.step).astype(int)
    slow = replace(herman, velocity_t=herman.velocity_t[rows], velocity=herman.velocity[rows])
    vehicle = load_vehicle('herman2018')
    speeds, wrenches = (np.sqrt((x**2).mean(axis=0)) for x in (slow.velocity, slow.wrench))
    u = unknowns(wrong_prior(vehicle, 3), speeds=speeds, wrenches=wrenches)
    theta, late, _ = least_squares_start([slow], u)
    assert_allclose(np.diag(u.coefficients(theta).M), np.diag(vehicle.M), rtol=0.1)
    assert late == pytest.approx(LAG + DELAY, abs=0.03)
