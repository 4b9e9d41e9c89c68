"""One check and what came of it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

PASS, FAIL, NOT_CHECKED = 'pass', 'fail', 'not checked'
VERDICTS = (PASS, FAIL, NOT_CHECKED)


@dataclass(frozen=True)
class Finding:
    """What was expected of a driver and what was found.

    Attributes
    ----------
    id : of the check, one of `catalogue.CHECKS`
    expected, found : a line each; that of a check that was not made says why
    verdict : 'pass', 'fail' or 'not checked'
    advice : a line: how to mend it, or how to have it checked; empty where it passed
    numbers : name with its unit -> what was measured

    """

    id: str
    expected: str
    found: str
    verdict: str
    advice: str = ''
    numbers: Mapping[str, float | int | None] = field(default_factory=dict)

    def document(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {
            'id': self.id,
            'verdict': self.verdict,
            'expected': self.expected,
            'found': self.found,
            'advice': self.advice,
            'numbers': {name: _known(value) for name, value in self.numbers.items()},
        }


def _known(value: float | int | None) -> float | int | None:
    """A number as JSON can hold it."""
    return value if value is not None and math.isfinite(value) else None


def judged(
    id: str, good: bool, expected: str, found: str, advice: str, **numbers: float | int | None
) -> Finding:
    """Finding that passes or fails; the advice is for the failure."""
    verdict = PASS if good else FAIL
    return Finding(id, expected, found, verdict, '' if good else advice, numbers)


def unchecked(
    id: str, expected: str, why: str, advice: str = '', **numbers: float | int | None
) -> Finding:
    """Finding of a check that could not be made."""
    return Finding(id, expected, why, NOT_CHECKED, advice, numbers)


def counts(findings: Sequence[Finding]) -> dict[str, int]:
    """How many findings there are of each verdict."""
    return {verdict: sum(f.verdict == verdict for f in findings) for verdict in VERDICTS}
