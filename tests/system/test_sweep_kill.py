"""`auv sweep` killed at any moment: the same command goes on, nothing is lost or done twice."""

import random
import signal
import time
from pathlib import Path

import pytest
from helpers.fork_server import Process
from helpers.node_processes import start_auv
from helpers.patience import patience
from helpers.sweeps import CAMPAIGN, parts, write_files

BLOCKS = 48
PATIENCE = patience(
    600.0
)  # s, after which a test that waits has failed: the first process compiles


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A campaign of many blocks: a process is killed long before its last one."""
    write_files(tmp_path)
    text = CAMPAIGN.replace('block: 5', 'block: 2').replace('count: 4', 'count: 24')
    (tmp_path / 'campaign.yaml').write_text(text)
    return tmp_path


def start(files: Path, out: str) -> Process:
    return start_auv('sweep', 'campaign.yaml', '--workers', '2', '--out', out, cwd=files)


def stamps(folder: Path) -> dict[str, tuple[int, int]]:
    """What shows whether a finished part was written again."""
    listed = (folder / 'rollouts').glob('part-*.parquet')
    return {path.name: (path.stat().st_ino, path.stat().st_mtime_ns) for path in listed}


def wait_for_parts(process: Process, folder: Path, count: int) -> None:
    until = time.monotonic() + PATIENCE
    while len(stamps(folder)) < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < until
        time.sleep(0.005)  # a part takes longer


def finish(files: Path, out: str) -> list[str]:
    """Run to the end; the lines of stderr."""
    process = start(files, out)
    _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, errors
    return errors.splitlines()


def test_killed_sweep_goes_on_without_losing_or_repeating(files: Path) -> None:
    assert "pandas.read_parquet('whole/rollouts')" in finish(files, 'whole')[-1]
    generator, out = random.Random(1), files / 'killed'
    begun = start(files, 'killed')  # killed once before anything is finished
    begun.kill()
    begun.communicate()
    for _ in range(2):
        before = stamps(out)
        process = start(files, 'killed')
        wait_for_parts(process, out, len(before) + generator.randint(1, 9))
        process.kill()
        process.communicate()
        after = stamps(out)
        assert len(before) < len(after) < BLOCKS
        assert before.items() <= after.items()
    finish(files, 'killed')
    assert after.items() <= stamps(out).items()
    assert len(stamps(out)) == BLOCKS
    assert parts(out) == parts(files / 'whole')
    assert not list(out.rglob('.*'))  # nothing unfinished is left


@pytest.mark.long
def test_interrupt_ends_in_one_line_that_says_how_to_go_on(files: Path) -> None:
    process = start(files, 'out')
    wait_for_parts(process, files / 'out', 3)
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=PATIENCE)
    kept = stamps(files / 'out')
    assert (process.returncode, output) == (1, '')
    line = errors.splitlines()[-1]
    rollouts = f'{2 * len(kept)} of {2 * BLOCKS} rollouts'
    assert line == f'out: interrupted; {rollouts} are finished, the same command goes on from there'
    assert 'Traceback' not in errors
    finish(files, 'out')
    assert kept.items() <= stamps(files / 'out').items()
    assert len(stamps(files / 'out')) == BLOCKS
