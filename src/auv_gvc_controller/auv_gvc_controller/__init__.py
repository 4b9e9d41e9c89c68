"""Decomposition into generalised velocity components, control laws and set-points.

- `decompose(M)`: Upsilon (6, 6) and N (6,) of an inertia matrix
"""

from typing import TYPE_CHECKING

from auv_dynamics.files.lazy import lazy_names

if TYPE_CHECKING:
    from auv_gvc_controller.laws.model import decompose

_HOME = {
    'decompose': 'auv_gvc_controller.laws.model',
}
__all__ = ['decompose']
__getattr__, __dir__ = lazy_names(__name__, _HOME)
