"""The ``kernel`` decorator: a function that numba compiles at its first call and keeps on disk.

numba takes a second of processor time to load, and most of what reads, refuses or lists needs no kernel: it
is loaded when the first kernel of a process is called (``dispatchers``).
"""

from __future__ import annotations

import functools
import inspect
import sys
import threading
from collections.abc import Callable, Iterable
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar, cast

import numpy as np

from pilotage.kernels.code_cache import sources_of

__all__ = ["kernel", "kernel_without_lock", "leading_zeros", "trailing_zeros"]

F = TypeVar("F", bound=Callable[..., Any])


class _Deferred:
    """A kernel before the first of any is called; all of numba's attributes are there when asked for.

    Once numba is loaded, modules hold the dispatchers themselves (``_load``); what still holds one of these
    pays a Python call for each of its own.
    """

    dispatcher: Any = None

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        functools.update_wrapper(self, function)
        self.function, self.options = function, options

    def __call__(self, *args: Any) -> Any:
        if self.dispatcher is None:
            _load()
        return self.dispatcher(*args)

    def __getattr__(self, name: str) -> Any:
        """What numba's dispatcher has: statistics, versions, ``_numba_type_`` where a kernel calls this."""
        if name.startswith("__"):
            raise AttributeError(name)
        if self.dispatcher is None:
            _load()
        return getattr(self.dispatcher, name)

    def __reduce__(self) -> str:
        """Found again by its name, as a function is."""
        return self.function.__qualname__


class _Bits:
    """One of numba's functions on bits before numba is loaded; only kernels call it."""

    def __init__(self, name: str) -> None:
        self.name = name


_BITS = _Bits("leading_zeros"), _Bits("trailing_zeros")
leading_zeros, trailing_zeros = (cast(Callable[[np.uint64], int], bits) for bits in _BITS)
"""How many bits of a word, not 0, are 0 before the highest and after the lowest one set: one instruction."""

_LOADING = threading.RLock()
_deferred: list[_Deferred] | None = []
"""Kernels that wait for numba; None once it is there."""


def _load() -> None:
    """Load numba, make a dispatcher of each kernel, and put it where the kernel is named."""
    global _deferred
    with _LOADING:
        if _deferred is None:
            return
        from pilotage.kernels.dispatchers import bits_of, dispatcher_of

        named = {id(bits): bits_of(bits.name) for bits in _BITS}
        for made in _deferred:
            made.dispatcher = named[id(made)] = dispatcher_of(made.function, made.options)
        own = (vars(module) for name, module in list(sys.modules.items()) if _is_ours(name, module))
        _name(named, [*own, *(made.function.__globals__ for made in _deferred)])
        _deferred = None


def _is_ours(name: str, module: ModuleType | None) -> bool:
    return name.startswith("pilotage.") and isinstance(module, ModuleType)


def _name(made: dict[int, Any], places: Iterable[dict[str, Any]]) -> None:
    """In each namespace, what was made instead of what waited for it."""
    for place in places:
        for name, value in list(place.items()):
            if isinstance(value, _Deferred | _Bits) and id(value) in made:
                place[name] = made[id(value)]


def kernel(function: F) -> F:
    """Compile ``function`` with numba: cached, no fast-math, no parallel threads, errors as in numpy."""
    return _kernel(function, {})


def kernel_without_lock(function: F) -> F:
    """As ``kernel``; other threads of Python run meanwhile, so that each core may step its share."""
    return _kernel(function, {"nogil": True})


def _kernel(function: F, options: dict[str, Any]) -> F:
    # As it was imported: the file may be edited before the first call.
    sources_of(Path(inspect.getfile(function)))
    with _LOADING:
        if _deferred is not None:
            made = _Deferred(function, options)
            _deferred.append(made)
            return cast(F, made)
    from pilotage.kernels.dispatchers import dispatcher_of

    return cast(F, dispatcher_of(function, options))
