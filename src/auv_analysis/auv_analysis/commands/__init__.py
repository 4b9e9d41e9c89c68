"""What each subcommand of `auv` does, a module per kind: options in, a JSON-ready document out."""

import importlib
from collections.abc import Callable
from typing import Any

_HOME = {
    'run': 'run',
    'simulate': 'simulate',
    'analyze': 'analyze',
    'info': 'inspect_bag',
    'params': 'params',
    'check-vehicle': 'check_vehicle',
}


def function(command: str) -> Callable[..., dict[str, Any]]:
    """Function of a subcommand; only its own module is imported."""
    module = importlib.import_module(f'{__name__}.{_HOME[command]}')
    return getattr(module, command.replace('-', '_'))
