"""`auv replay`: a bag as live topics again; with `--law`, what another law makes of it."""

import argparse
import sys
import time
from contextlib import ExitStack
from typing import Any

from rich.progress import TextColumn

from auv_analysis.cli.graphs import (
    join_domain,
    not_negative,
    place_of,
    positive,
)
from auv_analysis.graph.domain import joined_domain
from auv_analysis.output.progress import bar, say, waiting
from auv_analysis.watch.terminal import Keyboard
from auv_dynamics.files.errors import FailedError, InputError
from auv_dynamics.ros.interface import NANOSECONDS

FASTEST = 'max'
SERVED = 0.05  # s of messages between two looks at keys
FACTOR = 2.0  # of the rate, a key
RIGHT, UP, DOWN = b'\x1b[C', b'\x1b[A', b'\x1b[B'  # arrows
KEYS = 'space: pause, go on; right: a step; up, down: faster, slower; q: end'


def replay(options: argparse.Namespace) -> dict[str, Any]:
    """Play a bag; returns what was published."""
    if options.law is not None:
        from auv_analysis.cli.replay_law import answered

        return answered(options)
    for name in ('out', 'overwrite', 'gain', 'vehicle'):
        if getattr(options, name):
            raise InputError(f'--{name}', '', '--law beside it', None)
    parameters = _parameters(options)
    domain = joined_domain(options.domain_id)
    with ExitStack() as stack:
        keyboard = stack.enter_context(Keyboard())  # from here on Ctrl-C is an end like another
        join_domain(domain)
        # the middleware reads its environment when it is loaded
        from auv_analysis.nodes.replay_node import Replay

        with waiting(f'reading {options.bag}'):
            running = Replay(domain, parameters)
        stack.callback(running.close)
        say(f'plays on {place_of(domain)}')
        for remark in running.node.remarks():
            say(remark)
        began = time.monotonic()
        _play(running, keyboard)
        document = _document(running.node, keyboard, time.monotonic() - began)
    return _concluded(document, running.node)


def _parameters(options: argparse.Namespace) -> dict[str, Any]:
    """Parameters of the node; None where its default holds."""
    fastest = options.rate == FASTEST
    return {
        'bag': str(options.bag),
        'rate': 0.0 if fastest else not_negative(options.rate, '--rate', f' or {FASTEST}'),
        'start': not_negative(options.start, '--start'),
        'duration': positive(options.duration, '--duration'),
        'loop': options.loop,
        'start_paused': options.paused,
        'skip_gaps': options.skip_gaps,
        'topics': options.topics,
        'namespace': options.namespace,
        'original_names': options.original_names,
        'commands': options.commands or options.force_commands,
        'allow_commands_to_foreign': options.force_commands,
        'all': options.all,
        'clock': not options.no_clock,
        'expected_subscribers': options.expect,
        'answers': options.answers,
    }


def _play(running: Any, keyboard: Keyboard) -> None:
    """Play until the end of the bag, or until somebody wants an end."""
    node = running.node
    player, p = node.player, node.settings
    if keyboard.there:
        say(KEYS)
    with bar(TextColumn('{task.completed:.2f} of {task.total:.2f} s')) as shown:
        task = shown.add_task('', total=(p.end - p.begin) / NANOSECONDS)
        said = ''
        while node.exit_code is None and not keyboard.ended:
            running.spin(SERVED)
            done = (player.now_ns - p.begin) / NANOSECONDS
            waits = '' if node.playing else player.waits_for()
            if waits and waits != said:
                say(f'waits: {waits}')
                said = waits
            shown.update(task, completed=done, description=_state(player, waits))
            _obey(player, keyboard.wait(0.0))


def _state(player: Any, waits: str) -> str:
    rate = player.playback.rate
    words = ['waiting' if waits else 'paused' if player.playback.paused else 'playing']
    words += [f'x {rate:g}' if rate else 'as fast as it goes']
    words += [f'loop {player.loops + 1}'] if player.loops else []
    return ', '.join(words)


def _obey(player: Any, keys: bytes) -> None:
    if b' ' in keys:
        player.run() if player.playback.paused else player.pause()
    for _ in range(keys.count(RIGHT) if player.playback.paused else 0):
        player.step()
    change = FACTOR ** (keys.count(UP) - keys.count(DOWN))
    if change != 1.0 and player.playback.rate:
        player.change_rate(player.playback.rate * change)


def _document(node: Any, keyboard: Keyboard, elapsed: float) -> dict[str, Any]:
    player, p = node.player, node.settings
    topics = {
        topic: {
            'published_as': name,
            'type': p.index.topics[topic].kind,
            'messages': player.published[topic],
        }
        for topic, name in player.names.items()
    }
    begin = (p.begin - p.index.first) / NANOSECONDS
    return {
        'bag': str(p.index.bag),
        'topics': topics,
        'left_out': p.selection.left_out,
        'messages': player.published.total(),
        'start': begin,
        'duration': (player.now_ns - p.begin) / NANOSECONDS,
        'loops': player.loops,
        'elapsed': elapsed,
        'interrupted': keyboard.ended,
        'commands_stopped': player.guard.stopped or None,
        'silent': player.silent,
        'gaps': [{'from': before, 'to': behind} for before, behind in p.gaps],
        'notes': p.index.notes,
    }


def _concluded(document: dict[str, Any], node: Any) -> dict[str, Any]:
    """Say what was done; the error where the replay did not come to its end."""
    if node.exit_code == 2:
        sys.exit(2)  # the node has said why
    text = f'{document["messages"]} messages of {len(document["topics"])} topics'
    say(f'{text}, {document["duration"]:g} s of the bag in {document["elapsed"]:.1f} s')
    if node.exit_code == 1:
        stopped = node.player.guard.stopped
        raise FailedError(f'commands were stopped: {stopped}' if stopped else node.failure)
    return document
