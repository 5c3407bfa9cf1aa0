"""The ``kernel`` decorator: compiled on first call, cached on disk, safe against stale callees.

numba's own cache does not notice an edited callee in another module, so each kernel module's cache folder is
keyed to a digest of its source, of all kernel modules that it imports, and of the numba and numpy versions.
Clones and installations of one source share it; of processes that need a function at once one compiles.
"""

from __future__ import annotations

import hashlib
import inspect
import re
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping
from functools import cache, cached_property
from pathlib import Path
from typing import IO, Any, TypeVar, cast

import numba
import numpy as np
from numba.core import event, types
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    _CacheLocator,
    _SourceFileBackedLocatorMixin,
)
from numba.cpython.unsafe import numbers as _bits

from pilotage.kernels.compiling import FewCollections, lighten
from pilotage.kernels.user_cache import user_cache

__all__ = ["cache_is_cold", "kernel", "kernel_without_lock", "leading_zeros", "trailing_zeros"]

try:
    import fcntl
except ImportError:  # not there on Windows: every process compiles for itself
    fcntl = None  # type: ignore[assignment]

F = TypeVar("F", bound=Callable[..., Any])


leading_zeros = cast(Callable[[np.uint64], int], _bits.leading_zeros)
trailing_zeros = cast(Callable[[np.uint64], int], _bits.trailing_zeros)
"""How many bits of a word, not 0, are 0 before the highest and after the lowest one set: one instruction."""


_ROOT = Path(__file__).parent
_PATIENCE_S, _LOOK_S = 120.0, 0.02
"""How long another process may take to compile a function, and how often it is looked whether it has."""
_IMPORTS = re.compile(r"^from pilotage\.kernels(?:\.([\w.]+))? import ([^\n(]+|\([^)]*\))", re.MULTILINE)


@cache
def _read(path: Path) -> tuple[bytes, frozenset[Path]]:
    """A kernel module's source, and the kernel modules that it names in its imports."""
    found: set[Path] = set()
    source = path.read_bytes()
    for package, names in _IMPORTS.findall(source.decode("utf-8").replace("\r\n", "\n")):
        place = _ROOT.joinpath(*package.split(".")) if package else _ROOT
        modules = [place.with_suffix(".py")]
        modules += [place / f"{name.split(' as ')[0].strip()}.py" for name in names.strip("()").split(",")]
        found.update(module for module in modules if module.is_file())
    return source, frozenset(found)


@cache
def _digest(path: Path) -> str:
    """Digest of a kernel module with all that it calls, and of the versions that compile them."""
    sources, open_paths = {path}, [path]
    while open_paths:
        new = _read(open_paths.pop())[1] - sources
        sources |= new
        open_paths += new
    sha = hashlib.sha256(f"{numba.__version__} {np.__version__}".encode())
    for source in sorted(sources):
        sha.update(source.name.encode())
        sha.update(_read(source)[0])
    return sha.hexdigest()[:16]


_CACHE = user_cache("kernels") or Path(tempfile.mkdtemp(prefix="pilotage-kernels-"))


def _folder_of(path: Path) -> Path:
    """Where the compiled code of one kernel module is kept."""
    return _CACHE / f"{path.stem}-{_digest(path)}"


def cache_is_cold() -> bool:
    """Whether nothing has been compiled yet: the first run will take its time.

    Told by the plane geometry, which every run needs.
    """
    return next(_folder_of(_ROOT / "geometry" / "plane.py").rglob("*.nbi"), None) is None


class _Locator(_SourceFileBackedLocatorMixin, _CacheLocator):
    """The folder of a module's digest, wherever the module lies: clones and installations share it."""

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        self._py_file, self._lineno = py_file, py_func.__code__.co_firstlineno

    def get_cache_path(self) -> str:
        return str(_folder_of(Path(self._py_file)))


class _Compiled(CompileResultCacheImpl):
    def __init__(self, py_func: Callable[..., Any]) -> None:
        self._locator_classes = [_Locator]
        super().__init__(py_func)  # type: ignore[no-untyped-call]


class _Cache(FunctionCache):
    """numba's own cache, in which a function that another process compiles just now is waited for.

    Workers that begin together would each compile the same; two that save at once could mix their files up.
    """

    _impl_class = _Compiled
    _lock: IO[bytes] | None = None

    def load_overload(self, sig: object, target_context: object) -> object:
        """From the disk; None where this process is to compile it."""
        found = super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        if found is None and self._lock is None and fcntl is not None:
            self._lock = self._wait()
            found = super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
            if found is not None:
                self._release()
        return found

    def save_overload(self, sig: object, data: object) -> None:
        """Write it and let the others go on."""
        try:
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
        finally:
            self._release()

    def _wait(self) -> IO[bytes] | None:
        """The lock of this function, held; None where nobody gives it free in time or it cannot be taken."""
        path = Path(self.cache_path) / f"{self._impl.filename_base}.lock"
        until = time.monotonic() + _PATIENCE_S
        try:
            file = path.open("ab")
        except OSError:
            return None
        while time.monotonic() < until:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                time.sleep(_LOOK_S)
            else:
                return file
        file.close()
        return None

    def _release(self) -> None:
        if self._lock is not None:
            self._lock.close()
            self._lock = None


class _CacheWhenCalled:
    """A kernel's cache, made when the kernel is first called: of five hundred that a run imports fifty are.

    The digest is taken at once, of the source that was imported: it may be edited before the first call.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function
        _digest(Path(inspect.getfile(function)))

    @cached_property
    def _made(self) -> _Cache:
        return _Cache(self._function)  # type: ignore[no-untyped-call]

    def __getattr__(self, name: str) -> Any:
        """All that numba asks of it."""
        return getattr(self._made, name)


class _First(event.Listener):
    """Before the first function of a process is compiled, the compiler is made lighter."""

    _done = False

    def on_start(self, start: Any) -> None:
        """Within numba's lock, so one thread at a time."""
        if not self._done:
            self._done = True
            lighten(start.data["dispatcher"].targetctx)

    def on_end(self, _: object) -> None:
        """Nothing: it is once and for all."""


event.register("numba:compile", _First())  # type: ignore[no-untyped-call]
event.register("numba:compile", FewCollections())  # type: ignore[no-untyped-call]

_OPTIONS: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True}


def kernel(function: F) -> F:
    """Compile ``function`` with numba: cached, no fast-math, no parallel threads, errors as in numpy."""
    return _cached(numba.njit(**_OPTIONS)(function), function)


def kernel_without_lock(function: F) -> F:
    """As ``kernel``; other threads of Python run meanwhile, so that each core may step its share."""
    return _cached(numba.njit(nogil=True, **_OPTIONS)(function), function)


def _cached(dispatcher: Any, function: F) -> F:
    if not hasattr(dispatcher, "_cache"):  # a plain function where NUMBA_DISABLE_JIT is set
        return cast(F, dispatcher)
    dispatcher._cache = _CacheWhenCalled(function)
    resolve, compile_anew, versions = dispatcher.get_call_template, dispatcher.compile, dispatcher.overloads

    def compile_once(signature: Any) -> Any:
        """What is there is taken without numba's lock and timers: each call in a kernel asks for it."""
        known = versions.get(signature) if isinstance(signature, tuple) else None
        return compile_anew(signature) if known is None else known.entry_point

    def resolve_once(args: Iterable[Any], kws: Mapping[str, Any]) -> Any:
        """Compile for a number, not for each number that some kernel has written in its call."""
        wide: Callable[[Any], Any] = types.unliteral
        return resolve([wide(arg) for arg in args], {key: wide(kws[key]) for key in kws})

    dispatcher.compile, dispatcher.get_call_template = compile_once, resolve_once
    return cast(F, dispatcher)
