"""What was done to a foreign bag, in sentences for notes and refusals."""

from collections.abc import Iterable, Mapping

from auv_analysis.foreign.time_base import TimeBase
from auv_analysis.foreign.tracks import Track
from auv_analysis.foreign.unexplained import FILTER, Unexplained
from auv_analysis.output.text import join
from auv_dynamics.ros.interface import NANOSECONDS
from auv_dynamics.vehicle import DOFS

HOW = {
    'pose': 'position by straight lines, attitude by slerp',
    'twist': 'velocity by straight lines between its samples',
}


def of_the_time_base(base: TimeBase, tracks: Mapping[str, Track]) -> list[str]:
    """Step, methods of resampling, gaps."""
    step = base.step / NANOSECONDS
    notes = [f'time base: {step:.6g} s, from the first time at which all mapped topics are known']
    between = [_between(role, track, base.step) for role, track in tracks.items()]
    notes.append(f'resampling: {"; ".join(between)}')
    notes += dict.fromkeys(note for track in tracks.values() for note in _gaps(track))
    spans = base.spans()
    if spans:
        lost = sum(end - begin for begin, end in spans)
        notes.append(
            f'no samples in {_counted(len(spans), "gap")}, {lost:.6g} s together: nothing is '
            'interpolated across'
        )
    if base.left_out:
        notes.append(f'{_counted(base.left_out, "part")} between gaps too short to be of use')
    ns = tracks['twist'].ns
    before, behind = (int(t) / NANOSECONDS for t in (base.ns[0] - ns[0], ns[-1] - base.ns[-1]))
    if max(before, behind) > 2.0 * step:
        notes.append(
            f'velocities of {before:.6g} s before and {behind:.6g} s behind the samples are not '
            'used: there another topic is missing'
        )
    return notes


def of_the_estimate(found: Unexplained) -> list[str]:
    """Filter of the unexplained wrench, and what its error does not hold."""
    windows = join([f'{dof} {time:.3g} s' for dof, time in zip(DOFS, found.window, strict=True)])
    return [
        f'F by (1) is estimated, not known: rate of impulse less momentum by {FILTER}; windows '
        f'{windows}. Its error counts white noise of the velocity and the bias of the filter, '
        'neither noise that is correlated over the window nor a wrench that acted at another time'
    ]


def spans(tracks: Iterable[Track]) -> str:
    """When each topic was there, s from the first of all, for a refusal."""
    tracks = list(tracks)
    origin = min(int(track.ns[0]) for track in tracks)
    parts = []
    for track in tracks:
        begin, end = ((int(ns) - origin) / NANOSECONDS for ns in (track.ns[0], track.ns[-1]))
        parts.append(f'{track.topic} {begin:.6g} to {end:.6g} s')
    return ', '.join(dict.fromkeys(parts))


def _between(role: str, track: Track, step: int) -> str:
    if role == 'pose':
        return f'{HOW[role]}'
    if track.is_averaged(step):
        return f'{role.replace("_", " ")} by its mean over each step, against aliasing'
    if track.held:
        return f'{role.replace("_", " ")} held until the next message'
    return HOW.get(role, f'{role.replace("_", " ")} by straight lines')


def _counted(number: int, word: str) -> str:
    return f'{number} {word}{"" if number == 1 else "s"}'


def _gaps(track: Track) -> list[str]:
    """Pauses of a topic that are gaps; the same of the pose and velocity of an odometry."""
    found = track.gaps()
    if not len(found):
        return []
    lost = float((found[:, 1] - found[:, 0]).sum()) / NANOSECONDS
    longer = f'longer than {track.limit / NANOSECONDS:.3g} s'
    counted = _counted(len(found), 'pause')
    return [f'{track.topic}: {counted} {longer}, {lost:.6g} s together']
