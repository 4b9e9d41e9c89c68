"""Which topics of a bag could be mapped to what, by their types and names."""

from collections.abc import Mapping
from pathlib import Path

from auv_analysis.bag.contents import Contents, NotOursError
from auv_analysis.bag.files import is_mcap
from auv_analysis.bag.reading import read_bag
from auv_analysis.foreign.kinds import READERS, type_name
from auv_dynamics.files.errors import InputError

ROLES = ('odometry', 'pose', 'twist', 'wrench', 'setpoint', 'thrusters')
ASKED = ('cmd', 'command', 'desired', 'goal', 'ref', 'reference', 'setpoint', 'target')
SHOWN = 6  # topics of a role in one line


def survey(bag: Path) -> Contents:
    """Topics, types, counts and span of a bag of any kind, without its messages."""
    if not is_mcap(bag):
        from auv_analysis.foreign.rosbags_files import survey_of_rosbags

        return survey_of_rosbags(bag)
    contents = read_bag(bag, decode=False)
    contents.types = {topic: type_name(kind) for topic, kind in contents.types.items()}
    return contents


def candidates(contents: Contents) -> dict[str, list[str]]:
    """Role -> topics with messages of a type that fits, the likeliest first.

    An odometry is no candidate for pose and twist, and a velocity whose name says that it is asked
    for is one for the set-point alone.
    """
    types = {topic: kind for topic, kind in contents.types.items() if contents.counts.get(topic)}
    found = {role: _fitting(types, role) for role in ROLES}
    whole = set(found['odometry'])
    for role in ('pose', 'twist', 'setpoint'):
        found[role] = [topic for topic in found[role] if topic not in whole]
    found['setpoint'] = [topic for topic in found['setpoint'] if _is_asked(topic)]
    found['twist'] = [topic for topic in found['twist'] if not _is_asked(topic)]
    return {
        role: sorted(topics, key=lambda topic: (-contents.counts[topic], topic))
        for role, topics in found.items()
    }


def _fitting(types: Mapping[str, str], role: str) -> list[str]:
    return [topic for topic, kind in types.items() if kind in READERS[role]]


def _is_asked(topic: str) -> bool:
    words = topic.lower().replace('/', '_').split('_')
    return any(word in ASKED for word in words)


def with_candidates(error: NotOursError) -> InputError:
    """The refusal of a bag that is not ours, with the options that would map its topics.

    Parameters
    ----------
    error : what is missing; of a bag that cannot be looked through it is returned as it is

    """
    try:
        found = candidates(survey(Path(error.file)))
    except InputError:
        return error
    options = [
        f'{option} {" or ".join(found[role][:SHOWN])}'
        for role, option in (('odometry', '--odom'), ('wrench', '--wrench'))
        if found[role]
    ]
    missing = [role for role in ('odometry', 'wrench') if not found[role]]
    if 'odometry' in missing and found['pose'] and found['twist']:
        pair = [f'{role} {" or ".join(found[role][:SHOWN])}' for role in ('pose', 'twist')]
        options.insert(0, f'--map FILE with {" and ".join(pair)}')
        missing.remove('odometry')
    if 'wrench' in missing and found['thrusters']:
        options.append(f'--map FILE with thrusters {" or ".join(found["thrusters"][:SHOWN])}')
        missing.remove('wrench')
    lacking = f' (the bag has no {" and no ".join(missing)})' if missing else ''
    if found['setpoint']:
        options.append(f'--setpoint {" or ".join(found["setpoint"][:SHOWN])}')
    options += ['--frames ned_fsd or enu_flu', '--vehicle FILE']
    expected = f'{error.expected}, or of another system {", ".join(options)}{lacking}'
    return InputError(error.file, error.key, expected, error.found)
