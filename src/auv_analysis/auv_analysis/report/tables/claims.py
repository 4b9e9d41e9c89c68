"""What the paper reports beside what the runs give: the claims as a table."""

from collections.abc import Sequence

from auv_analysis.report.claims import Claim
from auv_analysis.report.document import Cell, Column, Table

COLUMNS = (
    Column('no.', meaning='number of the claim'),
    Column(
        'claim and criterion', meaning='what the paper says, and what decides it', numeric=False
    ),
    Column('paper', meaning='as it is printed; yes: in words only', numeric=False),
    Column('ours', meaning='computed from the runs', numeric=False),
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
        Cell(str(claim.number), claim.number, kind=off, anchor=f'claim-{claim.number}'),
        Cell(claim.claim, remark=f'Criterion: {claim.criterion}.'),
        Cell(claim.paper),
        Cell(claim.ours, remark=claim.remark),
        Cell(claim.verdict, kind='badge'),
    ]
