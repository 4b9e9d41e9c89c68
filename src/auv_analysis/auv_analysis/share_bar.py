"""A share as a bar in a terminal."""

from rich.progress_bar import ProgressBar

STYLE = 'cyan'


def share_bar(percent: float, width: int) -> ProgressBar:
    """Bar of so many columns for a share in %."""
    return ProgressBar(100.0, percent, width, complete_style=STYLE, finished_style=STYLE)
