"""Paths and figures as they are called in tables and figures."""

from collections.abc import Sequence

from auv_analysis.exploration.varied import Varied

PREFIXES = ('controllers.*.', 'vehicle.', 'setpoint.', 'controllers.')
LONGEST_UNIT, LONGEST = 14, 18  # of an axis, of a value at it


def short_names(varied: Sequence[Varied]) -> dict[str, str]:
    """Path -> its name without where it is from, as long as that tells it from the others."""
    short = {v.path: _short(v.path) for v in varied}
    names = list(short.values())
    return {path: name if names.count(name) == 1 else path for path, name in short.items()}


def _short(path: str) -> str:
    for prefix in PREFIXES:
        if path.startswith(prefix):
            return path.removeprefix(prefix)
    return path


def with_unit(name: str, varied: Varied) -> str:
    """Axis label: the name, and the unit where the schema says a short one."""
    return f'{name} ({varied.unit})' if 0 < len(varied.unit) <= LONGEST_UNIT else name


def cut(label: str) -> str:
    """A value that has room at an axis."""
    return label if len(label) <= LONGEST else f'{label[: LONGEST - 2]}…'
