"""Where what can be made again is kept between runs."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from pathlib import Path


def cache_folder(name: str) -> Path | None:
    """A writable folder of that name in the user's cache, or None where there is no place for one.

    ``PILOTAGE_CACHE_DIR`` comes first, then the user's cache, then the temporary folder.
    """
    candidates = [Path(root) for root in (os.environ.get("PILOTAGE_CACHE_DIR"),) if root]
    xdg = os.environ.get("XDG_CACHE_HOME")
    if xdg:
        candidates.append(Path(xdg) / "pilotage")
    with suppress(RuntimeError):  # no home folder
        candidates.append(Path.home() / ".cache" / "pilotage")
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
