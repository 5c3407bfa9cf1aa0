"""A few of the many missions of ``fuzz.mission_ends``: healthy ones run, odd ones end or are refused."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from fuzz.mission_ends import bases, cases, faults

DRAWN = random.Random(433).sample(cases(), 12)


@pytest.mark.parametrize("name", sorted(bases()))
def test_what_the_numbers_are_put_into_runs(name: str, tmp_path: Path) -> None:
    """Else the odd ones are never reached."""
    outcome, found = faults(bases()[name], tmp_path / "case")
    assert not found
    assert outcome.code in (0, 1), outcome.err


@pytest.mark.parametrize("number", range(len(DRAWN)))
def test_a_mission_with_a_number_of_an_odd_size_breaks_nothing(number: int, tmp_path: Path) -> None:
    what, values = DRAWN[number]
    assert not faults(values, tmp_path / "case")[1], what
