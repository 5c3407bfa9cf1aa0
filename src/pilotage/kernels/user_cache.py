"""Where what can be made again is kept between runs: compiled kernels, generated ground."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


def user_cache(name: str) -> Path | None:
    """A writable folder of that name in the user's cache, or None where there is no place for one.

    ``PILOTAGE_CACHE_DIR`` comes first, then the user's cache, then the temporary folder. A home or a cache
    that is no absolute path names no place of the user's (XDG base directories): an empty ``HOME`` is the
    file system's root to Python.
    """
    own = os.environ.get("PILOTAGE_CACHE_DIR")
    candidates = [Path(own)] if own else []
    xdg = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if xdg.is_absolute():
        candidates.append(xdg / "pilotage")
    if os.environ.get("HOME") != "":
        try:
            home = Path.home()
        except RuntimeError:  # nobody's
            home = Path()
        if home.is_absolute():
            candidates.append(home / ".cache" / "pilotage")
    candidates.append(Path(tempfile.gettempdir()) / f"pilotage-{os.getuid() if hasattr(os, 'getuid') else 0}")
    for base in candidates:
        folder = base / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    return None
