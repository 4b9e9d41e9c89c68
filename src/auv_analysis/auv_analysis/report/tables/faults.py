"""What every law does under each fault: errors and effort before, during and after it."""

from collections.abc import Iterator, Mapping, Sequence

from auv_analysis.metrics.fault_response import (
    FILE,
    PARTS,
    SHORTEST,
    Response,
)
from auv_analysis.metrics.summary import BAND_TEXT
from auv_analysis.output.text import MISSING, fixed
from auv_analysis.report.document import Cell, Column, Table, cell
from auv_analysis.report.quantities import Maths
from auv_analysis.report.tables.sources import WRENCH
from auv_dynamics.vehicle import DOFS

ERROR, EFFORT = Maths('RMS of ν_d − ν'), 'RMS of τ'
COLUMNS = (
    Column('', meaning='degree of freedom', numeric=False),
    Column('controller', meaning='name of the run', numeric=False),
    Column('before', '', 'RMS of the velocity error before the fault; m/s, rad/s', group=ERROR),
    Column('during', '', 'the same while it is there', group=ERROR),
    Column('after', '', 'the same behind it', group=ERROR),
    Column('max', '', Maths('largest |ν_d − ν| during the fault; m/s, rad/s')),
    Column('band', '', f'of a settled error: {BAND_TEXT}; m/s, rad/s'),
    Column('recovery', 's', 'time behind the end of the fault from which the error stays within'),
    Column('before', '', 'RMS of the command before the fault; N, N m', group=EFFORT),
    Column('during', '', 'the same while it is there', group=EFFORT),
    Column('after', '', 'the same behind it', group=EFFORT),
    Column('unit', numeric=False),
)


def fault_tables(found: Mapping[str, Sequence[Response]]) -> Iterator[Table]:
    """A table per fault: a row per degree of freedom and controller.

    Parameters
    ----------
    found : controller -> `responses(run)`, of one scenario

    """
    of_fault: dict[int, list[tuple[str, Response]]] = {}
    for name, several in found.items():
        for response in several:
            of_fault.setdefault(response.mark.number, []).append((name, response))
    for number, members in of_fault.items():
        first = members[0][1]
        members.sort(key=lambda pair: DOFS.index(pair[1].dof))
        caption = f'Fault {number}: {first.mark.label}, {first.mark.times}. {_times(first)}'
        rows = [_row(name, response) for name, response in members]
        yield Table(f'faults_{number}', caption, COLUMNS, rows, stub=2)


def _times(response: Response) -> str:
    texts = [
        f'{part} is {begin:g}–{end:.6g} s' if end > begin else f'there is no time {part}'
        for part, (begin, end) in zip(PARTS, response.windows, strict=True)
        if part != 'during'
    ]
    note = f'as long as the fault ({SHORTEST:g} s at least) or up to the next change'
    until = '' if response.until is None else f'; recovery is looked for up to {response.until:g} s'
    text = ', '.join(texts)
    return f'{text[0].upper()}{text[1:]} ({note}){until}.'


def _row(name: str, response: Response) -> list[Cell]:
    def three(values: Sequence[float | None], key: str) -> list[Cell]:
        pairs = zip(values, PARTS, strict=True)
        return [cell(value, f'{FILE}:{key}_{part}') for value, part in pairs]

    recovery = response.recovery
    return [
        Cell(response.dof),
        Cell(name),
        *three(response.rms, 'rms'),
        cell(response.peak[1], f'{FILE}:max_during'),
        cell(response.band, f'{FILE}:band'),
        Cell(MISSING)
        if recovery is None
        else Cell(fixed(recovery, 2), recovery, f'{FILE}:recovery'),
        *three(response.effort, 'effort'),
        Cell(WRENCH[DOFS.index(response.dof) // 3]),
    ]
