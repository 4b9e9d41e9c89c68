"""pyarrow as commands use it: without pandas, which it would import at its first array.

That takes half a second and 40 MB of each command, and none of them makes a data frame. Only a
command does without: in a program of its own, pyarrow takes the frames of whoever uses it.
"""

import sys
from typing import Any

import pyarrow as pa

__all__ = ['pa']


class _NoPandas:
    """Finder of modules that does not find pandas."""

    @staticmethod
    def find_spec(name: str, *_: Any) -> None:
        """Refuse pandas; leave everything else to others."""
        if name == 'pandas':
            raise ImportError(name)


if 'auv_analysis.cli' in sys.modules and 'pandas' not in sys.modules:
    finder: Any = _NoPandas
    sys.meta_path.insert(0, finder)
    pa.array([])  # pyarrow asks once; `to_pandas` and `from_pandas` ask again
    sys.meta_path.remove(finder)
