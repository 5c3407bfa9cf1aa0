"""Where the real recordings are; a test that needs them is skipped with a word where they are not."""

from __future__ import annotations

from pathlib import Path

import pytest

SHARED_DATA = Path(__file__).resolve().parents[3] / "shared" / "data"


def recording(relative: str) -> Path:
    """Return the path of a recording, or skip the test."""
    path = SHARED_DATA / relative
    if not path.exists():
        pytest.skip(f"needs the recording ../shared/data/{relative}")
    return path
