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

import hashlib
import importlib.util
import os
import re
import stat
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol, TypeVar

PACKAGES = ('auv_dynamics', 'auv_gvc_controller', 'auv_analysis')
# a decorator of these, or a method that `specialised` compiles
COMPILES = re.compile(
    rb'^@(?:helper|of_numbers|compiled|uncached|specialised)\b'
    rb'|^    def (?:wrench|fill_\w+)\((?!self)',
    re.M,
)
IMPORT = re.compile(rb'^\s*(?:from|import)\s+(auv_[\w.]+)(?:\s+import\s+(\([^)]*\)|.*))?', re.M)
Function = TypeVar('Function', bound=Callable[..., Any])


class Decorator(Protocol):
    """What compiles a function and leaves how it is called as it was."""

    def __call__(self, function: Function, /) -> Function:
        """Compile a function."""


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


try:
    import numba
    from numba.core.caching import CompileResultCacheImpl, FunctionCache
    from numba.core.compiler import Compiler
    from numba.core.compiler_machinery import PassManager, register_pass
    from numba.core.typed_passes import NativeLowering
    from numba.extending import overload, register_jitable
except ImportError:
    numba = None  # type: ignore[assignment]  # the module or its absence

config: Any = numba and numba.config
JITTED = numba is not None and not config.DISABLE_JIT

if JITTED:
    FOLDER = cache_folder()
    KEPT = is_private(FOLDER)
    if not KEPT:
        text = f'warning: {FOLDER}: not yours alone: compiled code is neither kept nor loaded'
        print(text, file=sys.stderr, flush=True)

    @register_pass(mutates_CFG=True, analysis_only=False)
    class _Inner(NativeLowering):
        """Ends at optimised LLVM code: what is inlined needs no machine code of its own."""

        _name = 'inner_lowering'

        def run_pass(self, state: Any) -> bool:
            state.flags.no_compile = True
            NativeLowering.run_pass(self, state)
            found = state['cr']
            key: Any = [].append  # numba wants a built-in function, and one for each
            state.library._finalize_specific = lambda: None  # noqa: SLF001  no machine code
            state.targetctx.insert_user_function(key, found.fndesc, [state.library])
            state['cr'] = found._replace(cfunc=key)
            return True

    class _Inlined(Compiler):
        """Compiles what is inlined wherever it is called."""

        def define_pipelines(self) -> list[Any]:
            (usual,) = super().define_pipelines()  # type: ignore[no-untyped-call]
            passes: Any = PassManager('inlined')
            for which, why in usual.passes:
                passes.add_pass(_Inner if which is NativeLowering else which, why)
            passes.finalize()
            return [passes]

    # without _nrt no references are counted: nothing is allocated, and callers hold their arrays
    OPTIONS: Any = {'fastmath': {'contract'}, 'error_model': 'numpy', '_nrt': False}
    INNER: Any = {
        'forceinline': True,
        'no_cfunc_wrapper': True,
        'pipeline_class': _Inlined,
        **OPTIONS,
    }
    helper: Decorator = register_jitable(**INNER)
    uncached: Decorator = numba.njit(nogil=True, **OPTIONS)
    NUMBERS = numba.types.Number, numba.types.Boolean

    class _Place:
        """Where numba looks for the code of a function: by what it is, not by where it lies."""

        def __init__(self, function: Any, path: str):
            self._module, self._path = function.__module__, Path(path)

        @classmethod
        def from_function(cls, function: Any, path: str) -> '_Place':
            return cls(function, path)

        def ensure_cache_path(self) -> None:
            is_private(FOLDER)

        def get_cache_path(self) -> str:
            return str(FOLDER)

        def get_source_stamp(self) -> str:
            return hashlib.sha256(self._path.read_bytes()).hexdigest()

        def get_disambiguator(self) -> str:
            return str(self._module)

    _FILES = type('_Files', (CompileResultCacheImpl,), {'_locator_classes': [_Place]})
    _CACHE: Any = type('_Cache', (FunctionCache,), {'_impl_class': _FILES})

    def compiled(function: Function, /) -> Function:
        """Compile a function that Python calls; its code is kept for other processes."""
        made: Any = numba.njit(nogil=True, forceinline=True, **OPTIONS)(function)
        if KEPT:
            made._cache = _CACHE(function)  # noqa: SLF001  as `cache=True` does, with another place
        return made
else:

    def helper(function: Function, /) -> Function:
        """Return the function as it is: numba is absent or switched off."""
        return function

    compiled = uncached = helper


def plain(function: Function) -> Function:
    """Return the un-jitted form of a function."""
    return getattr(function, 'py_func', function)


def specialised(argument: str) -> Decorator:
    """Let a generic function be compiled for the class of one of its arguments.

    The decorated function says in Python what it does: call the static method of its own name of
    the class of `argument`, a named tuple. Under numba, the method itself is compiled.
    """

    def decorate(generic: Function, /) -> Function:
        names = generic.__code__.co_varnames[: generic.__code__.co_argcount]
        position = names.index(argument)
        return overloaded(
            generic, lambda *types: getattr(types[position].instance_class, generic.__name__)
        )

    return decorate


def of_numbers(function: Function, /) -> Function:
    """Compile a helper whose first argument is one number, or one choice.

    What it does to a vector register of them stands in `simd`.
    """

    def choose(first: Any, *_: Any) -> Any:
        return function if isinstance(first, NUMBERS) else None

    return overloaded(function, choose)


def overloaded(function: Function, choose: Callable[..., Any], /, **options: Any) -> Function:
    """Let numba compile in place of a function what is chosen for the types of its arguments."""
    if JITTED:
        # not strict: numba would take an argument with an annotation for another one
        overload(function, jit_options=INNER | options, strict=False)(
            lambda *types: choose(*types)  # noqa: PLW0108  numba looks at its code
        )
    return function
