"""Files drawn from their formats: a handful of each kind, and those that ever broke something."""

from __future__ import annotations

from pathlib import Path

import pytest

from fuzz.files import faults
from support.drawn_files import DRAWS

DRAWN = 4
BROKE = ("1-12", "1-246", "1-319", "1-1131", "1-1585", "1-3040", "1-3818", "2-643")
"""Seeds of what broke something, of the kind that stands at their number among the draws."""


@pytest.mark.parametrize("name", DRAWS)
def test_what_is_drawn_is_read_or_refused_in_one_line(name: str, tmp_path: Path) -> None:
    for k in range(DRAWN):
        outcome, found = faults(name, f"0-{k}", tmp_path / str(k))
        assert not found, (k, outcome.err)


@pytest.mark.parametrize("seed", BROKE)
def test_what_broke_something_breaks_nothing(seed: str, tmp_path: Path) -> None:
    name = list(DRAWS)[int(seed.partition("-")[2]) % len(DRAWS)]
    outcome, found = faults(name, seed, tmp_path / "case")
    assert not found, outcome.err
