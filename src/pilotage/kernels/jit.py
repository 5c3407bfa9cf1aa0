"""The ``kernel`` decorator: compiled on first call, cached on disk, safe against stale callees.

numba's own cache does not notice an edited callee in another module, so the cache folder is keyed to
a digest of all kernel sources and of the numba and numpy versions.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.cpython.unsafe import numbers as _bits

__all__ = ["cache_is_cold", "kernel", "leading_zeros", "trailing_zeros"]

F = TypeVar("F", bound=Callable[..., Any])


leading_zeros = cast(Callable[[np.uint64], int], _bits.leading_zeros)
trailing_zeros = cast(Callable[[np.uint64], int], _bits.trailing_zeros)
"""How many bits of a word, not 0, are 0 before the highest and after the lowest one set: one instruction."""


def _digest() -> str:
    """Digest of every kernel source and of the versions that compile them."""
    sha = hashlib.sha256(f"{numba.__version__} {np.__version__}".encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        sha.update(path.name.encode())
        sha.update(path.read_bytes())
    return sha.hexdigest()[:16]


def _cache_folder() -> Path:
    """A writable folder for compiled kernels: the user's cache, else one under the temporary folder."""
    root = os.environ.get("PILOTAGE_CACHE_DIR")
    candidates = [Path(root)] if root else []
    try:
        home = Path.home() / ".cache"
    except RuntimeError:  # no home folder
        home = None
    xdg = os.environ.get("XDG_CACHE_HOME")
    candidates += [Path(folder) / "pilotage" for folder in (xdg, home) if folder]
    candidates.append(Path(tempfile.gettempdir()) / f"pilotage-{os.getuid() if hasattr(os, 'getuid') else 0}")
    for base in candidates:
        folder = base / f"kernels-{_digest()}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                return folder
        except OSError:
            continue
    return Path(tempfile.mkdtemp(prefix="pilotage-kernels-"))


_CACHE = _cache_folder()
# numba takes the folder when a function is decorated, so this has to come first.
setattr(numba.config, "CACHE_DIR", str(_CACHE))  # noqa: B010 - numba's stub lacks the name


def cache_is_cold() -> bool:
    """Whether no kernel has been compiled yet: the first run will take its time."""
    return next(_CACHE.rglob("*.nbi"), None) is None


def kernel(function: F) -> F:
    """Compile ``function`` with numba: cached, no fast-math, no parallel threads, errors as in numpy."""
    return cast(F, numba.njit(cache=True, error_model="numpy")(function))
