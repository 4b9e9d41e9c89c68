"""Keys that are pressed in a terminal, and when there are none to be had."""

import os
import pty
import sys
from collections.abc import Iterator

import pytest

from auv_analysis.output.keyboard import Keyboard


@pytest.fixture
def keys(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """The other end of a terminal that is standard input."""
    ours, its = pty.openpty()
    with os.fdopen(its) as terminal:
        monkeypatch.setattr(sys, 'stdin', terminal)
        yield ours
    os.close(ours)


@pytest.mark.parametrize(('key', 'ended'), [(b'q', True), (b'Q', True), (b' ', False)])
def test_q_ends_it_also_where_caps_are_locked(keys: int, key: bytes, ended: bool) -> None:
    with Keyboard() as keyboard:
        os.write(keys, key)
        assert keyboard.wait(60.0) == key
    assert keyboard.ended == ended


def test_a_terminal_that_is_closed_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    ours, its = pty.openpty()
    with os.fdopen(its) as terminal:
        monkeypatch.setattr(sys, 'stdin', terminal)
        with Keyboard() as keyboard:
            os.close(ours)
            assert keyboard.wait(60.0) == b''
    assert keyboard.ended


@pytest.mark.usefixtures('keys')
@pytest.mark.parametrize('behind', [0, 1])
def test_a_command_in_the_background_asks_for_no_keys(behind: int, monkeypatch) -> None:
    """It would be stopped."""
    monkeypatch.setattr(os, 'tcgetpgrp', lambda _: os.getpgrp() + behind)
    assert Keyboard().there == (not behind)
