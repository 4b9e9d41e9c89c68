"""Full `ros2msg` schema text of a message type, from the definitions that ROS installs."""

import os
import re
import sys
from functools import lru_cache
from pathlib import Path

PRIMITIVES = {
    'bool', 'byte', 'char', 'float32', 'float64', 'int8', 'uint8', 'int16', 'uint16',
    'int32', 'uint32', 'int64', 'uint64', 'string', 'wstring',
}  # fmt: skip
FIELD = re.compile(r'^\s*([A-Za-z][\w/]*)(<=\d+)?(\[[^\]]*\])?\s+\w+')
SEPARATOR = '=' * 80


def _prefixes() -> list[Path]:
    listed = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
    return [*(Path(p) for p in listed if p), Path(sys.prefix), Path('/opt/ros/jazzy')]


@lru_cache
def definition(name: str) -> str:
    """Text of one message definition.

    Parameters
    ----------
    name : 'package/msg/Name' or 'package/Name'

    Raises
    ------
    FileNotFoundError : no installed package has it

    """
    package, *_, message = name.split('/')
    for prefix in _prefixes():
        path = prefix / 'share' / package / 'msg' / f'{message}.msg'
        if path.is_file():
            return path.read_text(encoding='utf-8')
    raise FileNotFoundError(f'{package}/msg/{message}.msg below {", ".join(map(str, _prefixes()))}')


def _references(package: str, text: str) -> list[str]:
    found = []
    for line in text.splitlines():
        match = FIELD.match(line)
        if match and match[1] not in PRIMITIVES:
            # `Header` and `Time` of a message's own package are written without it
            found.append(match[1] if '/' in match[1] else f'{package}/{match[1]}')
    return found


@lru_cache
def schema_text(name: str) -> str:
    """Definition of a message and of everything it contains, as MCAP's `ros2msg` asks.

    Parameters
    ----------
    name : 'package/msg/Name'

    """
    parts = [definition(name)]
    package = name.split('/', maxsplit=1)[0]
    todo, seen = _references(package, parts[0]), {f'{package}/{name.rsplit("/", 1)[-1]}'}
    while todo:
        reference = todo.pop(0)
        if reference in seen:
            continue
        seen.add(reference)
        text = definition(reference)
        parts.append(f'{SEPARATOR}\nMSG: {reference}\n{text}')
        todo += _references(reference.split('/', maxsplit=1)[0], text)
    return '\n'.join(part.rstrip('\n') for part in parts) + '\n'
