"""Controllers compared draw by draw, with Holm's correction for the number of comparisons."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass

import numpy as np

from auv_analysis.studies.pairs import Pairs, holm, log_ratios, paired
from auv_analysis.tuning.measures import Measures

COMPARED = ('weighted_error', 'error', 'effort', 'late_error', 'settling')
LEVEL = 0.05  # of Holm's p below which a difference is called one


@dataclass(frozen=True)
class Comparison(Pairs):
    """A controller against another one in one measure, over the same draws; ratios of `Pairs`.

    Attributes
    ----------
    controller, against : their names
    measure : one of `COMPARED`
    draws : number of pairs
    p_holm : p after Holm's correction for all comparisons of the document

    """

    controller: str
    against: str
    measure: str
    draws: int
    p_holm: float

    @property
    def verdict(self) -> int:
        """-1 smaller, 1 larger, 0 no difference that the test tells from chance."""
        return 0 if self.p_holm >= LEVEL else int(np.sign(self.effect))


def compare(found: Mapping[str, Measures], pairs: Iterable[tuple[str, str]]) -> list[Comparison]:
    """Compare pairs of controllers in every measure that exists, of a loop in a draw at least.

    Parameters
    ----------
    found : controller -> Measures of (n,), row i of all of the same draw
    pairs : (controller, against)

    Returns
    -------
    comparisons : corrected for their number

    """
    known = [
        measure
        for measure in COMPARED
        if any(np.isfinite(getattr(measures, measure)).any() for measures in found.values())
    ]
    names = [(a, b, measure) for a, b in pairs for measure in known]
    ratios = [log_ratios(getattr(found[a], m), getattr(found[b], m)) for a, b, m in names]
    rows = [paired(d) for d in ratios]
    adjusted = holm([row.p for row in rows])
    return [
        Comparison(**asdict(row), controller=a, against=b, measure=m, draws=len(d), p_holm=p)
        for row, (a, b, m), d, p in zip(rows, names, ratios, adjusted, strict=True)
    ]
