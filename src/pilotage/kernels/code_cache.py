"""Where compiled kernels are kept: a folder for each module, named by all that its code depends on.

Clones and installations of one source share it. The digest is of the source as it was imported.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import re
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from pilotage.kernels.user_cache import user_cache

__all__ = ["cache_is_cold", "folder_of", "sources_of"]

_ROOT = Path(__file__).parent
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
def sources_of(path: Path) -> tuple[Path, ...]:
    """A kernel module, all that it calls and what tells numba how to compile them, read as they are now."""
    sources = {path, _ROOT / "dispatchers.py"}
    open_paths = list(sources)
    while open_paths:
        new = _read(open_paths.pop())[1] - sources
        sources |= new
        open_paths += new
    return tuple(sorted(sources))


@cache
def _digest(path: Path) -> str:
    """Digest of a kernel module with all that it calls, and of the versions that compile them."""
    sha = hashlib.sha256(f"{importlib.metadata.version('numba')} {np.__version__}".encode())
    for source in sources_of(path):
        sha.update(source.name.encode())
        sha.update(_read(source)[0])
    return sha.hexdigest()[:16]


_CACHE = user_cache("kernels") or Path(tempfile.mkdtemp(prefix="pilotage-kernels-"))


def folder_of(path: Path) -> Path:
    """Where the compiled code of one kernel module is kept."""
    return _CACHE / f"{path.stem}-{_digest(path)}"


def cache_is_cold() -> bool:
    """Whether nothing has been compiled yet: the first run will take its time.

    Told by the plane geometry, which every run needs.
    """
    return next(folder_of(_ROOT / "geometry" / "plane.py").rglob("*.nbi"), None) is None
