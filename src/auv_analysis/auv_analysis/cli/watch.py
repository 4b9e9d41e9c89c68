"""`auv watch`: a live dashboard of a node graph, which is not disturbed by it."""

import argparse
import math
import time
from contextlib import ExitStack
from dataclasses import replace
from typing import Any

from auv_analysis.cli.graphs import checked_namespace, join_domain, place_of, positive
from auv_analysis.graph.domain import joined_domain
from auv_analysis.output.progress import say
from auv_analysis.watch.monitor import GraphMonitor
from auv_analysis.watch.screen import BASIC
from auv_analysis.watch.snapshot import Alert, Snapshot
from auv_analysis.watch.terminal import Display, Keyboard
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
        from auv_analysis.graph.supervisor import give_way
        from auv_analysis.nodes.watch_node import Listener

        give_way()
        monitor = GraphMonitor(domain, namespace, vehicle, begin=time.monotonic())
        usual = Frames()
        frames = Frames(options.odom_frame or usual.odom, options.base_frame or usual.base)
        listener = Listener(domain, namespace, frames, monitor)
        stack.callback(listener.close)
        say(f'listens on {place_of(domain, namespace)}')
        single = options.once or limit < math.inf
        display = stack.enter_context(Display(stderr=options.json, single=single))
        rate = rate or (ON_SCREEN if display.live else IN_PIPE)
        session = _Session(monitor, listener, display, rate)
        return session.run(keyboard, limit, once=options.once).document()


class _Session:
    """Listens and shows until there is a reason to end."""

    def __init__(self, monitor: GraphMonitor, listener: Any, display: Display, rate: float):
        self._monitor, self._listener, self._display = monitor, listener, display
        self._period = 1.0 / rate
        self._said = False

    def run(self, keyboard: Keyboard, limit: float, *, once: bool) -> Snapshot:
        """Run for at most so many s; FailedError when nothing was heard in them."""
        begin = due = time.monotonic()
        settled = math.inf
        while True:
            self._listener.listen()
            now = time.monotonic()
            if self._monitor.moves and settled == math.inf:
                settled = now + SETTLED
            if now >= due:
                self._show(now, waits=now - begin > PATIENCE)
                due = max(due + self._period, now)
            if keyboard.ended or (once and now >= settled):
                break
            if now - begin >= limit:
                snapshot = self._monitor.snapshot(now)
                if not snapshot.heard:
                    raise FailedError(f'{self._waits_for(snapshot)}: gave up after {limit:g} s')
                break
            keyboard.wait(LOOK)
        snapshot = self._monitor.snapshot(time.monotonic())
        self._display.end(snapshot)
        return snapshot

    def _show(self, now: float, *, waits: bool) -> None:
        snapshot = self._monitor.snapshot(now)
        if waits and not snapshot.heard:
            text = f'{self._waits_for(snapshot)}; waiting'
            snapshot = replace(snapshot, alerts=(Alert('warning', text), *snapshot.alerts))
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
