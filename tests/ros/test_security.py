"""DDS security as it is asked for: with which keys it is tried, and what is said where it fails."""

import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import pytest

from auv_dynamics.files.errors import InputError
from auv_dynamics.ros.security import ENABLE, KEYSTORE, STRATEGY, TRIAL, asked, require


@pytest.fixture(autouse=True)
def enforced(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in ((ENABLE, 'true'), (STRATEGY, 'Enforce'), (KEYSTORE, '/keys')):
        monkeypatch.setenv(name, value)


def test_security_that_is_enforced_with_keys_is_as_it_should_be(capsys) -> None:
    assert asked()
    assert capsys.readouterr().err == ''


def test_security_that_is_switched_off_is_none(monkeypatch) -> None:
    monkeypatch.setenv(ENABLE, 'false')
    assert not asked()


def test_security_that_is_not_enforced_needs_no_keys_and_is_warned_of(monkeypatch, capsys) -> None:
    monkeypatch.setenv(STRATEGY, 'Permissive')
    monkeypatch.delenv(KEYSTORE)
    assert asked()
    assert 'not Enforce' in capsys.readouterr().err


@pytest.fixture
def trial(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """The process that tries to join: how it ends, and the commands it was started with."""
    made = SimpleNamespace(returncode=0, stderr='', commands=[])

    def run(command: list[str], **_: Any) -> SimpleNamespace:
        made.commands.append(command)
        return made

    monkeypatch.setattr(subprocess, 'run', run)
    return made


def test_it_is_tried_with_the_keys_of_the_executable(trial: SimpleNamespace) -> None:
    require('auv')
    enclave = ['--ros-args', '--enclave', '/auv_gvc/auv']
    assert trial.commands == [[sys.executable, '-c', TRIAL, *enclave]]


@pytest.mark.parametrize(
    ('said', 'found'),
    [
        ('OSError: first\nRCLError: no such Error: second\nat a line', 'no such Error: second'),
        ('Segmentation fault', 'a crash'),
        ('', 'a crash'),
    ],
)
def test_the_last_error_of_the_trial_is_told_or_its_crash(trial, said, found) -> None:
    trial.returncode, trial.stderr = 1, said
    with pytest.raises(InputError) as caught:
        require('auv')
    error = caught.value
    assert (error.file, error.found) == ('ROS_SECURITY_ENABLE=true', found)
    assert error.expected == 'a middleware with DDS security, and keys of /auv_gvc/auv'
