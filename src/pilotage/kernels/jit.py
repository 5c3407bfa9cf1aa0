"""The ``kernel`` decorator: compiled on first call, cached on disk, safe against stale callees.

numba's own cache does not notice an edited callee in another module, so each kernel module's cache folder is
keyed to a digest of its source, of all kernel modules that it imports, and of the numba and numpy versions.
"""

from __future__ import annotations

import hashlib
import os
import re
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.cpython.unsafe import numbers as _bits

__all__ = ["cache_is_cold", "kernel", "kernel_without_lock", "leading_zeros", "trailing_zeros"]

F = TypeVar("F", bound=Callable[..., Any])


leading_zeros = cast(Callable[[np.uint64], int], _bits.leading_zeros)
trailing_zeros = cast(Callable[[np.uint64], int], _bits.trailing_zeros)
"""How many bits of a word, not 0, are 0 before the highest and after the lowest one set: one instruction."""


_ROOT = Path(__file__).parent
_IMPORTS = re.compile(r"^from pilotage\.kernels(?:\.([\w.]+))? import ([^\n(]+|\([^)]*\))", re.MULTILINE)


def _imported(path: Path) -> set[Path]:
    """The kernel modules that a kernel module names in its imports."""
    found: set[Path] = set()
    for package, names in _IMPORTS.findall(path.read_text(encoding="utf-8")):
        place = _ROOT.joinpath(*package.split(".")) if package else _ROOT
        modules = [place.with_suffix(".py")]
        modules += [place / f"{name.split(' as ')[0].strip()}.py" for name in names.strip("()").split(",")]
        found.update(module for module in modules if module.is_file())
    return found


@cache
def _digest(path: Path) -> str:
    """Digest of a kernel module with all that it calls, and of the versions that compile them."""
    sources, open_paths = {path}, [path]
    while open_paths:
        new = _imported(open_paths.pop()) - sources
        sources |= new
        open_paths += new
    sha = hashlib.sha256(f"{numba.__version__} {np.__version__}".encode())
    for source in sorted(sources):
        sha.update(source.name.encode())
        sha.update(source.read_bytes())
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
        folder = base / "kernels"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                return folder
        except OSError:
            continue
    return Path(tempfile.mkdtemp(prefix="pilotage-kernels-"))


_CACHE = _cache_folder()


def _folder_of(path: Path) -> Path:
    """Where the compiled code of one kernel module is kept."""
    return _CACHE / f"{path.stem}-{_digest(path)}"


def cache_is_cold() -> bool:
    """Whether nothing has been compiled yet: the first run will take its time.

    Told by the plane geometry, which every run needs.
    """
    return next(_folder_of(_ROOT / "geometry" / "plane.py").rglob("*.nbi"), None) is None


def kernel(function: F) -> F:
    """Compile ``function`` with numba: cached, no fast-math, no parallel threads, errors as in numpy."""
    # numba takes the cache's folder when a function is decorated.
    folder = _folder_of(Path(function.__code__.co_filename))
    setattr(numba.config, "CACHE_DIR", str(folder))  # noqa: B010 - numba's stub lacks the name
    return cast(F, numba.njit(cache=True, error_model="numpy")(function))


def kernel_without_lock(function: F) -> F:
    """As ``kernel``; other threads of Python run meanwhile, so that each core may step its share."""
    folder = _folder_of(Path(function.__code__.co_filename))
    setattr(numba.config, "CACHE_DIR", str(folder))  # noqa: B010 - numba's stub lacks the name
    return cast(F, numba.njit(cache=True, error_model="numpy", nogil=True)(function))
