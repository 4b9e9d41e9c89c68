"""What was run: controllers with their gains, and the rest of the scenario in words."""

from collections.abc import Mapping, Sequence
from typing import Any

from auv_analysis.output.text import fixed, join, plain
from auv_analysis.report.document import Cell, Column, Table
from auv_analysis.report.quantities import Maths, symbol
from auv_analysis.report.set_up import SetUp
from auv_analysis.report.tables.sources import numbers_in, summary_source
from auv_analysis.report.words import gain_text
from auv_analysis.runs.run import FOREIGN, Facts
from auv_gvc_controller.laws.law import SHIPPED

SCENARIO = 'scenario.yaml'
ORIGIN = {
    'bag': 'recorded on the node graph',
    'simulate': 'simulated in process',
    FOREIGN: 'recorded by another system',
}
COLUMNS = (
    Column('controller', meaning='name of the run', numeric=False),
    Column('law', meaning='the control law, shipped or module:Class', numeric=False),
    Column('gains', meaning='as the scenario gives them; I is the identity', numeric=False),
    Column('length', 's', 'from the first to the last sample'),
    Column('step', 's', 'control period and integration step'),
    Column('samples', '', 'number of samples, steps + 1'),
    Column('origin', meaning='recorded from nodes, or computed in one process', numeric=False),
)


def controllers_table(runs: Mapping[str, Facts]) -> Table:
    """Name, law, gains and origin of each run; a gain left to its default says so."""
    return Table(
        'controllers',
        'Controllers: law, gains and origin of the run.',
        COLUMNS,
        [_controller(name, run) for name, run in runs.items()],
    )


def _controller(name: str, run: Facts) -> list[Cell]:
    defaults = getattr(SHIPPED.get(run.law), '_field_defaults', {}) if run.gains else {}
    left = {gain: value for gain, value in defaults.items() if gain not in run.gains}
    texts = [f'{{}} = {gain_text(value)}' for value in run.gains.values()]
    texts += [f'{{}} = {gain_text(value)} (default)' for value in left.values()]
    said = Maths(', '.join(texts), *map(symbol, (*run.gains, *left)))
    gains = dict(numbers_in({**run.gains, **left}))
    facts = {key: summary_source(name, key) for key in ('duration', 'step', 'samples')}
    return [
        Cell(name),
        Cell(run.law),
        Cell(said, figures=gains, source=SCENARIO),
        Cell(plain(run.duration, 9), run.duration, facts['duration']),
        Cell(f'{run.step:g}', run.step, facts['step']),
        Cell(fixed(run.samples, 0), run.samples, facts['samples']),
        Cell(ORIGIN.get(run.source, run.source)),
    ]


def set_up_table(name: str, scene: SetUp, runs: Sequence[str], *, several: bool) -> Table:
    """The scenario beside its controllers, in words.

    Parameters
    ----------
    name : of the table
    scene : what is said
    runs : names of those that it is about
    several : whether the report has other scenes beside it

    """
    caption = f'Set-up of {scene.name}' if scene.name else 'Set-up, as far as the runs say it'
    caption += f': {join(runs)}.' if several else '.'
    columns = Column('what', numeric=False), Column('how', numeric=False)
    rows = [
        [Cell(what), Cell('\n'.join(lines), source=SCENARIO, figures=dict(scene.numbers(what)))]
        for what, lines in scene.rows
    ]
    return Table(name, caption, columns, rows)


def notes(runs: Mapping[str, Facts]) -> list[str]:
    """Notes of the runs, each once."""
    found: list[Any] = [f'{name}: {note}' for name, run in runs.items() for note in run.notes]
    return list(dict.fromkeys(found))
