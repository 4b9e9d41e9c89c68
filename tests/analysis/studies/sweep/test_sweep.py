"""A sweep: the figures of its simulations, the same rows whatever runs it, bounded work ahead."""

import math
import os
from collections.abc import Callable
from concurrent.futures import CancelledError, Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from threading import Event

import numpy as np
import pyarrow as pa
import pytest
import yaml
from helpers.patience import patience
from helpers.sweeps import CAMPAIGN, ROLLOUTS, SCENARIO, Counting, parts, rows, run, write_files

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.studies.sweep import engine as sweep_block
from auv_analysis.studies.sweep.campaign import load_campaign
from auv_analysis.studies.sweep.engine import Outcome, SweepStoppedError, opened, sweep
from auv_analysis.studies.sweep.engine import _column as column
from auv_analysis.studies.sweep.folder import sweep_folder
from auv_dynamics.files.errors import InputError
from auv_dynamics.vehicle import DOFS


@pytest.fixture
def files(tmp_path: Path) -> Path:
    return write_files(tmp_path)


SENSORS = {'continuous': '', 'zoh': 'sensors: {velocity_noise: 0.01}\n'}


@pytest.mark.parametrize('hold', SENSORS)
def test_rows_are_the_figures_of_their_simulations(hold: str, files: Path) -> None:
    (files / 'scenario.yaml').write_text(SCENARIO + SENSORS[hold])
    (files / 'campaign.yaml').write_text(f'{CAMPAIGN}hold: {hold}\n')
    outcome = run(files)
    assert (outcome.rollouts, outcome.before) == (ROLLOUTS, 0)
    assert outcome.counts == {('gvc', 'ok'): ROLLOUTS, ('cl', 'ok'): ROLLOUTS}
    table = rows(files / 'out').to_pylist()
    assert [(r['controller'], r['index']) for r in table] == [
        (name, i) for name in ('cl', 'gvc') for i in range(ROLLOUTS)
    ]
    scenario = load_scenario(files / 'scenario.yaml')
    for row in table[::5]:
        name = row['controller']
        values = {'vehicle': row['vehicle'], f'controllers.{name}.k_D': row['controllers.*.k_D']}
        for path in ('vehicle.damping.linear[0]', 'setpoint.surge.offset', 'seed'):
            values[path] = row[path]
        summary = summarize(simulate(changed_scenario(scenario, values), name, hold))
        assert row['kinetic_energy.mean'] == pytest.approx(summary['kinetic_energy']['mean'])
        for i, dof in enumerate(DOFS):
            for group, key in (('velocity_error', 'rms'), ('effort', 'max'),
                               ('velocity_error', 'settling_time')):  # fmt: skip
                known = summary[group][key][i]
                assert row[f'{group}.{key}.{dof}'] == (
                    None if known is None else pytest.approx(known, rel=1e-9, abs=1e-12)
                )


def test_vehicles_that_alternate_keep_their_rows(files: Path) -> None:
    contents = sweep_block.contents_of(load_campaign(files / 'campaign.yaml'))

    def efforts(names: list[str], seeds: np.ndarray) -> list[float]:
        changes = {'vehicle': names}
        found = sweep_block.block_figures(contents, ['gvc'], 'continuous', changes, seeds)
        return found['gvc']['effort.rms.heave'].tolist()

    names = ['herman2018', *['herman2018_neutral'] * 2, 'herman2018']
    alone = [efforts([name], np.array([i]))[0] for i, name in enumerate(names)]
    assert efforts(names, np.arange(4)) == pytest.approx(alone)
    assert alone[0] != pytest.approx(alone[1], rel=0.01)


def test_a_vehicle_that_other_values_make_valid_is_swept(files: Path) -> None:
    thrusters = 'actuators: {thrusters: true}\n'
    text = SCENARIO.replace('herman2018', 'bluerov2_heavy', 1) + thrusters
    (files / 'scenario.yaml').write_text(text)
    axes = {
        'vehicle': ['bluerov2_heavy', 'rexrov', 'rexrov'],
        'actuators.thrusters': [True, False, True],
        'vehicle.rigid_body.center_of_gravity[2]': [0.02, 0.03, 0.03],
    }
    data = {'name': 'x', 'scenario': 'scenario.yaml', 'hold': 'zoh', 'controllers': ['cl']}
    (files / 'campaign.yaml').write_text(yaml.safe_dump(data | {'vary': [{'zip': axes}]}))
    run(files)
    table = rows(files / 'out').to_pylist()
    assert [row['status'] for row in table] == ['ok', 'ok', 'refused']
    assert 'rexrov has none' in table[2]['reason']
    values = {path: column[1] for path, column in axes.items()}
    single = changed_scenario(load_scenario(files / 'scenario.yaml'), values)
    expected = summarize(simulate(single, 'cl', 'zoh'))['effort']['rms'][0]
    assert table[1]['effort.rms.surge'] == pytest.approx(expected)


def test_a_worker_needs_no_file_of_the_set_point(files: Path) -> None:
    way = files / 'way.csv'
    way.write_text('t,surge,sway,heave,roll,pitch,yaw\n0,0,0,0,0,0,0\n1,0.5,0,0.2,0,0,0.1\n')
    scenario = yaml.safe_load(SCENARIO) | {'setpoint': {'file': 'way.csv'}}
    (files / 'scenario.yaml').write_text(yaml.safe_dump(scenario))
    grid = 'name: x\nscenario: scenario.yaml\nvary: [{grid: {controllers.*.k_D: [6, 12.0]}}]'
    (files / 'campaign.yaml').write_text(grid)
    contents = sweep_block.contents_of(load_campaign(files / 'campaign.yaml'))
    way.unlink()
    found = sweep_block.scenario_of(contents, '').setpoint.value(0.2)
    np.testing.assert_allclose(found, [0.1, 0, 0.04, 0, 0, 0.02])


def test_rows_do_not_depend_on_blocks_workers_or_processes(files: Path) -> None:
    run(files)
    reference = rows(files / 'out')
    text = (files / 'campaign.yaml').read_text()
    for out, block, executor, ahead in (
        ('single', 1, ThreadPoolExecutor(3), 7),
        ('whole', 16, ThreadPoolExecutor(1), 1),
        ('processes', 3, ProcessPoolExecutor(1, get_context('spawn')), 4),
    ):
        (files / 'campaign.yaml').write_text(text.replace('block: 5', f'block: {block}'))
        with executor:
            run(files, executor, out, ahead)
        assert rows(files / out).equals(reference)
        assert len(parts(files / out)) == math.ceil(ROLLOUTS / block)


@pytest.mark.parametrize('ahead', [1, 3])
def test_no_more_blocks_are_under_way_than_allowed(ahead: int, files: Path) -> None:
    text = CAMPAIGN.replace('block: 5', 'block: 1').replace('count: 4', 'count: 2')
    (files / 'campaign.yaml').write_text(text)
    executor = Counting()
    run(files, executor, ahead=ahead)
    assert (executor.submitted, executor.most <= ahead) == (ROLLOUTS // 2, True)


def test_worker_with_other_versions_is_refused(files: Path, monkeypatch) -> None:
    campaign = load_campaign(files / 'campaign.yaml')
    contents = sweep_block.contents_of(campaign)
    there = {**sweep_block.versions(), 'numba': 'another', 'sources': 'x'}
    monkeypatch.setattr(sweep_block, 'versions', lambda: there)
    with pytest.raises(sweep_block.BlockError, match='found another sources, numba'):
        sweep_block.block_figures(contents, ['gvc'], 'continuous', {}, campaign.seeds(0, 1))


def test_worker_that_lacks_a_law_says_so(files: Path, monkeypatch) -> None:
    def lacking(*_) -> None:
        raise InputError('s.yaml', 'controllers.mine.law', 'a module', 'mine:Law')

    monkeypatch.setattr(sweep_block, '_figures', lacking)
    with pytest.raises(SweepStoppedError, match=r'^a worker cannot run this: s.yaml: controllers'):
        run(files)


Lost = type('Lost', (Exception,), {'__module__': 'distributed.scheduler'})


@pytest.mark.parametrize(
    ('error', 'line'),
    [
        (Lost('tcp://1.2.3.4'), 'the workers are lost (Lost)'),
        (CancelledError(), 'the workers are lost (CancelledError)'),
        (BrokenProcessPool('one is gone'), 'the workers are lost (BrokenProcessPool)'),
        (OSError('no space\nleft'), 'no space'),
        (ZeroDivisionError('of a law'), 'of a law'),
        (sweep_block.BlockError('other versions'), 'other versions'),
        (KeyError('a fault of the program'), None),
    ],
    ids=repr,
)
def test_what_stops_a_sweep_is_said_and_a_fault_of_the_program_is_none(
    error: Exception, line: str | None, files: Path, monkeypatch
) -> None:
    def fail(*_) -> None:
        raise error

    monkeypatch.setattr(sweep_block, 'block_figures', fail)
    with pytest.raises(SweepStoppedError if line else KeyError) as stopped:
        run(files)
    assert line is None or str(stopped.value) == line


class Busy(ThreadPoolExecutor):
    """Ctrl-C comes while the first block runs and the second waits, which is then let go."""

    def __init__(self) -> None:
        super().__init__(1)
        self.begun, self.dropped, self.waits = Event(), Event(), []

    def submit(self, function: Callable, /, *args: object) -> Future:
        if len(self.waits) == 2:
            assert self.begun.wait(patience(60.0))
            raise KeyboardInterrupt
        self.waits.append(super().submit(self._late, function, *args))
        self.waits[-1].add_done_callback(lambda future: future.cancelled() and self.dropped.set())
        return self.waits[-1]

    def _late(self, function: Callable, *args: object) -> object:
        self.begun.set()
        self.dropped.wait(patience(60.0))
        return function(*args)


def test_an_interrupt_keeps_the_block_that_runs_and_drops_the_one_that_waits(files: Path) -> None:
    with pytest.raises(SweepStoppedError, match='interrupted'):
        run(files, Busy(), ahead=4)
    assert list(parts(files / 'out')) == ['part-00000000.parquet']


def test_progress_is_told_in_finished_rollouts(files: Path) -> None:
    campaign, told = load_campaign(files / 'campaign.yaml'), []
    with sweep_folder(files / 'out', campaign, overwrite=False) as folder:
        sweep(campaign, folder, ThreadPoolExecutor(1), lambda: 1, told.append)
    assert told == [5, 10, 15, 16]
    (files / 'out/rollouts/part-00000001.parquet').unlink()
    with sweep_folder(files / 'out', campaign, overwrite=False) as folder:
        found = sweep(campaign, folder, ThreadPoolExecutor(1), lambda: 1, told.append)
    assert told[4:] == [5, 10, 11, 16], 'what was there already counts'
    assert (found.before, found.rollouts) == (11, 16)


def test_an_outcome_keeps_the_first_reason_of_what_was_refused() -> None:
    found = Outcome()
    for status, reason in ((['ok', 'diverged'], ['', 'not finite']),
                           (['refused', 'diverged'], ['too light', 'later']),
                           (['refused', 'refused'], ['too heavy', 'again'])):  # fmt: skip
        rows = {'controller': ['gvc', 'cl'], 'status': status, 'reason': reason}
        found.add(pa.table(rows), 2)
    assert (found.reason, found.rollouts) == ('too light', 3)
    assert found.counts == {('gvc', 'ok'): 1, ('gvc', 'refused'): 2, ('cl', 'diverged'): 2,
                            ('cl', 'refused'): 1}  # fmt: skip


@pytest.mark.parametrize(
    ('options', 'line'),
    [
        (('threads', 'tcp://a:1', None), '--scheduler: expected no scheduler .*, found tcp://a:1'),
        ((None, 'tcp://a:1', 3), '--workers: expected no number beside --scheduler: .*, found 3'),
    ],
)
def test_executors_that_contradict_themselves_are_refused(options, line: str) -> None:
    with pytest.raises(InputError, match=line), opened(*options):
        pass


@pytest.mark.parametrize('kind', [None, 'threads'])
def test_each_thread_has_a_block_and_one_that_waits(kind: str | None) -> None:
    cores = len(os.sched_getaffinity(0))
    for workers, count in ((3, 3), (None, cores)):
        with opened(kind, None, workers) as (executor, in_flight):
            assert isinstance(executor, ThreadPoolExecutor)
            assert (executor._max_workers, in_flight()) == (count, 2 * count)
        with pytest.raises(RuntimeError, match='shutdown'):
            executor.submit(int)


@pytest.mark.parametrize(
    'values',
    [['a', '', 'grün'], [[1.0, 2.0], [3.0]], [[[1.0], [2.0]], [[3.0], [4.0]]], [[1, 2]]],
)
def test_columns_of_words_and_lists(values: list) -> None:
    made = column(values)
    made.validate(full=True)
    assert made.to_pylist() == values
