"""What `tune.json` says: the tuned laws, the Monte Carlo over them, and the paired tests."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from auv_analysis.metrics.authority import beyond_authority
from auv_analysis.scenario.scenario import Scenario
from auv_analysis.tuning.comparison import Comparison
from auv_analysis.tuning.draws import Spread, applied
from auv_analysis.tuning.measures import MEANINGS, Measures
from auv_analysis.tuning.rivals import Request, Rival
from auv_analysis.tuning.search import Goal
from auv_analysis.tuning.space import STRUCTURES, searched

QUANTILES = {'q05': 0.05, 'q25': 0.25, 'median': 0.5, 'q75': 0.75, 'q95': 0.95}


@dataclass(frozen=True, eq=False)
class Outcome:
    """All that a tuning gave.

    Attributes
    ----------
    request, goal : what was asked, and the reference's measures
    scenario : with the scenario's own controllers and the tuned ones
    rivals : name in that scenario -> tuned law
    nominal : controller -> measures (1,) in the scenario itself
    deviation : largest relative difference of these to the same from `simulate`
    commands : controller -> largest magnitudes (6,) of its command, N and N m; not of diverged ones
    spread : of the draws
    draws : controller -> measures (n,), row i of the same draw; empty without Monte Carlo
    comparisons : paired, over the draws

    """

    request: Request
    goal: Goal
    scenario: Scenario
    rivals: Mapping[str, Rival]
    nominal: Mapping[str, Measures]
    deviation: float
    commands: Mapping[str, np.ndarray]
    spread: Spread
    draws: Mapping[str, Measures]
    comparisons: Sequence[Comparison]

    @property
    def retuned(self) -> str | None:
        """Name of the reference's own law with searched gains; None where it is no shipped law."""
        law = self.scenario.controller(self.request.reference)['law']
        return next((name for name, rival in self.rivals.items() if rival.law == law), None)

    def ratio(self, name: str, measure: str) -> float:
        """A measure of a controller in the scenario itself, to the reference's."""
        value, base = (getattr(self.nominal[n], measure)[0] for n in (name, self.request.reference))
        return float(value / base)

    def remarks(self, name: str) -> list[str]:
        """What a reader of a controller's numbers must know, a phrase each."""
        found = []
        if name in self.rivals:
            found += self.rivals[name].remarks(self.scenario.duration)
        if name in self.commands:
            found += beyond_authority(self.scenario.vehicle, self.commands[name].tolist())
        return found

    def document(self) -> dict[str, Any]:
        """Contents of `tune.json`."""
        request = self.request
        names = list(self.scenario.controllers)
        document: dict[str, Any] = {
            'scenario': request.scenario.name,
            'vehicle': request.scenario.vehicle.name,
            'reference': request.reference,
            'equal': request.equal,
            'index': request.index,
            'tolerance': request.tolerance,
            'structure': request.structure,
            'hold': request.hold,
            'seed': request.seed,
            'measures': {name: asdict(meaning) for name, meaning in MEANINGS.items()},
            'controllers': {name: self._controller(name) for name in names},
            'validation': {'largest_relative_deviation': self.deviation},
            'monte_carlo': None,
        }
        if self.draws:
            document['monte_carlo'] = {
                'samples': len(self.draws[request.reference].error),
                'spread': applied(self.spread, request.scenario.vehicle),
                'controllers': {name: _distribution(self.draws[name]) for name in names},
                'comparisons': [
                    asdict(c) | {'verdict': c.verdict} for c in self.comparisons
                ],
            }  # fmt: skip
        return document

    def _controller(self, name: str) -> dict[str, Any]:
        entry = self.scenario.controller(name)
        found: dict[str, Any] = {
            'law': entry['law'],
            'tuned': name in self.rivals,
            'gains': self.scenario.gain_values(name),
            'measures': plain(self.nominal[name]),
            'equality': self._equality(name),
            'remarks': self.remarks(name),
        }
        if name not in self.rivals:
            return found
        rival = self.rivals[name]
        return found | {
            'structure': rival.best.space.structure,
            'structure_means': STRUCTURES[rival.best.space.structure],
            'at_bound': rival.best.space.at_bound(rival.best.x),
            'reached': rival.best.reached,
            'price': rival.best.price,
            'evaluations': sum(len(s.tried) for s in rival.searches),
            'searches': [
                {
                    'structure': s.space.structure,
                    'reached': s.reached,
                    'evaluations': len(s.tried),
                    'searched': self._bounds(s.space.law),
                    'measures': plain(s.measures),
                }
                for s in rival.searches
            ],
        }

    def _equality(self, name: str) -> float | None:
        """Relative distance of the measure that is made equal from the reference's."""
        same = self.goal.names[1]
        distance = self.ratio(name, same) - 1.0
        return distance if np.isfinite(distance) else None

    def _bounds(self, law: str) -> dict[str, Any]:
        gains = searched(self.request.scenario.step)[law]
        return {
            gain: {'low': about.low, 'high': about.high, 'times_inertia': about.inertial}
            for gain, about in gains.items()
        }


def plain(measures: Measures) -> dict[str, float | None]:
    """Measures (1,) as numbers; None for what diverged or does not settle."""
    values = {name: float(getattr(measures, name)[0]) for name in Measures._fields}
    return {name: value if np.isfinite(value) else None for name, value in values.items()}


def _distribution(draws: Measures) -> dict[str, Any]:
    """Quantiles of each measure, a loop that diverged or does not settle above all others."""
    diverged = np.isnan(draws.error)
    found: dict[str, Any] = {
        'diverged': float(diverged.mean()),
        'settled': float(np.isfinite(draws.settling).mean()),
    }
    for name in Measures._fields:
        values = np.nan_to_num(getattr(draws, name), nan=np.inf, posinf=np.inf)
        at = np.quantile(values, list(QUANTILES.values()), method='higher')
        found[name] = {
            key: float(q) if np.isfinite(q) else None for key, q in zip(QUANTILES, at, strict=True)
        }
    return found
