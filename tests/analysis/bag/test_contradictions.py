"""What a recording contradicts itself in is said, and the map takes it off."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers import sea_trials
from helpers.foreign_bags import (
    SECOND,
    UNNAMED,
    Maker,
    loaded,
    motion,
    nanoseconds,
    simple,
    simulated,
    write,
)
from helpers.foreign_logs import STATE, TABLES, tables, text_of
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import cumulative_trapezoid

from auv_analysis.bag import foreign_checks
from auv_analysis.bag.any_bag import survey
from auv_analysis.bag.foreign_checks import (
    Delay,
    _clear,
    _least,
    _together,
    acts_behind,
    behind,
    contradictions,
    delays,
    doubts_of_motion,
    doubts_of_wrench,
    misread_rates,
)
from auv_analysis.bag.foreign_topics import MappedTopic, TopicMap, candidates
from auv_analysis.bag.foreign_tracks import _evenly
from auv_analysis.bag.tracks import Track
from auv_analysis.metrics.pose_twist import CONJUGATE, turn
from auv_analysis.runs.run import Run
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle.kinematics import quaternion

TERMS = {  # two incommensurable sines per axis: motion enough for a delay to show
    'surge': (0.5, 1.1), 'sway': (0.4, 1.3), 'heave': (0.3, 0.9),
    'roll': (0.05, 1.7), 'pitch': (0.06, 1.2), 'yaw': (0.3, 0.8),
}  # fmt: skip
MOVING = {
    dof: {
        'terms': [
            {'amplitude': size, 'omega': omega, 'phase': 0.3},
            {'amplitude': size / 2, 'omega': 2.3 * omega, 'phase': 1.0},
        ]
    }
    for dof, (size, omega) in TERMS.items()
}


@pytest.fixture(scope='module')
def run() -> Run:
    still = {'eta': [0.0] * 6, 'nu': [0.0] * 6}
    return simulated(duration=25.0, setpoint=MOVING, initial=still)


def bag_of(run: Run, folder: Path, tau: Run | None = None, wrench_later: float = 0.0) -> Path:
    forces = motion(tau or run, enu=False)
    forces = forces._replace(t=forces.t + wrench_later)
    return tables(folder / 'dive', motion(run, enu=False, keep=slice(None, None, 2)), forces)


def true_nu(run: Run, found: Run) -> np.ndarray:
    """Velocities that were simulated; wrenches are averaged, so it begins half a step later."""
    t = found.t + found.step / 2
    return np.stack([np.interp(t, run.t, column) for column in run.nu.T], axis=1)


def said(run: Run, word: str) -> list[str]:
    return [note for note in run.notes if word in note]


def test_a_sound_recording_has_no_contradictions(run, tmp_path) -> None:
    found = loaded(bag_of(run, tmp_path), **TABLES)
    for word in ('not the rate', 'behind', 'is zero', 'bursts'):
        assert not said(found, word), word
    assert said(found, 'nor an error of the model')


def test_an_angular_velocity_that_is_not_the_rate_of_the_attitude_is_named(run, tmp_path) -> None:
    nu = run.nu.copy()
    nu[:, 5] = 0.0
    bag = bag_of(replace(run, nu=nu), tmp_path, tau=run)
    (note,) = said(loaded(bag, **TABLES), 'not the rate of the attitude')
    assert 'yaw 0 throughout in place of' in note
    assert 'roll' not in note
    file = tmp_path / 'map.yaml'
    file.write_text(yaml.safe_dump(TABLES | {'vehicle': 'rexrov', 'rates': 'from attitude'}))
    mended = loaded(bag, file)
    assert not said(mended, 'not the rate')
    inner = slice(50, -50)
    truth = true_nu(run, mended)
    assert_allclose(mended.nu[inner], truth[inner], atol=3e-3)


def test_an_angular_velocity_of_the_other_sign_is_said_to_be_that(run, tmp_path) -> None:
    bag = bag_of(replace(run, nu=run.nu * [1, 1, 1, 1, 1, -1]), tmp_path, tau=run)
    (note,) = said(loaded(bag, **TABLES), 'not the rate of the attitude')
    assert ' rad/s, with the other sign;' in note
    bag = bag_of(replace(run, nu=run.nu * [1, 1, 1, 1, 1, 0.5]), tmp_path / 'half', tau=run)
    (note,) = said(loaded(bag, **TABLES), 'not the rate of the attitude')
    half, whole, apart = (float(word) for word in note.split() if word[0] == '0')
    assert 'apart' in note
    assert (half / whole, apart / whole) == pytest.approx((0.5, 0.5), abs=0.03)


def test_a_late_velocity_is_told_and_taken_off(run, tmp_path) -> None:
    late, seen = 0.2, motion(run, enu=False, keep=slice(None, None, 2))
    bag = tables(tmp_path / 'dive', seen, motion(run, enu=False))
    rows = np.column_stack([seen.t + late, seen.twist])
    (bag / 'dvl.csv').write_text('t,u,v,w,p,q,r\n' + text_of(rows))
    keys = {'stamp': 't', 'frames': 'ned_fsd', 'wrench': TABLES['wrench'],
            'pose': {'topic': 'motion', 'fields': {name: name for name in STATE[:7]}}}  # fmt: skip
    twist = {'topic': 'dvl', 'fields': {name: name for name in STATE[7:]}}
    found = loaded(bag, **keys, twist=twist)
    notes = said(found, 'behind the position')
    assert len(notes) == 1
    value, error = (float(x) for x in notes[0].split('velocity is ')[1].split(' s')[0].split(' ± '))
    assert abs(value - late) <= max(3.0 * error, 0.015)
    assert len(said(found, 'behind the attitude')) == 1
    mended = loaded(bag, **keys, twist=twist | {'delay': late})
    assert not said(mended, 'behind the')
    truth = true_nu(run, mended)
    assert_allclose(mended.nu, truth, atol=2e-3)


def along_east(speed: float, *surges: float, count: int = 400) -> list[Track]:
    """Pose of a vehicle that heads east and moves so, and velocities along its bow."""
    t, still = 0.05 * np.arange(count), np.zeros(count)
    attitude = quaternion(np.stack([still, still, still + np.pi / 2], axis=1))
    pose = np.column_stack([still, speed * t, still + 1.0, attitude])
    twists = [np.column_stack([still + u, *[still] * 5]) for u in surges]
    named = [('pose', pose), *(('twist', rows) for rows in twists)]
    ns = nanoseconds(t)
    return [Track(role, f'/{role}', ns, rows, np.inf, held=False) for role, rows in named]


@pytest.mark.parametrize(('speed', 'told', 'other', 'is_doubtful'), [
    (0.021, 0.0, 0.021, True), (0.019, 0.0, 0.019, False), (0.5, 0.5, 0.0, False),
    (0.5, 0.71, 0.6, True), (0.5, 0.69, 0.6, False),  # off by 0.21 or 0.19, in place of 0.1
])  # fmt: skip
def test_a_frame_of_the_twist_is_doubted_where_the_other_one_fits_twice_as_well(
    speed, told, other, is_doubtful
) -> None:
    tracks = along_east(speed, told, other)
    for frame, right in (('child', 'world'), ('world', 'child')):
        notes = doubts_of_motion(*tracks, frame)
        assert len(notes) == is_doubtful
        for note in notes:
            assert f'with twist_frame {frame} the velocity differs' in note
            assert f'by {abs(told - speed):.2g} m/s (RMS), with twist_frame {right} by' in note
            assert note.endswith(f'{right} fits better')
    assert doubts_of_motion(*along_east(0.5, 0.0, 0.5, count=8), 'child') == []
    unknown = replace(tracks[0], rows=tracks[0].rows * np.where(np.arange(7) < 3, np.nan, 1.0))
    assert doubts_of_motion(unknown, *tracks[1:], 'child') == []


@pytest.mark.parametrize(('rate', 'share', 'said'), [
    (0.1, 0.72, []), (0.1, 0.68, ['yaw 0.068 in place of 0.1 rad/s, 0.032 apart']),
    (0.1, -0.72, ['yaw 0.072 in place of 0.1 rad/s, with the other sign']),
    (0.021, 0.0, ['yaw 0 throughout in place of 0.021 rad/s']), (0.019, 0.0, []),
])  # fmt: skip
def test_rates_that_are_off_by_three_tenths_are_misread(rate, share, said) -> None:
    t, still = 0.05 * np.arange(400), np.zeros(400)
    attitude = quaternion(np.stack([still, still, rate * t], axis=1))
    rates = np.column_stack([still * np.nan, still * np.nan, still + share * rate])
    assert misread_rates(t, attitude, rates) == said


@pytest.mark.parametrize(('size', 'is_told'), [(0.027, False), (0.03, True)])
def test_a_velocity_below_that_of_rest_tells_no_delay(size, is_told) -> None:
    t = 0.02 * np.arange(3000)
    path = -size / 0.8 * np.cos(0.8 * t)
    found = behind(t, path[:, None], size * np.sin(0.8 * (t - 0.2))[:, None])
    assert (found is not None) == is_told
    assert found is None or found.value == pytest.approx(0.2, abs=0.003)


@pytest.mark.parametrize(('seconds', 'is_told'), [(7.8, False), (8.2, True)])
def test_six_seconds_between_the_latest_delays_tell_one(seconds, is_told) -> None:
    t = np.arange(0.0, seconds, 0.02)
    path = -np.cos(0.8 * t) / 0.8
    found = behind(t, path[:, None], np.sin(0.8 * (t - 0.2))[:, None])
    assert (found is not None) == is_told


@pytest.mark.parametrize(('size', 'is_told'), [(0.6, True), (1.3, False)])
def test_a_velocity_explains_half_of_the_rate_that_it_is_late_for(size, is_told) -> None:
    """Beside another motion: 1 / (1 + size^2) of the variance."""
    t = np.arange(0.0, 600.0, 0.05)
    path = -np.cos(0.8 * t) / 0.8 - size * np.cos(2.1 * t + 1.0) / 2.1
    found = behind(t, path[:, None], np.sin(0.8 * (t - 0.2))[:, None])
    assert (found is not None) == is_told
    assert found is None or found.value == pytest.approx(0.2, abs=3.0 * found.error)


@pytest.mark.parametrize(('size', 'is_told'), [(0.2, True), (0.4, False)])
def test_a_wrench_explains_nine_tenths_of_what_it_is_late_for(size, is_told) -> None:
    """Of the variance of the acceleration, 1 / (1 + size^2)."""
    t, still = np.arange(0.0, 60.0, 0.02), np.zeros((3000, 5))

    def force(t: np.ndarray) -> np.ndarray:
        return np.sin(1.1 * t) + np.sin(1.9 * t + 1.0)

    other = size * (np.sin(1.4 * t) + np.sin(2.3 * t + 2.0))
    nu = cumulative_trapezoid(force(t - 0.2) + other, t, initial=0.0)
    pose = np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (3000, 1))
    twist, wrench = (np.column_stack([x, still]) for x in (nu, force(t)))
    named = ('pose', pose), ('twist', twist), ('wrench', wrench)
    tracks = [
        Track(role, f'/{role}', nanoseconds(t), rows, np.inf, held=False) for role, rows in named
    ]
    found = acts_behind(*tracks)
    assert (found is not None) == is_told
    assert found is None or found.value == pytest.approx(0.2, abs=0.02)


def test_a_delay_is_the_lowest_point_and_its_error_the_scatter_of_the_parts() -> None:
    lowest = np.where(np.arange(20) < 10, 0.24, 0.444)  # s
    found, least = _least(-1.0, lambda delay: 3.0 * (delay - lowest) ** 2, 6)
    assert found is not None
    assert (found.value, found.error) == pytest.approx((0.342, 0.102 / np.sqrt(20)))
    assert least == pytest.approx(20 * 3.0 * (0.102**2 + 0.002**2))  # of 0.34, which was tried
    for place in (-1.2, 1.2):  # beyond those that are tried
        assert _least(-1.0, lambda delay, p=place: np.full(20, (delay - p) ** 2), 6)[0] is None


@pytest.mark.parametrize(('value', 'error', 'is_told'), [
    (0.031, 0.01, True), (-0.031, 0.01, True), (0.029, 0.01, False), (0.021, 0.0, True),
    (0.019, 0.0, False), (0.5, 0.049, True), (0.5, 0.051, False),
])  # fmt: skip
def test_a_delay_is_told_where_it_is_no_chance_and_sharp(value, error, is_told) -> None:
    assert _clear(Delay(value, error)) == (Delay(value, error) if is_told else None)


def test_the_error_of_a_late_wrench_holds_what_another_filter_changes(run, monkeypatch) -> None:
    seen, ns = motion(run, enu=False), nanoseconds(run.t)
    pose = np.column_stack([seen.position, np.roll(seen.attitude, 1, axis=1)])
    named = ('pose', pose), ('twist', run.nu), ('wrench', run.tau)
    tracks = [Track(role, '', ns, rows, np.inf, held=False) for role, rows in named]
    said = iter((Delay(0.2, 0.003), Delay(0.204, 0.1)))
    monkeypatch.setattr(foreign_checks, '_acts_behind', lambda *_: next(said))
    found = acts_behind(*tracks)
    assert found is not None
    assert (found.value, found.error) == pytest.approx((0.2, 0.005))


def test_the_wrench_that_was_applied_is_the_one_that_is_late(monkeypatch) -> None:
    pose, twist = along_east(0.5, 0.5)
    monkeypatch.setattr(foreign_checks, 'acts_behind', lambda *_: Delay(0.2, 0.01))
    forces = {role: replace(twist, role=role, topic=f'/{role}') for role in
              ('wrench', 'wrench_applied')}  # fmt: skip
    (note,) = delays({'pose': pose, 'twist': twist, **forces}, 'child')
    assert note.startswith('/wrench_applied: the wrench acts 0.20 ± 0.01 s behind its stamps')


def test_signals_are_compared_in_the_longest_time_without_a_gap() -> None:
    one, other = (
        Track('twist', '/t', np.array(ns), np.zeros((len(ns), 1)), 3.0, held=False)
        for ns in ([*range(-10, 3), *range(9, 21)], [1, 2, *range(9, 15), 18, 20, 23])
    )
    assert _together(one, other).tolist() == [9, 10, 11, 12, 13, 14]


def planar(surge, yaw_rate, late: float, seed: int, frame: str = 'child', noise: float = 1.0):
    """Pose and late twist of a minute's motion in the plane, with noise on both."""
    rng, fine = np.random.default_rng(seed), np.linspace(0.0, 60.0, 30001)
    u, r = (np.broadcast_to(signal(fine), fine.shape) for signal in (surge, yaw_rate))
    psi = cumulative_trapezoid(r, fine, initial=0.0)
    ways = [cumulative_trapezoid(u * f(psi), fine, initial=0.0) for f in (np.cos, np.sin)]
    eta = np.stack([*ways, *np.zeros((3, len(fine))), psi], axis=1)[::10]
    nu = np.stack([u, *np.zeros((4, len(fine))), r], axis=1)[::10]
    eta, nu = (
        rows + noise * rng.normal(size=rows.shape) * np.repeat(sizes, 3)
        for rows, sizes in ((eta, (0.005, 0.002)), (nu, (0.01, 0.01)))
    )
    q, ns = quaternion(eta[:, 3:]), np.round(fine[::10] * SECOND).astype(np.int64)
    stamps = ns + round(late * SECOND)
    if frame == 'world':  # as it is read: turned back by the attitude of its own stamp
        there = np.clip(np.searchsorted(ns, stamps), 0, len(ns) - 1)
        nu[:, :3] = turn(q[there] * CONJUGATE, turn(q, nu[:, :3]))
    return {
        'pose': Track('pose', '/p', ns, np.concatenate([eta[:, :3], q], axis=1), np.inf, False),
        'twist': Track('twist', '/t', stamps, nu, np.inf, False),
    }


def told_delays(tracks, frame: str = 'child') -> dict[str, tuple[float, float]]:
    """Late signal -> delay and standard error, by the notes."""
    notes = [note.split(': the ')[1].split(' s behind')[0] for note in delays(tracks, frame)]
    return {late: tuple(map(float, found.split(' ± ')))
            for late, found in (note.split(' is ') for note in notes)}  # fmt: skip


@pytest.mark.parametrize('rate', [0.0, 0.3])
def test_noise_of_a_motion_that_does_not_change_is_no_delay(rate) -> None:
    for seed in range(6):
        tracks = planar(lambda t: 1.0, lambda t: rate, 0.0, seed)
        assert not delays(tracks, 'child')


def test_a_velocity_of_a_turning_vehicle_is_late_in_the_axes_it_was_sent_in() -> None:
    for frame, surge in (
        ('child', lambda t: 0.5 + 0.2 * np.sin(0.8 * t)),
        ('world', lambda t: 0.5),
    ):
        tracks = planar(surge, lambda t: 0.5, 0.24, 0, frame, 0.2)
        value, error = told_delays(tracks, frame)['velocity']
        assert value == pytest.approx(0.24, abs=3.0 * max(error, 0.005)), frame


@pytest.mark.parametrize('first', range(0, 2000, 200))
def test_some_seconds_tell_no_delay(first: int, run) -> None:
    short = run.part(slice(first, first + 400))
    seen, ns = motion(short, enu=False), nanoseconds(short.t)
    turned = np.column_stack([seen.position, np.roll(seen.attitude, 1, axis=1)])
    nu = short.nu + np.random.default_rng(first).normal(0.0, 1e-3, short.nu.shape)
    pose, twist = (Track(role, '', ns, rows, np.inf, held=False)
                   for role, rows in (('pose', turned), ('twist', nu)))  # fmt: skip
    assert delays({'pose': pose, 'twist': twist}, 'child') == []


def test_the_frame_is_that_of_the_topic_with_the_linear_velocity() -> None:
    """Rates of a gyroscope come first, in body axes."""
    tracks = planar(lambda t: 0.5, lambda t: 0.5, 0.24, 0, 'world', 0.2)
    twist, linear = tracks['twist'], np.arange(6) < 3
    parts = [replace(twist, topic=topic, rows=np.where(has, twist.rows, np.nan))
             for topic, has in (('/imu', ~linear), ('/dvl', linear))]  # fmt: skip
    tracks['twist'] = replace(twist, parts=tuple(parts))
    sources = {
        'pose': MappedTopic('pose', '/p'),
        'twist[0]': MappedTopic('twist', '/imu'),
        'twist[1]': MappedTopic('twist', '/dvl', twist_frame='world'),
    }
    (note,) = (one for one in contradictions(tracks, twist, TopicMap(sources)) if 'behind' in one)
    assert 'the velocity is 0.24 ± 0.00 s behind' in note


def test_the_error_of_a_delay_under_noise_is_its_error() -> None:
    """Beside a true one of 0.2 s; 0.13 ± 0.00 s was told."""
    off = []
    for seed in range(6):
        found = told_delays(planar(lambda t: 0.5 + 0.2 * np.sin(0.8 * t),
                                   lambda t: 0.4 + 0.1 * np.sin(0.5 * t), 0.2, seed))  # fmt: skip
        assert set(found) == {'velocity', 'angular velocity'}
        off += [(value - 0.2) / max(error, 0.005) for value, error in found.values()]
    assert np.abs(off).max() < 3.0


@pytest.mark.parametrize('later', [-0.15, -0.3])
def test_a_wrench_that_acts_behind_its_stamps_is_told_and_taken_off(later, run, tmp_path) -> None:
    """Stamped 0.15 or 0.3 s before it acts; F shrinks when the map says so."""
    bag = bag_of(run, tmp_path, wrench_later=later)
    found = loaded(bag, **TABLES)
    (note,) = said(found, 'the wrench acts')
    value = float(note.split('acts ')[1].split(' ')[0])
    assert value == pytest.approx(-later, abs=0.03)
    keys = TABLES | {'wrench': TABLES['wrench'] | {'delay': -later}}
    mended = loaded(bag, **keys)
    assert not said(mended, 'the wrench acts')
    sizes = [np.sqrt((one.unexplained**2).mean(axis=0)) for one in (found, mended)]
    assert np.all(sizes[1] <= sizes[0])
    assert np.any(sizes[1] < 0.5 * sizes[0])


@pytest.mark.parametrize('late', [0.0, 0.12, 0.3])
def test_a_delay_is_found_beside_couplings_and_noise_and_none_where_there_is_none(
    late, tmp_path
) -> None:
    """Munk moments and restoring are larger than what the wrench changes, and noise is fed back."""
    actuators = {'lag': 0.08, 'delay': late - 0.08} if late else {'lag': 0.001}
    _, run = sea_trials.trial(tmp_path, 'bluerov2_heavy', duration=60.0, actuators=actuators)
    ns = np.round(run.t * SECOND).astype(np.int64)
    eta = np.concatenate([run.eta[:, :3], quaternion(run.eta[:, 3:])], axis=1)
    pose, twist = (Track(role, '', ns, rows, np.inf, held=False)
                   for role, rows in (('pose', eta), ('twist', run.nu)))  # fmt: skip
    found = acts_behind(pose, twist, Track('wrench', '', ns, run.tau, np.inf, held=True))
    if late:
        assert found is not None
        assert found.value == pytest.approx(late, abs=0.025)
    else:
        assert found is None


def test_a_smooth_motion_tells_no_delay_of_its_wrench() -> None:
    run = simulated(duration=20.0).part(np.delete(np.arange(2001), [5, 77, 1000]))
    seen, ns = motion(run, enu=False), nanoseconds(run.t)
    pose, twist, wrench = (
        Track(role, '', ns, rows, np.inf, held=role == 'wrench')
        for role, rows in (
            ('pose', np.column_stack([seen.position, np.roll(seen.attitude, 1, axis=1)])),
            ('twist', run.nu), ('wrench', run.tau),
        )
    )  # fmt: skip
    assert acts_behind(pose, twist, wrench) is None


def test_a_wrench_of_zeros_is_named(run, tmp_path) -> None:
    none = replace(run, tau=0.0 * run.tau)
    found = loaded(bag_of(run, tmp_path, tau=none), **TABLES)
    (note,) = said(found, 'is zero')
    assert note.startswith('force: every wrench is zero')
    one = replace(run, tau=run.tau * [0, 0, 1, 0, 0, 0])
    assert not said(loaded(bag_of(run, tmp_path / 'one', tau=one), **TABLES), 'is zero')


def test_each_wrench_of_zeros_is_named_by_its_role() -> None:
    _, twist = along_east(0.5, 0.5)
    zero = replace(twist, rows=0.0 * twist.rows)
    for role, words in (('wrench', 'wrench'), ('wrench_applied', 'wrench applied')):
        (note,) = doubts_of_wrench({'twist': zero, role: replace(zero, topic='/f')})
        assert note.startswith(f'/f: every {words} is zero')
        assert doubts_of_wrench({'twist': zero, role: twist}) == []


def test_stamps_in_bursts_are_told_and_spread(run, tmp_path) -> None:
    maker, seen = Maker(), motion(run, enu=True, keep=slice(None, None, 2))
    forces = motion(run, enu=True, keep=slice(None, None, 2))
    steps = np.arange(len(forces.t))
    burst = forces._replace(t=forces.t[steps - steps % 5] + 1e-5 * (steps % 5))  # five at once
    bag = write(tmp_path / 'dive', simple(seen, maker, '/o', '/w', UNNAMED, burst), maker)
    keys = {'odometry': '/o', 'wrench': '/w', 'frames': 'enu_flu'}
    found = loaded(bag, **keys)
    (note,) = said(found, 'bursts')
    assert note.startswith('/w: its stamps come in bursts, 80 %')
    keys['wrench'] = {'topic': '/w', 'stamps': 'uniform'}
    mended = loaded(bag, **keys)
    assert said(mended, 'spread evenly, as told')
    errors = [np.abs(one.tau - run.tau[::2][: one.samples]).mean() for one in (found, mended)]
    assert errors[1] < errors[0]


def test_stamps_are_spread_on_each_side_of_a_pause() -> None:
    ns = np.r_[np.arange(50), 5000 + np.arange(50)] * 10**7
    assert_array_equal(_evenly(ns, 1e9), ns)


def test_a_state_of_a_filter_is_no_candidate_for_thrusters(run, tmp_path) -> None:
    maker, m = Maker(), motion(run.part(slice(5)), enu=True)
    layout = maker.new('std_msgs/msg/MultiArrayLayout', [], 0)
    array = maker.new('std_msgs/msg/Float64MultiArray', layout, np.zeros(6))
    messages = simple(m, maker, '/o', '/w', UNNAMED)
    messages += [(topic, SECOND, array) for topic in ('/ekf/state', '/rov/thruster_1/pwm')]
    bag = write(tmp_path / 'dive', messages, maker)
    assert candidates(survey(bag))['thrusters'] == ['/rov/thruster_1/pwm']


@pytest.mark.parametrize(('text', 'line'), [
    ('rates: gyro\n', 'rates: expected from attitude'),
    ('wrench: {topic: /w, delay: late}\n', r'wrench.delay: expected a number \(s\), found late'),
    ('wrench: {topic: /w, stamps: even}\n', 'wrench.stamps: expected header, log or uniform'),
])  # fmt: skip
def test_what_the_map_does_not_know_is_refused(text, line, tmp_path) -> None:
    file = tmp_path / 'map.yaml'
    base = '' if 'wrench' in text else 'wrench: /w\n'
    file.write_text(f'odometry: /o\n{base}{text}')
    with pytest.raises(InputError, match=line):
        loaded(tmp_path, file)
