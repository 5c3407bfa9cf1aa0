"""numba's dispatchers of kernels: compiled on first call, cached on disk, safe against stale callees.

numba's own cache does not notice an edited callee in another module, so each kernel module's cache folder is
keyed to a digest of its source, of all kernel modules that it imports, and of the numba and numpy versions.
Clones and installations of one source share it; of processes that need a function at once one compiles.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cached_property
from pathlib import Path
from pickle import UnpicklingError
from typing import IO, Any

import numba
from numba.core import event, types
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    _CacheLocator,
    _SourceFileBackedLocatorMixin,
)
from numba.cpython.unsafe import numbers

from pilotage.kernels.code_cache import folder_of
from pilotage.kernels.compiling import FewCollections, lighten

__all__ = ["bits_of", "dispatcher_of"]

try:
    import fcntl
except ImportError:  # not there on Windows: every process compiles for itself
    fcntl = None  # type: ignore[assignment]

_PATIENCE_S, _LOOK_S = 120.0, 0.02
"""How long another process may take to compile a function, and how often it is looked whether it has."""


class _Locator(_SourceFileBackedLocatorMixin, _CacheLocator):
    """The folder of a module's digest, wherever the module lies: clones and installations share it."""

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        self._py_file, self._lineno = py_file, py_func.__code__.co_firstlineno

    def get_cache_path(self) -> str:
        return str(folder_of(Path(self._py_file)))

    def get_source_stamp(self) -> str:
        """The folder's name: what is in it was compiled of these sources, whenever a clone wrote them."""
        return folder_of(Path(self._py_file)).name

    def ensure_cache_path(self) -> None:
        """Where there can be none (any more), nothing is found and nothing kept."""
        with suppress(OSError):
            super().ensure_cache_path()  # type: ignore[no-untyped-call]


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

    @contextmanager
    def _guard_against_spurious_io_errors(self) -> Iterator[None]:
        """What cannot be read or kept is compiled: the folder was removed, the disk is full, a file cut."""
        with suppress(OSError):
            try:
                yield
            except (EOFError, UnpicklingError):
                self._cache_file.flush()  # type: ignore[no-untyped-call]

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
    """A kernel's cache, made when the kernel is first called: of five hundred imported ones fifty are."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

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


def bits_of(name: str) -> Any:
    """numba's function on bits of that name."""
    return getattr(numbers, name)


def dispatcher_of(function: Callable[..., Any], options: Mapping[str, Any]) -> Any:
    """What compiles ``function`` at its first call; itself where NUMBA_DISABLE_JIT is set."""
    dispatcher: Any = numba.njit(**_OPTIONS, **options)(function)
    if not hasattr(dispatcher, "_cache"):
        return dispatcher
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
    return dispatcher
