"""Public names of a package, imported when they are first asked for."""

import importlib
import sys
from collections.abc import Callable, Mapping
from typing import Any


def lazy_names(
    package: str, homes: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of a package: `auv --help` must not load numba.

    Parameters
    ----------
    package : its name
    homes : public name -> module that has it

    """

    def get(name: str) -> Any:
        if name in homes:
            return getattr(importlib.import_module(homes[name]), name)
        raise AttributeError(f'module {package!r} has no attribute {name!r}')

    return get, lambda: sorted({*vars(sys.modules[package]), *homes})
