"""The files of a figure: saved as PNG and PDF, with title and caption beside them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from auv_analysis.output.progress import each
from auv_analysis.report import plotting

Drawn = tuple[Figure | None, str, str]  # with title and caption


@dataclass(frozen=True)
class FigureRecord:
    """One figure of the report.

    Attributes
    ----------
    name : of its files, without ending
    title, caption : plain text
    png, pdf : its files; None where there is nothing to draw and the caption says why

    """

    name: str
    title: str
    caption: str
    png: Path | None
    pdf: Path | None


def saved(folder: Path, name: str, figure: Figure | None, title: str, caption: str) -> FigureRecord:
    """Save what was drawn; None: nothing, and the caption says why."""
    files = (None, None) if figure is None else plotting.save(figure, folder, name)
    return FigureRecord(name, title, caption, *files)


def save_figures(folder: Path, drawn: Mapping[str, Callable[[], Drawn]]) -> dict[str, FigureRecord]:
    """Draw and save figures, one after the other, in the style of reports.

    Parameters
    ----------
    folder : where the files go; made when it is not there
    drawn : name -> what makes the figure, its title and its caption

    """
    folder.mkdir(parents=True, exist_ok=True)
    with plotting.style():
        return {
            name: saved(folder, name, *make()) for name, make in each(drawn.items(), len(drawn))
        }
