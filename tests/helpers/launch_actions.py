"""The launch file without `launch`, which has no wheel: its actions as they are made."""

import runpy
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

FILE = Path(__file__).parents[2] / 'src/auv_analysis/launch/experiment.launch.py'
MODULES = {
    'launch': ['LaunchContext', 'LaunchDescription'],
    'launch.actions': [
        'DeclareLaunchArgument',
        'EmitEvent',
        'LogInfo',
        'OpaqueFunction',
        'RegisterEventHandler',
        'SetEnvironmentVariable',
    ],
    'launch.event_handlers': ['OnProcessExit'],
    'launch.events': ['Shutdown'],
    'launch.events.process': ['ProcessExited'],
    'launch.substitutions': ['LaunchConfiguration'],
    'launch_ros': [],
    'launch_ros.actions': ['Node'],
}


class Made:
    """Anything of launch: it keeps what it was made of."""

    def __init__(self, *positional: Any, **named: Any):
        self.positional, self.named = positional, named

    def perform(self, values: dict[str, str]) -> str:
        return values[self.positional[0]]


@contextmanager
def launch_file() -> Iterator[dict[str, Any]]:
    """Globals of the launch file; `kept` is what it leaves to be done at the end, done here."""
    modules = {name: ModuleType(name) for name in MODULES}
    for name, classes in MODULES.items():
        vars(modules[name]).update({one: type(one, (Made,), {}) for one in classes})
    kept: list[Callable[[], Any]] = []

    def register(call: Callable[..., Any], *given: Any, **named: Any) -> None:
        kept.append(lambda: call(*given, **named))

    with pytest.MonkeyPatch.context() as patched:
        for name, module in modules.items():
            patched.setitem(sys.modules, name, module)
        patched.setattr('atexit.register', register)
        yield runpy.run_path(str(FILE)) | {'kept': kept}
    for do in kept:
        do()


def actions(launch_file: dict[str, Any], **values: str) -> list[Any]:
    *known, last = launch_file['generate_launch_description']().positional[0]
    assert last.named == {'function': launch_file['_nodes']}, 'it asks for what was declared before'
    declared = {one.positional[0]: one.named for one in known}
    assert all(v in (declared[k]['choices'] or [v]) for k, v in values.items())
    defaults = {name: one['default_value'] for name, one in declared.items()}
    return launch_file['_nodes'](defaults | values)


def of(kind: str, listed: list[Any]) -> list[Any]:
    return [one for one in listed if type(one).__name__ == kind]
