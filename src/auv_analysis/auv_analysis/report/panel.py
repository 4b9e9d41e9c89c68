"""What a panel of a report is: keys, lines and axes, and the figures that it stands for."""

from dataclasses import dataclass

from auv_analysis.report.traces import Line

WIDTH = 1.6  # of a line, px
STILL = ('inputs_compared',)  # figures of logarithmic time: shown beside the panels


@dataclass(frozen=True)
class Key:
    """What a colour stands for in a panel: a degree of freedom or something else.

    Attributes
    ----------
    label : short
    colour : '#rrggbb' or 'ink', that of the text, light or dark
    dof : whether it is a degree of freedom
    width : of its lines, px

    """

    label: str
    colour: str
    dof: bool = True
    width: float = WIDTH


@dataclass(frozen=True, eq=False)
class PanelLine:
    """Line of a run in a panel: of its `keys[key]`, times and values (n,) each; broken at gaps."""

    run: str
    key: int
    line: Line
    step: float
    gaps: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Panel:
    """One pair of axes over time.

    Attributes
    ----------
    name : of the panel, unlike all others of the report
    title : above it
    label : of its vertical axis, without the unit
    unit : of its values
    keys : what its colours stand for
    lines : of all runs
    kind : 'line'; 'log': on a logarithmic axis; 'both': there as well, when asked for;
        'stack': areas one above the other

    """

    name: str
    title: str
    label: str
    unit: str
    keys: tuple[Key, ...]
    lines: tuple[PanelLine, ...]
    kind: str = 'line'

    @property
    def rows(self) -> dict[str, list[int]]:
        """Run -> numbers of its lines, in the order of the keys."""
        rows: dict[str, list[int]] = {}
        for number, line in enumerate(self.lines):
            rows.setdefault(line.run, []).append(number)
        return rows


@dataclass(frozen=True, eq=False)
class PanelSet:
    """Panels that are shown together, in the place of some figures."""

    name: str
    panels: tuple[Panel, ...]
    figures: tuple[str, ...]

    def stands_for(self, figure: str) -> bool:
        """Whether these panels show what the figure of that name shows."""
        return figure.startswith(self.figures) and figure not in STILL
