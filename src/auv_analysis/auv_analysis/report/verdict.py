"""Comparison of controllers: which tracks better, by how much, with which gains and effort."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from auv_analysis.metrics.lyapunov import OF_THE_MOTION
from auv_analysis.metrics.settling import SMALLEST_BAND
from auv_analysis.output.text import Maths, join, number
from auv_analysis.report.digest import RunDigest, alike, same_vehicle
from auv_dynamics.files.shipped import shipped_names
from auv_dynamics.vehicle import DOFS
from auv_gvc_controller.laws.law import SHIPPED

Summary = Mapping[str, Any]
FAILED = 'another controller did not come to its end'  # begins the note of it
EQUAL = 0.01  # relative: errors that differ by less are the same
SIMILAR = 0.1  # of gains and peaks: laws with less between them are compared fairly
GAIN, SAME = 'velocity gain K_D', 'the same'
GROUPS = {'translation': slice(0, 3), 'rotation': slice(3, 6)}


def verdict(runs: Mapping[str, RunDigest], summaries: Mapping[str, Summary]) -> list[str]:
    """Sentences of the verdict; none for a single run, or without set-points.

    Parameters
    ----------
    runs, summaries : by name

    Returns
    -------
    sentences : the first one names errors, gains and peaks, the second how to compare fairly;
        before them a controller that did not come to its end

    """
    notes = dict.fromkeys(note for run in runs.values() for note in run.notes)
    failed = [f'Not all are compared: {note}.' for note in notes if note.startswith(FAILED)]
    known = {name: e for name, s in summaries.items() if (e := _errors(s)) is not None}
    if len(runs) < 2 or len(known) < len(runs):
        return failed
    if differing := _differing([*runs.values()]):
        return [*failed, f'These runs cannot be ranked: they differ in {join(differing)}.']
    best, other = _leading(known)
    mine, theirs = summaries[best], summaries[other]
    gains, factors = _gains(mine, theirs)
    effort, ratio = _effort(mine, theirs)
    before = f'{_head(best, other, known)}: against {other}, {best} has '
    after = f'{effort}, and {_error_ratios(known[best], known[other])}'
    after += f'; {_settling(best, other, mine, theirs)}.'
    sentences: list[str] = [*failed, Maths(f'{{}}{gains}{{}}', before, after)]
    unlike = any(not 1 - SIMILAR <= r <= 1 + SIMILAR for r in (*factors, ratio))
    if unlike and {mine['law'], theirs['law']} <= set(SHIPPED):
        sentences.append(
            f'That compares gains as they were chosen; {_tune(best, [*runs.values()])} compares '
            'the laws, each tuned to the same effort.'
        )
    return sentences


def _tune(best: str, runs: Sequence[RunDigest]) -> str:
    """Command that tunes the laws of some runs."""
    scenario = runs[0].scenario
    words = ['auv tune', scenario if scenario in shipped_names('scenarios') else 'SCENARIO']
    words += [] if any(run.law == 'gvc' for run in runs) else [f'--reference {best}']
    words += ['--hold zoh'] if any(run.acting or run.sensing for run in runs) else []
    return ' '.join(words)


def _errors(summary: Summary) -> np.ndarray | None:
    """RMS velocity error in translation, m/s, and rotation, rad/s; None where not all is known."""
    rms = summary['velocity_error']['rms']
    unknown = rms is None or None in rms or None in summary['effort']['max']
    return None if unknown else np.array([np.linalg.norm(rms[g]) for g in GROUPS.values()])


def _differing(runs: Sequence[RunDigest]) -> list[str]:
    """Preconditions of a comparison that the runs do not share; where they start is none."""
    first, *others = runs
    begin, length = first.begin, first.duration
    depends = any(kind in OF_THE_MOTION for run in runs for kind in run.kinds or ())
    same = {
        'vehicle': same_vehicle(runs),
        'length': all(abs(run.duration - length) <= EQUAL * length for run in others),
        'start': not any(np.any(np.abs(run.begin - begin)[3:] > SMALLEST_BAND) for run in others),
        'set-point': alike(runs, 'nu_d'),
        'disturbance': depends or alike(runs, 'F'),
    }
    return [word for word, value in same.items() if value is False]


def _leading(errors: Mapping[str, np.ndarray]) -> tuple[str, str]:
    """The best run and the next one; where none is best in both errors, the best in each."""
    first, second = (min(errors, key=lambda name: errors[name][i]) for i in (0, 1))
    if not all(_no_larger(errors[first], error).all() for error in errors.values()):
        if not all(_no_larger(errors[second], error).all() for error in errors.values()):
            return first, second
        first = second
    others = [name for name in errors if name != first]
    return first, min(others, key=lambda name: float(np.prod(errors[name])))


def _no_larger(mine: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    return mine <= (1 + EQUAL) * theirs


def _head(best: str, other: str, errors: Mapping[str, np.ndarray]) -> str:
    mine, theirs = errors[best], errors[other]
    of = f'Of {len(errors)} controllers, ' if len(errors) > 2 else ''
    if not _no_larger(mine, theirs).all():
        return f'{of}none tracks better in all, neither {best} nor {other}'
    if _no_larger(theirs, mine).all():
        return f'{of}{best} and {other} track alike'
    return f'{of}{best} tracks best, {other} next' if of else f'{best} tracks better than {other}'


def _gains(mine: Summary, theirs: Summary) -> tuple[str, list[float]]:
    """Diagonal of K_D to the other one's: words, and the ratio of each axis."""
    K_D = [summary['gains']['K_D'] for summary in (mine, theirs)]
    if any(matrix is None or np.any(np.diagonal(matrix) <= 0) for matrix in K_D):
        return '', []
    of_axes = np.diagonal(K_D[0]) / np.diagonal(K_D[1])
    texts = [_times(of_axes[g].min(), of_axes[g].max()) for g in GROUPS.values()]
    text = _of(texts[0], GAIN) if texts[0] == texts[1] else _both(GAIN, texts)
    return f'{text} (body frame), ', of_axes.tolist()


def _effort(mine: Summary, theirs: Summary) -> tuple[str, float]:
    """Peak force, or moment where there is no force, to the other one's: words and ratio."""
    peaks = [np.array(summary['effort']['max']) for summary in (mine, theirs)]
    what, unit, group = 'peak force', 'N', GROUPS['translation']
    if not any(peak[group].any() for peak in peaks):
        what, unit, group = 'peak moment', 'N m', GROUPS['rotation']
    a, b = (float(peak[group].max()) for peak in peaks)
    against = f'({number(a)} against {number(b)} {unit})'
    ratio = _ratio(a, b)
    return f'{_of(_times(ratio), what)} {against}', ratio


def _error_ratios(mine: np.ndarray, theirs: np.ndarray) -> str:
    """RMS errors to the other one's."""
    return _both(
        'RMS velocity error', [_times(_ratio(*pair)) for pair in zip(mine, theirs, strict=True)]
    )


def _ratio(a: float, b: float) -> float:
    return float(a / b) if b > 0 else np.inf if a > 0 else 1.0


def _times(low: float, high: float | None = None) -> str:
    """A ratio, or a span of ratios, in words."""
    high = low if high is None else high
    if max(abs(low - 1), abs(high - 1)) <= EQUAL:
        return SAME
    if np.isinf(high):
        return 'infinitely many times'
    return f'{" to ".join(dict.fromkeys(number(ratio, 2) for ratio in (low, high)))} times'


def _of(times: str, what: str) -> str:
    return f'{times} {what}' if times == SAME else f'{times} the {what}'


def _both(what: str, times: Sequence[str]) -> str:
    """A quantity in translation and in rotation."""
    first, second = GROUPS
    return f'{_of(times[0], what)} in {first} and {times[1]} in {second}'


def _settling(best: str, other: str, mine: Summary, theirs: Summary) -> str:
    """Who settles, and when."""
    parts = []
    for name, summary in ((best, mine), (other, theirs)):
        times = summary['velocity_error']['settling_time']
        late = [dof for dof, time in zip(DOFS, times, strict=True) if time is None]
        text = f'does not in {join(late)}' if late else f'settles in {number(max(times), 2)} s'
        parts.append((f'{name} {text}', bool(late)))
    if all(late for _, late in parts):
        return f'neither {best} nor {other} settles in all degrees of freedom'
    (first, behind), (second, _) = parts
    return f'{second}, {first}' if behind else f'{first}, {second}'
