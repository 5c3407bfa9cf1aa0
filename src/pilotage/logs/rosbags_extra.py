"""The library ``rosbags``, imported when it is first needed: it is an extra."""

from __future__ import annotations

import importlib
from typing import Any

from pilotage.core.extras import missing


def rosbags(module: str) -> Any:
    """Return the module ``rosbags.<module>``.

    Raises
    ------
    InputError
        Where the library is not installed, with the remedy.
    """
    try:
        return importlib.import_module(f"rosbags.{module}")
    except ImportError:
        raise missing("bags need the library rosbags, which is not installed", "ros") from None
