"""A model with its uncertainty: its coefficients, and what the data cannot tell."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from auv_analysis.output.text import join
from auv_analysis.studies.identify.intervals import Profile
from auv_analysis.studies.identify.output_error import Fit, OutputError
from auv_analysis.studies.identify.prediction import Held
from auv_analysis.studies.identify.record import Record
from auv_analysis.studies.identify.unknowns import Coefficients, Entry
from auv_dynamics.vehicle.vehicle import Vehicle

KNOWN = 0.3  # of the prior's deviation: a coefficient is identified where less is left of it
WIDER = 10.0  # times the prior's deviation: what that changes comes from the prior
ALONE = 0.05  # of its variance: covariances with all others together that are none
MIXED = 0.5  # a direction in which more is left is one that the data cannot tell
BAND, NORMAL = (0.025, 0.975), 1.959964  # of 95 %
FARTHEST = 4.0  # deviations of the prior, of a draw from the fit: farther ones are no vehicles
NAMED = 0.35  # of a direction's largest part: smaller ones are not named


@dataclass(frozen=True, eq=False)
class Identified:
    """A model with its uncertainty.

    Attributes
    ----------
    vehicle : the prior
    training, held : recordings that it was fitted to, and moments of those that it was not
    problem, fit : the segments, and the minimum
    covariance : (n, n) of theta
    predictions : rows of `compare`
    zeros : damping that is held at zero, with the upper end of its interval; None: a coupling
    still : what was free and was not searched, as its degree of freedom hardly moves
    resampled : (k, n) theta of the bootstrap; k = 0: not asked for
    profiles : profile likelihoods, as far as they were asked for

    """

    vehicle: Vehicle
    training: Sequence[Record]
    held: Held
    problem: OutputError
    fit: Fit
    covariance: np.ndarray
    predictions: list[dict[str, Any]]
    zeros: Mapping[Entry, float | None]
    still: Sequence[Entry]
    resampled: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    profiles: Sequence[Profile] = ()

    @property
    def found(self) -> Coefficients:
        """The coefficients, those that were not free included."""
        return self.fit.unknowns.coefficients(self.fit.theta)

    def coefficients(self) -> list[dict[str, Any]]:
        """Rows: name, unit, prior, value, deviation, low, high, left, status.

        `left` is the standard deviation by the data alone, by that of the prior; `status` is
        'identified', 'prior' where too much is left, then there is no interval, or 'at zero':
        damping that would feed energy otherwise. `bootstrap_low`, `bootstrap_high` and
        `profile_low`, `profile_high` are there where they were asked for.
        """
        u = self.fit.unknowns
        J = u.gradient(self.fit.theta)
        P, _ = u.precision(self.fit.theta)
        before, after, alone = (np.sqrt(np.einsum('ij,jk,ik->i', J, C, J))
                         for C in (np.linalg.inv(P), self.covariance, self._by_data()))  # fmt: skip
        values, prior = u.values(self.fit.theta), u.values(np.zeros(len(u.entries)))
        half = self.fit.quantile * after
        rows = []
        for k, entry in enumerate(u.entries):
            left = float(alone[k] / before[k])
            is_known = left < KNOWN
            ends = {'low': values[k] - half[k], 'high': values[k] + half[k]}
            interval = {'deviation': float(after[k]), **ends} if is_known else {}
            status = 'identified' if is_known else 'prior'
            rows.append(_row(entry, prior[k], values[k], status, left=left, **interval))
        for entry, high in self.zeros.items():
            filed = getattr(self.vehicle, entry.group)[entry.index]
            low = None if high is None else 0.0
            rows.append(_row(entry, filed, 0.0, 'at zero', low=low, high=high))
        for entry in self.still:
            value = getattr(self.found, entry.group)[entry.index]
            rows.append(_row(entry, value, value, 'prior', left=1.0))
        if u.is_delay_free:
            rows.append(self._delay(all(r['low'] is not None for r in rows if r['name'] == 'lag')))
        for row in rows:
            row.update(self._other_intervals(row))
        return rows

    def _other_intervals(self, row: Mapping[str, Any]) -> dict[str, float | None]:
        """Of the bootstrap and of the profile likelihood, as far as they were asked for."""
        found: dict[str, float | None] = {}
        names, is_known = self.fit.unknowns.names, row['low'] is not None
        if len(self.resampled):
            found = dict.fromkeys(('bootstrap_low', 'bootstrap_high'))
            if is_known and row['name'] in names:
                values = self.fit.unknowns.values(self.resampled)[:, names.index(row['name'])]
                scale = self.fit.quantile / NORMAL  # few blocks: as wide as the other intervals
                for key, q in zip(found, np.quantile(values, BAND), strict=True):
                    found[key] = float(row['value'] + scale * (q - row['value']))
        if self.profiles:
            own = next((p for p in self.profiles if p.name == row['name']), None)
            found['profile_low'], found['profile_high'] = (
                (own.low, own.high) if own else (None,) * 2
            )
        return found

    def _delay(self, is_known: bool) -> dict[str, Any]:
        """The delay, found in whole steps; known where the lag is, beside which it is told."""
        value, wide = float(self.fit.unknowns.prior.delay), 2 * self.problem.step
        entry = Entry('delay', (), 'delay', 0.0, 's')
        if not is_known:
            return _row(entry, 0.0, value, 'prior')
        ends = {'low': max(value - wide, 0.0), 'high': value + wide}
        return _row(entry, 0.0, value, 'identified', **ends)

    def combinations(self) -> list[dict[str, Any]]:
        """What the data cannot tell: `left` of the prior's deviation, and in words which."""
        values, vectors = self._directions()
        names, found = self.fit.unknowns.names, []
        for value, vector in sorted(zip(values, vectors.T, strict=True), key=lambda p: -p[0]):
            left = float(np.sqrt(max(value, 0.0)))
            if left < MIXED:
                break
            part = vector / vector[np.argmax(np.abs(vector))]
            some = [k for k in np.argsort(-np.abs(part)) if abs(part[k]) >= NAMED]
            words = _words(names, part, some)
            found.append({'left': left, 'names': [names[k] for k in some],
                          'parts': part[some].tolist(), 'words': words})  # fmt: skip
        return found

    def _by_data(self) -> np.ndarray:
        """(n, n) the covariance if the prior were far wider.

        What many priors say together is known to the covariance, and is no finding.
        """
        S, (P, _) = self.fit.information, self.fit.unknowns.precision(self.fit.theta)
        return self.covariance + np.linalg.inv(S + P / WIDER**2) - np.linalg.inv(S + P)

    def _directions(self) -> tuple[np.ndarray, np.ndarray]:
        """Variances (n,) in those of the prior, and orthogonal directions (n, n) of theta.

        What hangs together with nothing is a direction of its own: of several that are as unknown,
        any mixture would be one as well.
        """
        P, _ = self.fit.unknowns.precision(self.fit.theta)
        root = np.linalg.cholesky(P)
        C = root.T @ self._by_data() @ root
        own = np.diag(C).copy()
        mixed = np.linalg.norm(C - np.diag(own), axis=0) > ALONE * own
        vectors = np.eye(len(C))
        own[mixed], vectors[np.ix_(mixed, mixed)] = np.linalg.eigh(C[np.ix_(mixed, mixed)])
        return own, vectors

    def draws(self, count: int, seed: int = 0) -> Coefficients:
        """Models (count,) drawn from the uncertainty."""
        rng = np.random.default_rng(seed)
        scale = self.fit.quantile / NORMAL  # few segments: as wide as the intervals
        least = 1e-14 * np.trace(self.covariance)  # above rounding, which is of the largest
        root = np.linalg.cholesky(self.covariance + least * np.eye(len(self.covariance)))
        moves = scale * rng.standard_normal((count, len(root))) @ root.T
        return self.fit.unknowns.coefficients(self.fit.theta + np.clip(moves, -FARTHEST, FARTHEST))


def _row(
    entry: Entry, prior: float, value: float, status: str, **known: float | None
) -> dict[str, Any]:
    """Row of `coefficients`; what is not given is not known."""
    return {
        'name': entry.name, 'unit': entry.si, 'prior': float(prior), 'value': float(value),
        **dict.fromkeys(('deviation', 'low', 'high', 'left')), 'status': status, **known,
    }  # fmt: skip


def _words(names: Sequence[str], part: np.ndarray, some: Sequence[int]) -> str:
    """A direction that the data leave open, in words."""
    gains = {k for k, name in enumerate(names) if name.startswith('gain.')}
    if gains and gains <= set(map(int, some)):
        return 'the scale of the wrench cannot be told from that of all of M, D and g together'
    up = [names[k] for k in some if part[k] > 0]
    against = [names[k] for k in some if part[k] < 0]
    if len(some) == 1:
        return f'nothing is known of {names[some[0]]}'
    if not against:
        return f'only the difference of {join(up)} is known, not all of them together'
    verb = 'becomes' if len(against) == 1 else 'become'
    return f'{join(up)} may grow if {join(against)} {verb} less'
