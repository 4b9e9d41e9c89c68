"""The thread beside a recording: keeps its deadlines, whatever the event loop is busy with."""

import threading
from collections.abc import Callable

LOOK = 0.1  # s between two looks
PATIENCE = 30.0  # s for a disk that does not answer; a sync behind much else may take several


class Keeper:
    """Calls a function every tenth of a second until it is stopped.

    Parameters
    ----------
    look : what is called; it must not raise

    """

    def __init__(self, look: Callable[[], None]):
        self._look, self._stop = look, threading.Event()
        self._thread = threading.Thread(target=self._run, name='bag keeper', daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._stop.wait(LOOK):
            self._look()

    def stop(self) -> bool:
        """End the thread; whether it has ended: a dead disk may hold it."""
        self._stop.set()
        self._thread.join(PATIENCE)
        return not self._thread.is_alive()
