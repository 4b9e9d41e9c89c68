"""What the paper reports beside what the runs give: the claims as a table and as a file."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
from pyarrow import parquet

from auv_analysis.report.claim import Claim
from auv_analysis.report.document import Cell, Column, Table
from auv_analysis.report.quantities import Maths
from auv_analysis.report.quotes import Value

FILE = 'claims.parquet'  # every number of the table: a row each, and one at least of every claim
SCHEMA = pa.schema([
    ('number', pa.int64()), ('case', pa.string()), ('claim', pa.string()), ('paper', pa.string()),
    ('ours', pa.string()), ('verdict', pa.string()), ('criterion', pa.string()),
    ('remark', pa.string()), ('window', pa.string()), ('of', pa.string()), ('name', pa.string()),
    ('value', pa.float64()), ('unit', pa.string()),
])  # fmt: skip
COLUMNS = (
    Column('no.', meaning='number of the claim'),
    Column(
        'claim and criterion', meaning='what the paper says, and what decides it', numeric=False
    ),
    Column('paper', meaning='as it is printed; yes: in words only', numeric=False),
    Column('ours', meaning='computed from the runs', numeric=False),
    Column('window', meaning='case, and time from the start, that ours is of', numeric=False),
    Column('verdict', meaning='by the criterion', numeric=False),
)
CAPTION = (
    'Claims of the paper. Each verdict follows from the numbers beside it by the criterion in its '
    'row; an en dash (–) stands for what is missing.'
)


def claims_table(claims: Sequence[Claim]) -> Table:
    """The paper's claims with our numbers and verdicts."""
    return Table('claims', CAPTION, COLUMNS, [_row(claim) for claim in claims], stub=2)


def _row(claim: Claim) -> list[Cell]:
    off = 'off' if claim.verdict == 'other case' else ''
    return [
        Cell(
            str(claim.number), claim.number, f'{FILE}:number', off, anchor=f'claim-{claim.number}'
        ),
        Cell(Maths(claim.claim), remark=Maths(f'Criterion: {claim.criterion}.')),
        Cell(Maths(claim.paper), source=f'{FILE}:value', figures=_figures(claim.printed)),
        Cell(
            Maths(claim.ours),
            source=f'{FILE}:value',
            figures=_figures(claim.values),
            remark=Maths(claim.remark),
        ),
        Cell(claim.window, remark=claim.case),
        Cell(claim.verdict, kind='badge'),
    ]


def _figures(values: Sequence[Value]) -> dict[str, float]:
    return {name: value for name, value, _ in values if value is not None}


def write_claims(folder: Path, claims: Sequence[Claim]) -> Path:
    """Write `claims.parquet`, long: `of` says whether a number is 'ours' or the 'paper''s."""
    rows = [row for claim in claims for row in _rows(claim)]
    columns = zip(*rows, strict=True) if rows else [[] for _ in SCHEMA]
    path = folder / FILE
    parquet.write_table(pa.table([list(c) for c in columns], schema=SCHEMA), path)
    return path


def _rows(claim: Claim) -> Iterator[tuple[Any, ...]]:
    facts = (
        claim.number, claim.case, claim.claim, claim.paper, claim.ours, claim.verdict,
        claim.criterion, claim.remark, claim.window,
    )  # fmt: skip
    for of, values in (('ours', claim.values), ('paper', claim.printed)):
        for entry in values:
            yield *facts, of, *entry
    if not (claim.values or claim.printed):
        yield *facts, '', '', None, ''
