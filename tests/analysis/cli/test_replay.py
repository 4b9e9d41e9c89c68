"""`auv replay` in a terminal: what the keys do, and what the line says meanwhile."""

from types import SimpleNamespace

import pytest

from auv_analysis.cli.replay import DOWN, RIGHT, UP, _obey, _state


@pytest.mark.parametrize(
    ('keys', 'paused', 'rate', 'done'),
    [
        (b' ', False, 1.0, ['pause']),
        (b' ', True, 1.0, ['run']),
        (RIGHT + RIGHT, True, 1.0, ['step', 'step']),
        (RIGHT, False, 1.0, []),
        (UP + UP, False, 0.5, [2.0]),
        (DOWN, True, 0.5, [0.25]),
        (UP + DOWN, False, 1.0, []),
        (UP, False, 0.0, []),
        (b'', False, 1.0, []),
    ],
)
def test_keys_pause_step_and_change_the_rate(
    keys: bytes, paused: bool, rate: float, done: list
) -> None:
    asked: list = []
    player = SimpleNamespace(playback=SimpleNamespace(paused=paused, rate=rate))
    for name in ('run', 'pause', 'step'):
        setattr(player, name, lambda name=name: asked.append(name))
    player.change_rate = asked.append
    _obey(player, keys)
    assert asked == done


@pytest.mark.parametrize(
    ('waits', 'paused', 'rate', 'loops', 'text'),
    [
        ('odom', True, 2.0, 0, 'waiting, x 2'),
        ('', True, 0.5, 0, 'paused, x 0.5'),
        ('', False, 0.0, 1, 'playing, as fast as it goes, loop 2'),
    ],
)
def test_the_line_says_whether_how_fast_and_how_often_it_plays(
    waits: str, paused: bool, rate: float, loops: int, text: str
) -> None:
    player = SimpleNamespace(playback=SimpleNamespace(paused=paused, rate=rate), loops=loops)
    assert _state(player, waits) == text
