"""Bags without the beginning, the end or the middle of a run, or with a plant that was reset."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.made_messages import ODOMETRY, Bag, odometry, serialized, stamped
from numpy.testing import assert_allclose, assert_array_equal

from auv_analysis import load_scenario, summarize
from auv_analysis.bag.load import load_run, open_bag
from auv_analysis.bag.metadata import RECORDING, recording_text
from auv_analysis.bag.plant_run import longest_part, time_zero
from auv_analysis.runs.run import Run

MS, STEP = 1_000_000, 10_000_000
CASE = load_scenario('faults_bluerov2_heavy')
GAINS = {'gains.k_D': [12.0], 'gains.k_I': [1.0], 'gains.Lambda': [0.8], 'gains.Gamma': [0.0]}
START = np.array([1.0, 2.0, 3.0, 1.0, *[0.0] * 9])


def write(path: Path, numbers: Any, *, lockstep: bool = True, states: Any = None) -> Path:
    """Bag of steps, by their numbers, of a plant that was to simulate a second.

    `states`: of each step; else it goes on and on.
    """
    plant = {'step': 0.01, 'duration': 1.0, 'lockstep': lockstep, 'initial.eta': [1, 2, 3, 0, 0, 0]}
    nodes = {'plant_node': plant, 'controller_node': {'law': 'gvc', **GAINS}}
    params = {name: {'ros__parameters': values} for name, values in nodes.items()}
    bag = Bag(path, chunk_size=5000)
    texts = {**CASE.attachments, 'params.yaml': yaml.safe_dump(params)}
    for name, text in {**texts, RECORDING: recording_text(lockstep, {})}.items():
        bag.attach(name, text)
    for i, k in enumerate(numbers):
        ns, x = k * STEP, START + 0.001 * k * np.eye(13)[0] if states is None else states[i]
        bag.add('/odom', ODOMETRY, ns, serialized(odometry(ns, x)))
        for topic, kind in (('wrench', 'Wrench'), ('cmd_vel', 'Twist'), ('disturbance', 'Wrench'),
                            ('disturbance_estimate', 'Wrench')):  # fmt: skip
            value = 0.0 if topic == 'disturbance_estimate' else float(k)
            made = stamped(kind, ns, [value] * 6)
            bag.add(f'/{topic}', made.__msgtype__, ns, serialized(made))
    return bag.close()


def said(run: Run, *words: str) -> bool:
    return all(any(word in note for note in run.notes) for word in words)


def test_the_time_of_a_bag_without_its_beginning_is_that_of_the_run(tmp_path: Path) -> None:
    whole = load_run(write(tmp_path / 'whole', range(101)))
    run = load_run(write(tmp_path / 'late', range(30, 101)))
    assert_array_equal(run.t, whole.t[30:])
    assert run.faults == whole.faults != ()
    assert said(run, 'begins at 0.3 s')
    assert not said(whole, 'begins')
    assert not said(whole, 'ends')
    nothing = np.full_like(whole.disturbance_estimate, np.nan)
    assert whole.extent.knows_disturbance
    assert not replace(whole, disturbance_estimate=nothing).extent.knows_disturbance
    assert whole.unrecorded == {'measured', 'applied'}, 'faults of both, and neither topic'
    reason = 'the law had begun before the first sample: z is not known'
    assert reason in summarize(run)['lyapunov']['reason']
    assert reason not in summarize(whole)['lyapunov']['reason']


def test_in_real_time_faults_are_at_the_time_of_the_plant(tmp_path: Path) -> None:
    run = load_run(write(tmp_path / 'bag', range(30, 101), lockstep=False))
    assert run.t[0] == 0.0
    told = [(spec.get('from', 0.0), spec.get('to', np.inf)) for spec in CASE.data['faults']]
    found = [(mark.start, mark.end) for mark in run.faults]
    assert_allclose(found, np.array(told) - 0.3)


@pytest.mark.parametrize(('lockstep', 'last', 'short'), [
    (True, 101, False), (True, 100, True), (False, 100, False),
])  # fmt: skip
def test_a_bag_without_the_end_of_the_run_says_so(tmp_path, lockstep, last, short) -> None:
    run = load_run(write(tmp_path / 'bag', range(last), lockstep=lockstep))
    assert said(run, 'ends at 0.99 s of the 1 s that were planned') == short


@pytest.mark.parametrize('whole', [10, 1000])
def test_of_a_plant_that_was_reset_the_longest_part_is_judged(tmp_path: Path, whole: int) -> None:
    far = [0, 0, 0, *range(3, 40)]  # it rests in the beginning
    moving = [START + 0.01 * far[k % 40] * np.eye(13)[1] for k in range(101)]
    run = open_bag(write(tmp_path / 'bag', range(101), states=moving), whole=whole).run
    assert_array_equal(run.eta[:, 1], 2.0 + 0.01 * np.array(far))
    assert run.t[0] == 0.0
    assert said(run, 'the plant was reset at 0.4, 0.8 s; read the longest of 3 parts')
    moving[:60] = [START] * 60
    later = load_run(write(tmp_path / 'later', range(101), states=moving))
    assert (later.t[0], later.samples) == (0.0, 80)


def test_slopes_do_not_lead_across_gaps_and_know_uneven_steps(tmp_path: Path) -> None:
    numbers = [*range(0, 20), *range(21, 40), *range(80, 101)]
    run = load_run(write(tmp_path / 'bag', numbers))
    assert run.gaps == ((0.39, 0.8),)
    assert_allclose(run.nu_d_dot, 100.0)  # one more m/s in each step of 10 ms
    squares = write(tmp_path / 'alone', [*range(0, 40), 90])
    slopes = load_run(squares).nu_d_dot
    assert_allclose(slopes[:-1], 100.0)
    assert np.isnan(slopes[-1]).all(), 'no neighbour, no slope'


def test_of_a_bag_that_was_thinned_the_integrals_are_not_known(tmp_path: Path) -> None:
    run = load_run(write(tmp_path / 'thin', range(0, 101, 5)))
    assert (run.step, run.gaps) == (0.01, ())
    assert said(run, 'samples are 0.05 s apart, in a run of steps of 0.01 s')
    assert 'samples of the law are missing: z is not known' in summarize(run)['lyapunov']['reason']
    one = load_run(write(tmp_path / 'one', [*range(50), *range(51, 101)]))
    assert not said(one, 'apart')
    assert 'samples of the law are missing' in summarize(one)['lyapunov']['reason']


@pytest.mark.parametrize('plant', [
    {}, {'duration': 1.0}, {'step': 0.01}, {'step': '0.01', 'duration': 1.0},
    {'step': 0.01, 'duration': 'long'}, {'step': 0.01, 'duration': 0.1}, {'lockstep': True},
])  # fmt: skip
def test_of_a_run_whose_plan_is_not_known_or_of_another_one_nothing_is_missing(plant) -> None:
    assert time_zero(np.array([3, 4, 5]) * 100 * MS, plant) == (300 * MS, [])


def test_resets_are_looked_for_where_a_plant_was_and_some_are_named() -> None:
    ns, x = np.arange(12) * STEP, np.zeros((12, 13))
    x[:, 3], x[:, 0] = 1.0, [0, 1, 0, 2, 0, 1, 0, 2, 3, 0, 1, 0]
    kept, (note,) = longest_part(ns, {'odom': x}, {'step': 0.01}, STEP)
    assert kept == slice(6, 9)
    assert '0.01, 0.03, 0.05 s and 2 times more; read the longest of 6 parts' in note
    for plant in ({}, {'initial.eta': 'far'}, {'initial.nu': [0.0]}):
        assert longest_part(ns, {'odom': x}, plant, 0) == (slice(None), [])
    assert longest_part(ns, {'odom': x, 'ground_truth/odom': x[:1]}, {'step': 0.01}, 0)[1] == []
