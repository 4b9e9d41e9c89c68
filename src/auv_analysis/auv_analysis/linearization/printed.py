"""The table of poles of `auv linearize` for a terminal."""

from typing import Any

from rich.console import Console
from rich.table import Table

from auv_analysis.console import TextConsole

COLUMNS = ('pole, 1/s', 'damping', 'frequency, rad/s', 'time constant, s', 'mostly', 'part')


def print_poles(document: dict[str, Any], out: Console | None = None) -> None:
    """Print the poles of every model, the slowest first; default: on standard output."""
    out = out or TextConsole(highlight=False)
    for name, model in document['models'].items():
        table = Table(box=None, header_style='bold')
        for column in COLUMNS:
            table.add_column(column, justify='left' if column == 'mostly' else 'right')
        for mode in model['modes']:
            table.add_row(*_row(mode))
        out.print(f'\n{name}: {_verdict(model)}')
        out.print(table)
    if document['left_out']:
        out.print(f'\nnot in these models: {", ".join(document["left_out"])}')


def _verdict(model: dict[str, Any]) -> str:
    rates = [mode['pole'][0] for mode in model['modes']]
    text = f'{len(model["states"])} states, {model["stability"]}'
    for count, what in (
        (sum(rate > 0 for rate in rates), 'grow'),
        (sum(rate == 0 for rate in rates), 'neither grow nor decay'),
    ):
        text += f', {count} of its {len(rates)} modes {what}' if count else ''
    if any(abs(rate) > 1e-9 for rate in model['drift']):
        text += '; the point moves: it turns while it is inclined'
    return text


def _row(mode: dict[str, Any]) -> tuple[str, ...]:
    real, imaginary = mode['pole']
    pole = f'{real:.4g}' + (f' ± {imaginary:.4g}i' if imaginary else '')
    keys = ('damping_ratio', 'natural_frequency', 'time_constant')
    numbers = ('none' if mode[key] is None else f'{mode[key]:.4g}' for key in keys)
    return pole, *numbers, mode['mostly'], f'{100 * mode["part"]:.0f} %'
