"""Levels of the diagnostics, and the log of what is wrong and lasts."""

import math
import re
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus

LASTING = 1.0  # s, after which what is wrong is logged: names and matches may come late
REPEATED = 10.0  # s between two logs of what is wrong and lasts
OK, WARN = DiagnosticStatus.OK, DiagnosticStatus.WARN
STALE, ERROR = DiagnosticStatus.STALE, DiagnosticStatus.ERROR
WORSE = (OK, WARN, STALE, ERROR)
NUMBER = re.compile(r'[-+]?\d')  # with the first one reports of the same kind may begin to differ
Health = tuple[bytes, str]  # level of a DiagnosticStatus, and why it is not OK


def kind_of(text: str) -> str:
    """What reports of the same kind have in common."""
    return NUMBER.split(text, maxsplit=1)[0]


def worst(found: list[Health]) -> Health:
    """The worst of some that have a text."""
    return max(
        (one for one in found if one[1]), key=lambda one: WORSE.index(one[0]), default=(OK, '')
    )


class Lasting:
    """Logs what is wrong once it lasts, then now and then, and that it is over.

    Parameters
    ----------
    logger : of the node

    """

    def __init__(self, logger: Any):
        self._logger = logger
        self._kind, self._text = '', ''
        self._since = self._said = -math.inf

    def see(self, level: bytes, text: str) -> None:
        """Take the present state; an empty text: nothing is wrong."""
        now, kind = time.monotonic(), kind_of(text)
        if kind != self._kind:
            if self._said > self._since and not text:
                self._logger.info(f'over: {self._text}')
            self._kind, self._since, self._said = kind, now, -math.inf
        self._text = text
        if text and now - self._since >= LASTING and now - self._said >= REPEATED:
            self._said = now
            if level == ERROR:
                self._logger.error(text)
            else:
                self._logger.warning(text)
