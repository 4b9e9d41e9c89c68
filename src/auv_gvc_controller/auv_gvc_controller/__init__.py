"""Decomposition into generalised velocity components, control laws and set-points.

- `decompose(M)`: Upsilon (6, 6) and N (6,) of an inertia matrix
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from auv_gvc_controller.laws.model import decompose

_HOME = {
    'decompose': 'auv_gvc_controller.laws.model',
}
__all__ = ['decompose']


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for: `auv --help` must not load numba."""
    if name in _HOME:
        return getattr(importlib.import_module(_HOME[name]), name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')


def __dir__() -> list[str]:
    """Public names as well, for `help` and the TAB key."""
    return sorted({*globals(), *__all__})
