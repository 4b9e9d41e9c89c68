"""Time of what is recorded: that of the graph, and what waits until it is known."""

import time
from typing import Any

from auv_dynamics.ros.bulk import BulkNode
from auv_dynamics.ros.interface import NANOSECONDS

EPOCH = 86_400 * NANOSECONDS  # ns between two clocks, from which they have different epochs
EARLY_TIME = 60.0  # s that messages wait for the first step, which tells the time of the graph
EARLY_COUNT, EARLY_SIZE = 10_000, 1 << 24  # messages and bytes that wait at most
Entry = tuple[str, str, bytes, dict[str, Any]]  # topic, type, message, what is known of its way


class GraphClock:
    """Time of the graph: that of the steps in lock-step, else of the node's clock.

    Where a driver stamps by a clock of another epoch, the node's clock is moved there by the first
    step, so that all of a bag lies together.

    Attributes
    ----------
    latest : newest stamp of a step, ns; -1 before the first
    early : messages that came before the time was known

    """

    def __init__(self, node: BulkNode, strict: bool):
        self._node, self._strict, self.latest = node, strict, -1
        self.simulated = strict or bool(node.get_parameter('use_sim_time').value)
        self._offset: int | None = None
        self.early: list[Entry] = []
        self._since = 0.0  # steady s

    def follow(self, ns: int) -> None:
        """Note the stamp of a step."""
        self.latest = max(self.latest, ns)
        if self._offset is None:
            apart = ns - self._node.get_clock().now().nanoseconds
            self._offset = apart if abs(apart) > EPOCH else 0

    def now(self, received: int) -> int | None:
        """Time in ns of a message that came at `received` of the system's; None: not known yet."""
        if not self.simulated:
            wall = received or int(self._node.get_clock().now().nanoseconds)
            return None if self._offset is None else max(0, wall + self._offset)
        told = 0 if self._strict else int(self._node.get_clock().now().nanoseconds)
        return told or (self.latest if self.latest >= 0 else None)

    def hold(self, entry: Entry) -> None:
        """Let a message wait until the time is known."""
        self._since = self._since or time.monotonic()
        self.early.append(entry)

    def released(self, *, ends: bool = False) -> list[Entry]:
        """What has waited, once the time is known; it is not waited for without bounds."""
        late = time.monotonic() - self._since > EARLY_TIME
        size = sum(len(message) for _, _, message, _ in self.early)
        if ends or late or len(self.early) > EARLY_COUNT or size > EARLY_SIZE:
            # without a step the time is the node's, zero where it is simulated
            self.latest, self._offset = max(self.latest, 0), self._offset or 0
        waiting, self.early = self.early, []
        return waiting
