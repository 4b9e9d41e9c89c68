"""`auv watch`: a live dashboard of a node graph, which is not disturbed by it."""

import argparse
import io
import math
import sys
import time
from contextlib import ExitStack
from dataclasses import replace
from typing import Any

from auv_analysis.cli.graphs import (
    checked_namespace,
    join_domain,
    place_of,
    positive,
)
from auv_analysis.graph.domain import joined_domain
from auv_analysis.output.progress import TextConsole, say
from auv_analysis.watch.display import Display, Live, Printed
from auv_analysis.watch.gauge import Gauge
from auv_analysis.watch.keyboard import Keyboard
from auv_analysis.watch.panels import BASIC
from auv_analysis.watch.sampling import Sampling
from auv_analysis.watch.snapshot import Snapshot, Trouble
from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import FailedError
from auv_dynamics.ros.interface import Frames

LOOK = 0.05  # s between two looks at what has come
PATIENCE = 3.0  # s after which it is said what is waited for
SETTLED = 2.0  # s after the first message, when rates are known
FASTEST = 30.0  # refreshes per second
ON_SCREEN, IN_PIPE = 4.0, 1.0  # refreshes per second where nothing is asked for


def watch(options: argparse.Namespace) -> dict[str, Any]:
    """Live dashboard in the terminal; returns the last snapshot."""
    rate = positive(options.rate, '--rate', FASTEST)
    limit = positive(options.limit, '--for', math.inf) or math.inf
    vehicle = None if options.vehicle is None else load_vehicle(options.vehicle)
    domain = joined_domain(options.domain_id)
    namespace = checked_namespace(options.namespace)
    with ExitStack() as stack:
        keyboard = stack.enter_context(Keyboard())  # from here on Ctrl-C is an end like another
        join_domain(domain)
        # the middleware reads its environment when it is loaded
        from auv_analysis.nodes.watch_node import Listener
        from auv_dynamics.ros.life import give_way

        give_way()
        gauge = Gauge(domain, namespace, vehicle, begin=time.monotonic())
        usual = Frames()
        frames = Frames(options.odom_frame or usual.odom, options.base_frame or usual.base)
        listener = Listener(domain, namespace, frames, gauge)
        stack.callback(listener.close)
        say(f'listens on {place_of(domain, namespace)}')
        console = _console(stderr=options.json)
        single = options.once or limit < math.inf
        live = console.is_terminal and not single
        display = Live(console) if live else Printed(console, every=not single)
        stack.enter_context(display)
        session = _Session(gauge, listener, display, rate or (ON_SCREEN if live else IN_PIPE))
        return session.run(keyboard, limit, once=options.once).document()


def _console(*, stderr: bool) -> TextConsole:
    stream = sys.stderr if stderr else sys.stdout
    if isinstance(stream, io.TextIOWrapper):
        stream.reconfigure(errors='replace')  # bars and dashes, where the encoding has none
    return TextConsole(stderr=stderr, highlight=False)


class _Session:
    """Listens and shows until there is a reason to end."""

    def __init__(self, gauge: Gauge, listener: Any, display: Display, rate: float):
        self._gauge, self._listener, self._display = gauge, listener, display
        self._period = 1.0 / rate
        self._sampling = Sampling()
        self._said = False

    def run(self, keyboard: Keyboard, limit: float, *, once: bool) -> Snapshot:
        """Run for at most so many s; FailedError when nothing was heard in them."""
        begin = due = time.monotonic()
        settled = math.inf
        while True:
            now = time.monotonic()
            load = self._gauge.load(now)
            self._listener.listen(listening=self._sampling.listens(now, load))
            now = time.monotonic()
            if self._gauge.moves and settled == math.inf:
                settled = now + SETTLED
            if now >= due:
                self._show(now, waits=now - begin > PATIENCE)
                due = max(due + self._period, now)
            if keyboard.ended or (once and now >= settled):
                break
            if now - begin >= limit:
                snapshot = self._snapshot(now)
                if not snapshot.heard:
                    raise FailedError(f'{self._waits_for(snapshot)}: gave up after {limit:g} s')
                break
            keyboard.wait(LOOK)
        snapshot = self._snapshot(time.monotonic())
        self._display.end(snapshot)
        return snapshot

    def _snapshot(self, now: float) -> Snapshot:
        return self._gauge.snapshot(now, sampled=self._sampling.sampled)

    def _show(self, now: float, *, waits: bool) -> None:
        snapshot = self._snapshot(now)
        if waits and not snapshot.heard:
            text = f'{self._waits_for(snapshot)}; waiting'
            snapshot = replace(snapshot, troubles=(Trouble('warning', text), *snapshot.troubles))
            if not (self._said or self._display.live):
                say(text)
                self._said = True
        self._display.show(snapshot)

    def _waits_for(self, snapshot: Snapshot) -> str:
        what = 'nothing comes of' if snapshot.published else 'nobody publishes'
        names = f'{", ".join(BASIC[:-1])} or {BASIC[-1]}'
        text = f'{what} {names} on {place_of(snapshot.domain, snapshot.namespace)}'
        elsewhere = ' or '.join(self._listener.elsewhere())
        return f'{text}, but odometry in {elsewhere}: see --namespace' if elsewhere else text
