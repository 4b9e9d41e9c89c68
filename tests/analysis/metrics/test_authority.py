"""Commands above the weight, above the thrusters, and where there are none, are remarked on."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis.cli.main import main
from auv_analysis.metrics.authority import beyond_authority, both_ways
from auv_dynamics import load_vehicle
from auv_dynamics.files.shipped import shipped
from auv_dynamics.vehicle.thrusters import Thrusters
from auv_dynamics.vehicle.vehicle import Vehicle


def test_the_largest_wrench_is_that_of_the_best_thrusts() -> None:
    thrusters = load_vehicle('bluerov2').thrusters
    rng = np.random.default_rng(2)
    u = rng.uniform(-thrusters.reverse, thrusters.forward, (2000, len(thrusters.names)))
    found = thrusters.largest()
    assert np.all(np.abs(u @ thrusters.matrix.T) <= found + 1e-9)
    for i, row in enumerate(thrusters.matrix):
        best = np.where(row > 0, thrusters.forward, -thrusters.reverse)
        worst = np.where(row > 0, -thrusters.reverse, thrusters.forward)
        assert_allclose(found[i], max(row @ best, -(row @ worst)))


@pytest.mark.parametrize(
    ('largest', 'words'),
    [
        ([1.0, 0, 1, 0, 0, 0.1], []),
        ([1.0, 0, 1, 0, 1e-12, 0.1], []),
        ([0.0, 0, 0, 0, 1e-12, 0.1], []),  # rounding of a moment, though there is no force
        ([1.0, None, 1, None, None, 0.1], []),
        ([1.0, 0, 1, 0.1, 0.2, 0.1], ['pitch (up to 0.200 N m, not apart from surge and heave)']),
        # much more than rounding of the moments, and less than that of the force
        ([100.0, 0, 0, 0, 5e-5, 0.1], ['and heave) is commanded, which no thruster actuates']),
        ([0.0, 0, 0, 0, 1e3, 0], ['pitch (up to 1\u202f000 N m, ']),  # no thruster is too weak
        (
            [1e3, 0, 150, 0, 0, 0],
            [
                'N in surge, is 8.9 times the weight',
                'can give: 1\u202f000 of at most 130 N in surge and 150 of at most 103 N in heave',
            ],
        ),
    ],
)
def test_what_is_remarkable_of_the_largest_commands(largest, words) -> None:
    vehicle = load_vehicle('bluerov2')
    assert list(vehicle.thrusters.unactuated()) == ['pitch']
    found = beyond_authority(vehicle, largest)
    assert len(found) == len(words)
    assert all(word in text for word, text in zip(words, found, strict=True))


def with_propeller(reverse: float, forward: float) -> Vehicle:
    """A vehicle that surges and can do nothing else."""
    limits = np.array([reverse]), np.array([forward])
    thrusters = Thrusters(('P',), np.eye(6)[:, :1], *limits)
    return load_vehicle('rexrov').changed(thrusters=thrusters)


@pytest.mark.parametrize(
    ('least', 'most', 'text'),
    [(-4.0, 24.0, []), (-5.0, 25.0, []), (-9.0, 24.0, ['-9.00 of at most -5.00 N in surge']),
     (-30.0, 24.0, ['30.0 of at most 25.0 N in surge']),
     (np.nan, np.nan, [])],
)  # fmt: skip
def test_a_propeller_weaker_astern_is_judged_astern(least, most, text) -> None:
    vehicle = with_propeller(5.0, 25.0)
    ways = [value * np.eye(6)[0] for value in (least, most)]
    largest = [np.nan_to_num(max(abs(least), abs(most))), 0, 0, 0, 0, 0]
    found = beyond_authority(vehicle, largest, ways)
    assert [line.partition('give: ')[2].replace('\N{MINUS SIGN}', '-') for line in found] == text


def test_what_no_thruster_gives_is_held_against_commands_of_its_kind() -> None:
    """5e-6 is rounding beside 10 N and none beside 1 N m."""
    (text,) = beyond_authority(with_propeller(50.0, 50.0), [10.0, 2.0, 5e-6, 5e-6, 0.0, 1.0])
    asked = [('sway', 'N'), ('roll', 'N m'), ('yaw', 'N m')]
    assert re.findall(r'(\w+) \(up to \S+ ([N m]+)\)', text) == asked
    assert 'are commanded, which no thruster actuates: T has rank 1 of 6' in text


def test_both_ways_are_those_of_the_whole_run() -> None:
    blocks = [SimpleNamespace(tau=np.outer(u, np.arange(1.0, 7.0))) for u in ([2, -1], [5, 3])]
    least, most = both_ways(SimpleNamespace(blocks=lambda: blocks))
    assert_array_equal(least, -np.arange(1.0, 7.0))
    assert_array_equal(most, 5 * np.arange(1.0, 7.0))


def test_without_thrusters_only_the_weight_is_known() -> None:
    vehicle = load_vehicle('rexrov')
    assert beyond_authority(vehicle, [1.0, 0, 0, 9e9, 0, 0]) == []
    assert beyond_authority(vehicle, [vehicle.weight, 0, 0, 0, 0, 0]) == []
    (text,) = beyond_authority(vehicle, [0.0, 0, 3 * vehicle.weight, 0, 0, 0])
    assert 'in heave, is 3.0 times the weight' in text


@pytest.mark.usefixtures('undrawn')
def test_a_study_of_a_vehicle_says_what_no_thruster_actuates(tmp_path, capsys) -> None:
    data = yaml.safe_load(shipped('scenarios', 'case1_bluerov2').read_text())
    (tmp_path / 'short.yaml').write_text(yaml.safe_dump(data | {'duration': 2.5}))
    out = tmp_path / 'out'
    words = ['--controller', 'gvc', '--sensitivity', 'none', '--out', str(out)]
    main(['study', str(tmp_path / 'short.yaml'), *words])
    assert 'which no thruster actuates: T has rank 5 of 6' in ' '.join(
        ''.join(capsys.readouterr()).split()
    )
    assert 'which no thruster actuates' in (out / 'report.html').read_text()
