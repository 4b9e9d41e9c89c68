"""`auv replay`: a bag as live topics again; with `--law`, what another law would have commanded."""

from __future__ import annotations

import argparse
import math
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from auv_analysis.cli.arguments import (
    add_domain,
    add_results,
    import_law,
    number,
    refuse_given,
    refused,
)
from auv_dynamics.files.errors import FailedError

if TYPE_CHECKING:
    from auv_analysis.output.keyboard import Keyboard
    from auv_analysis.replay.open_loop import OpenLoop, RecordedLoop

FASTEST = 'max'
SERVED = 0.05  # s of messages between two looks at keys
FACTOR = 2.0  # of the rate, a key
RIGHT, UP, DOWN = b'\x1b[C', b'\x1b[A', b'\x1b[B'  # arrows
KEYS = 'space: pause, go on; right: a step; up, down: faster, slower; q: end'
DOCUMENT = 'open_loop.json'
NANOSECONDS = 1e9
PLAYED = (
    'rate', 'start', 'duration', 'loop', 'paused', 'skip_gaps', 'topics', 'original_names',
    'commands', 'force_commands', 'all', 'no_clock', 'expect', 'answers',
    'domain_id',
)  # fmt: skip


def add_arguments(command: argparse.ArgumentParser) -> None:
    """What of a bag is played and how; or the law that is asked in place of the recorded one."""
    add_results(command)
    add = command.add_argument
    add('bag', type=Path, metavar='BAG', help='a bag folder or an .mcap file')
    text = 's of the bag per s, or max: as fast as it goes without loss; default: 1'
    add('--rate', type=_rate, metavar='R', help=text)
    text = 'offset from the beginning of the bag, s'
    add('--start', type=number(at_least=0), metavar='S', help=text)
    add('--duration', type=number(above=0), metavar='S', help='length that is played, s')
    add('--loop', action='store_true', help='begin again at its end')
    add('--paused', action='store_true', help='begin paused')
    text = 'jump where nothing was recorded for more than a minute'
    add('--skip-gaps', action='store_true', help=text)
    text = 'recorded names or patterns; default: all'
    add('--topics', nargs='+', metavar='TOPIC', help=text)
    names = command.add_mutually_exclusive_group()
    text = 'before the recorded names, default: replay; with --law that of the recorded vehicle'
    names.add_argument('--namespace', metavar='NAME', help=text)
    names.add_argument('--original-names', action='store_true', help='as they were recorded')
    text = 'commands as well where a vehicle may listen: outside of /replay'
    add('--commands', action='store_true', help=text)
    text = 'even where a foreign node acts on them'
    add('--force-commands', action='store_true', help=text)
    text = 'also analysis, diagnostics, progress and clock as recorded'
    add('--all', action='store_true', help=text)
    add('--no-clock', action='store_true', help='publish no /clock')
    text = 'TOPIC=COUNT: wait for so many subscribers; may be repeated'
    add('--expect', action='append', metavar='TOPIC=COUNT', help=text)
    text = 'lock-step: odometry waits for the wrench on this topic with the stamp of the last'
    add('--answers', metavar='TOPIC', help=text)
    add_domain(command)
    group = command.add_argument_group('what another law would have commanded, without nodes')
    text = 'law on the recorded odometry and set-points: gvc, cl, pid, smc or module:Class'
    group.add_argument('--law', help=text)
    text = 'NAME=VALUE of 1, 6 or 36 numbers, with commas; default: as recorded; may be repeated'
    group.add_argument('--gain', type=_gain, action='append', metavar='NAME=VALUE', help=text)
    group.add_argument('--vehicle', help='vehicle file, for bags without their own')


def _rate(text: str) -> float:
    """S of the bag per s; 0 for as fast as it goes."""
    return 0.0 if text == FASTEST else number(at_least=0, words=f' or {FASTEST}')(text)


def _gain(text: str) -> tuple[str, float | list[float]]:
    name, _, values = text.partition('=')
    try:
        numbers = [float(part) for part in values.split(',')]
    except ValueError:
        numbers = []
    if not name or not numbers or not all(map(math.isfinite, numbers)):
        raise refused('NAME=VALUE of 1, 6 or 36 numbers with commas between them', text)
    return name, numbers[0] if len(numbers) == 1 else numbers


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Play a bag, or ask a law; returns what was published or would have been commanded."""
    if options.law is not None:
        refuse_given(options, PLAYED, 'no --law beside it: it takes the whole bag', options.law)
        return _open_loop(options)
    refuse_given(options, ('out', 'overwrite', 'gain', 'vehicle'), '--law beside it', None)
    from auv_analysis.graph.domain import join_domain, place_of
    from auv_analysis.output.keyboard import Keyboard
    from auv_analysis.output.progress import say, waiting

    with ExitStack() as stack:
        keyboard = stack.enter_context(Keyboard())  # from here on Ctrl-C is an end like another
        domain = join_domain(options.domain_id)
        # the middleware reads its environment when it is loaded
        from auv_analysis.nodes.replay_node import Replay

        with waiting(f'reading {options.bag}'):
            running = Replay(domain, _parameters(options))
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
    return {
        'bag': str(options.bag),
        'rate': options.rate,
        'start': options.start,
        'duration': options.duration,
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
    from rich.progress import TextColumn

    from auv_analysis.output.progress import bar, say

    node = running.node
    player, p = node.player, node.plan
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
    player, p = node.player, node.plan
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
        'silent': player.receivers.silent,
        'gaps': [{'from': before, 'to': behind} for before, behind in p.gaps],
        'notes': p.index.notes,
    }


def _concluded(document: dict[str, Any], node: Any) -> dict[str, Any]:
    """Say what was done; the error where the replay did not come to its end."""
    from auv_analysis.output.progress import say

    if node.exit_code == 2:
        sys.exit(2)  # the node has said why
    text = f'{document["messages"]} messages of {len(document["topics"])} topics'
    loops = f'{document["loops"]} loops and ' if node.plan.settings.loop else ''
    say(f'{text}, {loops}{document["duration"]:g} s of the bag in {document["elapsed"]:.1f} s')
    if node.exit_code == 1:
        stopped = node.player.guard.stopped
        raise FailedError(f'commands were stopped: {stopped}' if stopped else node.failure)
    return document


def _open_loop(options: argparse.Namespace) -> dict[str, Any]:
    """Compute the wrench of another law; returns metrics of both wrenches."""
    from auv_analysis.output.folder import check_free, results_folder
    from auv_analysis.output.new_files import write_json
    from auv_analysis.output.progress import say, waiting
    from auv_analysis.replay.compared import ask_law, draw
    from auv_analysis.replay.open_loop import recorded_loop

    if options.out:
        check_free(options.out, overwrite=options.overwrite, inputs=[options.bag])
    import_law(options.law)
    with waiting(f'reading {options.bag}'):
        recorded = recorded_loop(options.bag, options.vehicle, options.namespace)
    document, both = ask_law(recorded, options.law, dict(options.gain or ()), _answers)
    document['bag'] = str(options.bag)
    law = options.law.replace(':', '_').replace('.', '_').replace('/', '_')
    name = f'replay_{recorded.scenario}_{recorded.name}_{law}'
    out = options.out or Path('runs') / name
    with results_folder(out, overwrite=options.overwrite, inputs=[options.bag]) as results:
        write_json(results.folder / DOCUMENT, document)
        with waiting('drawing the plot'):
            drawn = draw(document, both, results.folder / 'figures')
    _show(document)
    say(f'figure: {out / drawn.relative_to(results.folder)}')
    if document['reproduced'] is False:
        raise FailedError(f'{options.bag}: {document["reproduction"]}', document)
    return document


def _answers(recorded: RecordedLoop, law: str, gains: dict[str, Any]) -> OpenLoop:
    from auv_analysis.output.progress import bar, count
    from auv_analysis.replay.open_loop import open_loop

    with bar(count('samples')) as shown:
        task = shown.add_task(law, total=recorded.samples)
        return open_loop(recorded, law, gains, lambda done: shown.update(task, completed=done))


def _show(document: dict[str, Any]) -> None:
    """Say whether the recorded law is reproduced, and show the metrics."""
    from rich.table import Table

    from auv_analysis.output.progress import console, say
    from auv_analysis.output.text import number as text_of
    from auv_dynamics.vehicle import DOFS

    say(document['reproduction'])
    law, wrench = document['answered']['law'], document['wrench']
    table = Table('', box=None, header_style='bold')
    for head in ('recorded\nrms', 'max', f'{law}\nrms', 'max', 'difference\nrms', 'max'):
        table.add_column(head, justify='right')
    for i, dof in enumerate(DOFS):
        values = [six and six[i] for part in wrench.values() for six in part.values()]
        table.add_row(f'{dof}, {"N" if i < 3 else "N m"}', *map(text_of, values))
    console.print(table)
    for note in document['notes']:
        say(f'note: {note}')
