"""What each subcommand of `auv` does, a module per kind: options in, a JSON-ready document out."""

import importlib
from collections.abc import Callable
from typing import Any

_HOME = {
    'run': 'run',
    'simulate': 'simulate',
    'study': 'study',
    'analyze': 'analyze',
    'info': 'inspect_bag',
    'recover': 'recover',
    'export-rerun': 'export_rerun',
    'params': 'params',
    'check-vehicle': 'check_vehicle',
    'check-driver': 'check_driver',
    'tune': 'tune',
    'watch': 'watch',
    'replay': 'replay',
    'atlas': 'auv_analysis.atlas.command',
    'design': 'design',
    'import-vehicle': 'auv_analysis.formats.command',
    'export-vehicle': 'auv_analysis.formats.command',
    'linearize': 'auv_analysis.linearization.command',
    'sweep': 'auv_analysis.commands.sweep',
    'new': 'new',
    'completion': 'completion',
    'doctor': 'auv_analysis.doctor.command',
}


def function(command: str) -> Callable[..., dict[str, Any]]:
    """Function of a subcommand; only its own module is imported."""
    home = _HOME[command]
    module = importlib.import_module(home if '.' in home else f'{__name__}.{home}')
    return getattr(module, command.replace('-', '_'))
