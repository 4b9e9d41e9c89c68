"""What the recorder notes of its recording, as an attachment: namespace, names, how strict."""

from collections.abc import Mapping
from typing import Any

import yaml

from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import parse_yaml

NAME = 'recording.yaml'


def recording_text(strict: bool, names: Mapping[str, str], namespace: str = '/') -> str:
    """Text of the attachment.

    Parameters
    ----------
    strict : whether every step had to come once and in order
    names : recorded topic -> the name that it has where nothing is remapped, of those that differ
    namespace : of the recorder

    """
    noted = {'strict': strict, 'namespace': namespace, 'topics': dict(names)}
    return yaml.safe_dump(noted, sort_keys=False)


def namespace_in(text: str, bag: object) -> str | None:
    """Namespace of the recorder; None where it is not noted."""
    found = parse_yaml(text, f'{bag}: {NAME}', 'recording').get('namespace')
    if not (found is None or isinstance(found, str)):
        raise InputError(f'{bag}: {NAME}', 'namespace', 'the name of a namespace', found)
    return found


def names_of(text: str, bag: object) -> dict[str, str]:
    """Recorded topic -> our name of it; InputError when the attachment is not the recorder's."""
    names: Any = parse_yaml(text, f'{bag}: {NAME}', 'recording').get('topics', {})
    if not isinstance(names, dict) or not all(
        isinstance(n, str) for n in (*names, *names.values())
    ):
        raise InputError(f'{bag}: {NAME}', 'topics', 'a mapping of topics to names', names)
    if len(set(names.values())) < len(names):
        raise InputError(f'{bag}: {NAME}', 'topics', 'each name once', names)
    return names


def was_strict(text: str, bag: object) -> bool:
    """Whether every step had to come once and in order."""
    return parse_yaml(text, f'{bag}: {NAME}', 'recording').get('strict') is not False
