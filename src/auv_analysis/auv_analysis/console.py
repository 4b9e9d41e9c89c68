"""The terminal as the commands use it: names from files and from the network are text, no more."""

import sys
from collections.abc import Iterable
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from auv_dynamics.printable import printable


class TextConsole(Console):
    """A console without markup; what the terminal would obey is its own, never part of a text.

    Parameters
    ----------
    options : of rich's Console

    """

    def __init__(self, **options: Any):
        super().__init__(markup=False, emoji=False, **options)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Segments of a renderable, their texts without control characters."""
        for segment in super().render(renderable, options):
            text, style, control = segment
            yield segment if control else Segment(printable(text), style)


def say(text: object) -> None:
    """Print a line, or some, on stderr."""
    print(printable(str(text)), file=sys.stderr, flush=True)
