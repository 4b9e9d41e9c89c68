"""A sweep on a real dask scheduler with two worker processes, one of them killed half-way."""

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path

import psutil
import pytest
from helpers.sweeps import CAMPAIGN, ROLLOUTS, parts, rows, run, write_files

from auv_analysis.cli.main import main
from auv_analysis.studies.sweep.campaign import load_campaign
from auv_analysis.studies.sweep.engine import opened, sweep
from auv_analysis.studies.sweep.folder import sweep_folder
from auv_dynamics.files.errors import InputError

ADDRESS = re.compile(r'tcp://127\.0\.0\.1:\d+')


@contextmanager
def dask(*arguments: str, cwd: Path) -> Iterator[subprocess.Popen]:
    """A process of dask's command line; its log goes to stderr."""
    process = subprocess.Popen(
        [sys.executable, '-m', 'dask', *arguments], cwd=cwd, text=True, stderr=subprocess.PIPE,
        env={**os.environ, 'PYTHONUNBUFFERED': '1'},
    )  # fmt: skip
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def heard(process: subprocess.Popen, pattern: re.Pattern) -> str:
    """What matches in the process's log, as soon as it is there."""
    for line in process.stderr:
        if match := pattern.search(line):
            return match[0]
    raise AssertionError(f'{process.args} ended')


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen]]]:
    """Address of a scheduler, and two worker processes without nannies: the dead stay dead.

    They stand in another folder than the campaign: they have none of its files.
    """
    elsewhere = tmp_path / 'elsewhere'
    elsewhere.mkdir()
    local = ('--host', '127.0.0.1', '--port', '0')
    with ExitStack() as stack:
        scheduler = stack.enter_context(
            dask('scheduler', *local, '--dashboard-address', '127.0.0.1:0', cwd=elsewhere)
        )
        address = heard(scheduler, ADDRESS)
        options = ('--no-nanny', '--nthreads', '1', '--host', '127.0.0.1', '--no-dashboard')
        workers = [
            stack.enter_context(dask('worker', address, *options, cwd=elsewhere)) for _ in range(2)
        ]
        for worker in workers:
            heard(worker, re.compile('Starting established connection|Registered to'))
        yield address, workers


@pytest.fixture
def files(tmp_path: Path) -> Path:
    (tmp_path / 'here').mkdir()
    write_files(tmp_path / 'here')
    text = CAMPAIGN.replace('block: 5', 'block: 1').replace('[herman2018,', '[mine.yaml,')
    vehicle = Path(__file__).parents[2] / 'config/vehicles/herman2018.yaml'
    (tmp_path / 'here/mine.yaml').write_text(vehicle.read_text())
    (tmp_path / 'here/campaign.yaml').write_text(text)
    return tmp_path / 'here'


def killing(worker: subprocess.Popen, after: int) -> Callable[[int], None]:
    """Progress that kills a worker once so many rollouts are finished."""

    def progress(done: int) -> None:
        if done >= after and worker.poll() is None:
            worker.kill()
            worker.wait()

    return progress


@pytest.mark.long
def test_rows_are_the_same_when_a_worker_is_killed_half_way(cluster, files: Path) -> None:
    run(files, out='threads')
    address, workers = cluster
    campaign = load_campaign(files / 'campaign.yaml')
    progress = killing(workers[0], after=ROLLOUTS // 2)
    with (
        opened('dask', address, None) as (executor, in_flight),
        sweep_folder(files / 'dask', campaign, overwrite=False) as folder,
    ):
        assert in_flight() == 4
        outcome = sweep(campaign, folder, executor, in_flight, progress)
        assert in_flight() == 2
    assert workers[0].poll() is not None
    assert outcome.rollouts == ROLLOUTS
    assert parts(files / 'dask') == parts(files / 'threads')


@pytest.mark.long
def test_sweep_is_stopped_on_dask_and_finished_with_threads(cluster, files, monkeypatch, capsys):
    address, workers = cluster
    monkeypatch.chdir(files)
    campaign = load_campaign('campaign.yaml')
    run(files, out='threads')

    def interrupt(done: int) -> None:
        if done == ROLLOUTS // 2:
            raise KeyboardInterrupt

    with (
        opened(None, address, None) as (executor, in_flight),
        sweep_folder(files / 'out', campaign, overwrite=False) as folder,
        pytest.raises(RuntimeError, match='interrupted'),
    ):
        sweep(campaign, folder, executor, in_flight, interrupt)
    assert ROLLOUTS // 2 <= len(parts(files / 'out')) < ROLLOUTS
    main(['sweep', 'campaign.yaml', '--out', 'out', '--json'])
    assert parts(files / 'out') == parts(files / 'threads')
    assert all(worker.poll() is None for worker in workers)


@pytest.mark.parametrize('processes', [False, pytest.param(True, marks=pytest.mark.long)])
def test_command_starts_dask_on_this_machine(processes, files: Path, monkeypatch, capsys) -> None:
    """A worker in a process of its own takes most of ten seconds to import what it runs."""
    import distributed

    cluster = partial(distributed.LocalCluster, processes=processes)
    monkeypatch.setattr(distributed, 'LocalCluster', cluster)
    monkeypatch.chdir(files)
    main(['sweep', 'campaign.yaml', '--executor', 'dask', '--workers', '1', '--out', 'local'])
    main(['sweep', 'campaign.yaml', '--out', 'threads'])
    assert rows(files / 'local').equals(rows(files / 'threads'))


def test_dask_listens_on_the_loopback_interface_alone(monkeypatch) -> None:
    import distributed

    def listening() -> set[tuple[str, int]]:
        found = psutil.Process().net_connections('inet')
        return {one.laddr for one in found if one.status == psutil.CONN_LISTEN}

    cluster = partial(distributed.LocalCluster, processes=False)
    monkeypatch.setattr(distributed, 'LocalCluster', cluster)
    before = listening()
    with opened('dask', None, 1):
        assert {address for address, _ in listening() - before} == {'127.0.0.1'}


def test_scheduler_that_does_not_answer_is_refused(monkeypatch) -> None:
    from auv_analysis.studies.sweep import engine as executors

    monkeypatch.setattr(executors, 'PATIENCE', 0.5)
    with (
        pytest.raises(InputError, match='--scheduler: expected the address of a dask scheduler'),
        opened('dask', 'tcp://127.0.0.1:1', None),
    ):
        pass


def test_dask_that_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, 'distributed', None)
    with pytest.raises(InputError, match='pip install distributed'), opened('dask', None, 1):
        pass
