"""Files drawn from their formats: a handful of each kind, and those that ever broke something."""

from __future__ import annotations

from pathlib import Path

import pytest

from fuzz.files import faults
from support.drawn_files import DRAWS

DRAWN = 4
BROKE = (
    ("laser_bag", "1-12"),
    ("calibrations", "1-246"),
    ("carmen", "1-319"),
    ("barn", "1-1131"),
    ("laser_bag", "1-1585"),
    ("calibrations", "1-3040"),
    ("laser_bag", "1-3818"),
    ("stops", "2-643"),
    ("exported", "448-114"),
)
"""What was drawn where something broke, and its seed."""


@pytest.mark.parametrize("name", DRAWS)
def test_what_is_drawn_is_read_or_refused_in_one_line(name: str, tmp_path: Path) -> None:
    for k in range(DRAWN):
        outcome, found = faults(name, f"0-{k}", tmp_path / str(k))
        assert not found, (k, outcome.err)


@pytest.mark.parametrize(("name", "seed"), BROKE)
def test_what_broke_something_breaks_nothing(name: str, seed: str, tmp_path: Path) -> None:
    outcome, found = faults(name, seed, tmp_path / "case")
    assert not found, outcome.err
