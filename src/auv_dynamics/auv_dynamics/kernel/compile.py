"""Compile the kernel with numba where it is installed; the same source runs without it.

Few decorators are all that the mathematics knows of numba: `helper` for functions that are
inlined wherever a compiled one calls them and stay plain Python by themselves: they may meet a
user's own law, which need not be compilable; `compiled` for those that are called from Python,
whose code other processes load; `uncached` where a user's law must not enter that cache.

Compiled code is kept in one explicit folder whose name changes with every source file that the
kernels can depend on, so that a stale binary cannot be loaded: numba itself only looks at the file
of the outermost function. Where the sources lie does not matter: every clone of the same state
loads the same code. To load it is to run it: the folder is its user's alone.
"""

import contextlib
import functools
import hashlib
import importlib.util
import os
import re
import stat
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

PACKAGES = ('auv_dynamics', 'auv_gvc_controller', 'auv_analysis')
# a decorator of these, a method that `specialised` compiles, or how numba is told
COMPILES = re.compile(
    rb'^@(?:helper|of_numbers|compiled|uncached|specialised)\b'
    rb'|^    def (?:wrench|fill_\w+)\((?!self)|^from numba\b',
    re.M,
)
IMPORT = re.compile(rb'^\s*(?:from|import)\s+(auv_[\w.]+)(?:\s+import\s+(\([^)]*\)|.*))?', re.M)
Function = TypeVar('Function', bound=Callable[..., Any])


def _sources() -> dict[str, bytes]:
    """Dotted name -> text of every Python source of the workspace's packages."""
    found: dict[str, bytes] = {}
    for package in PACKAGES:
        spec = importlib.util.find_spec(package)
        for folder in (spec.submodule_search_locations or []) if spec else []:
            for path in sorted(Path(folder).rglob('*.py')):
                parts = path.relative_to(folder).with_suffix('').parts
                name = '.'.join((package, *parts)).removesuffix('.__init__')
                found[name] = path.read_bytes()
    return found


def _digest(sources: Mapping[str, bytes]) -> str:
    digest = hashlib.sha256()
    for name in sorted(sources):
        digest.update(name.encode() + b'\0' + sources[name])
    return digest.hexdigest()[:16]


@functools.cache
def sources_digest() -> str:
    """Digest of every Python source of the workspace's packages."""
    return _digest(_sources())


def kernels_digest() -> str:
    """Digest of the sources that compile something, and of all that these import."""
    sources = _sources()
    kept: dict[str, bytes] = {}
    waiting = [name for name, text in sources.items() if COMPILES.search(text)]
    while waiting:
        name = waiting.pop()
        if name in sources and name not in kept:
            kept[name] = sources[name]
            for module, names in IMPORT.findall(sources[name]):
                inner = [f'{module.decode()}.{word}' for word in re.findall(r'\w+', names.decode())]
                modules = [entry for entry in inner if entry in sources]
                waiting += modules if modules == inner and inner else [*modules, module.decode()]
    return _digest(kept)


def cache_folder() -> Path:
    """Folder of the compiled code of these kernels.

    Below `$AUV_GVC_CACHE_DIR`, else `$XDG_CACHE_HOME/auv_gvc`.
    """
    root = os.environ.get('AUV_GVC_CACHE_DIR')
    cache = os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache'
    return Path(root or Path(cache) / 'auv_gvc') / kernels_digest()


def is_private(folder: Path) -> bool:
    """Make a folder that nobody else can write to; False where somebody else made it, or can."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.lstat()
        if found.st_uid == os.getuid() and stat.S_ISDIR(found.st_mode):
            folder.chmod(0o700)
            return True
    except OSError:
        return False
    return found.st_uid == 0 and stat.S_ISDIR(found.st_mode) and not found.st_mode & 0o022


def _found() -> bool:
    """Whether numba is installed; to import it takes half a second of each process."""
    try:
        return importlib.util.find_spec('numba') is not None
    except ImportError:
        return False


def _switched_off() -> bool:
    numba = sys.modules.get('numba')
    if numba:
        return bool(numba.config.DISABLE_JIT)
    with contextlib.suppress(ValueError):  # as numba takes it: what is no number is none
        return bool(int(os.environ.get(SWITCH) or 0))
    return False


SWITCH = 'NUMBA_DISABLE_JIT'
INSTALLED = _found()
JITTED = INSTALLED and not _switched_off()


@contextlib.contextmanager
def _unimported(module: str) -> Iterator[None]:
    """Let an import of a module that is not loaded yet find nothing."""
    modules: dict[str, Any] = sys.modules
    modules.setdefault(module, None)
    try:
        yield
    finally:
        if modules[module] is None:
            del modules[module]


class _Numba:
    """The side of numba, `jit`: loaded when something is first called that it compiles.

    Until then it is only noted what it will have to know. Many processes compile nothing.
    """

    def __init__(self) -> None:
        self._jit: Any = None
        self._waiting: list[Callable[[Any], object]] = []
        self._lock = threading.RLock()
        self.import_side: Callable[[], Any] = lambda: None

    def tell(self, what: Callable[[Any], object]) -> None:
        """Call with `jit`, now or once it is there."""
        if self._jit is None:
            self._waiting.append(what)
        else:
            what(self._jit)

    def load(self) -> Any:
        """`jit`, which knows all that was decorated; ImportError where numba does not load."""
        with self._lock:
            if self._jit is None:
                with _unimported('coverage'):  # numba would load it where it is installed
                    self._jit = self.import_side()
                for what in self._waiting:
                    what(self._jit)
        return self._jit


_NUMBA = _Numba()
load = _NUMBA.load


def loads_by(import_side: Callable[[], Any]) -> None:
    """Let `load` import `jit` in this way: of the modules of the kernel, this one knows none."""
    _NUMBA.import_side = import_side


@functools.cache
def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


class _Compiled:
    """A function that is compiled, or loaded, when it is first called.

    Parameters
    ----------
    function : plain Python

    """

    def __init__(self, function: Callable[..., Any]):
        self.py_func = function
        functools.update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        return self._made(*arguments)

    @functools.cached_property
    def _made(self) -> Any:
        try:
            return load().kept(self.py_func)
        except ImportError as error:  # it is there, but not for this Python or this NumPy
            _say(f'warning: numba: {error}: the kernel runs as plain Python, slower')
            return self.py_func

    def __getattr__(self, name: str) -> Any:
        if name.startswith('__'):
            raise AttributeError(name)
        return getattr(self._made, name)  # `_numba_type_`, too: what is compiled may call it


if JITTED:

    def helper(function: Function, /) -> Function:
        """Let what is compiled call a function, and inline it."""
        _NUMBA.tell(lambda jit: jit.inlined(function))
        return function

    def compiled(function: Function, /) -> Function:
        """Compile a function that Python calls; its code is kept for other processes."""
        found: Any = _Compiled(function)
        return found

    def uncached(function: Function, /) -> Function:
        """Compile a function that Python calls; its code is not kept."""
        found: Function = load().uncached(function)
        return found
else:

    def helper(function: Function, /) -> Function:
        """Return the function as it is: numba is absent or switched off."""
        return function

    compiled = uncached = helper


def plain(function: Function) -> Function:
    """Return the un-jitted form of a function."""
    return getattr(function, 'py_func', function)


def specialised(
    argument: str, method: Callable[[Any, str], Any] = getattr
) -> Callable[[Function], Function]:
    """Let a generic function be compiled for the class of one of its arguments.

    The decorated function says in Python what it does: call the static method of its own name of
    the class of `argument`, a named tuple. Under numba, the method itself is compiled, or what
    `method` makes of class and name.
    """

    def decorate(generic: Function, /) -> Function:
        names = generic.__code__.co_varnames[: generic.__code__.co_argcount]
        position = names.index(argument)
        return overloaded(
            generic, lambda *types: method(types[position].instance_class, generic.__name__)
        )

    return decorate


def of_numbers(function: Function, /) -> Function:
    """Compile a helper whose first argument is one number, or one choice.

    What it does to a vector register of them stands in `simd`.
    """

    def choose(first: Any, *_: Any) -> Any:
        return function if isinstance(first, load().NUMBERS) else None

    return overloaded(function, choose)


def overloaded(function: Function, choose: Callable[..., Any], /, **options: Any) -> Function:
    """Let numba compile in place of a function what is chosen for the types of its arguments."""
    if JITTED:
        _NUMBA.tell(lambda jit: jit.overloaded(function, choose, options))
    return function
