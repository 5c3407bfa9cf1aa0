"""OpenCV, imported when it is first needed: it is an extra, and slow to load."""

from __future__ import annotations

import importlib
import os
from typing import Any

from pilotage.core.extras import missing


def opencv() -> Any:
    """Return the ``cv2`` module.

    Raises
    ------
    InputError
        Where it is not installed, with the remedy.
    """
    # A film that does not decode is told in one line of our own, not in FFmpeg's.
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
    try:
        return importlib.import_module("cv2")
    except ImportError:
        raise missing("tracking needs OpenCV, which is not installed", "vision") from None
