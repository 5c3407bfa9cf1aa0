"""What a killed command leaves is whole: two of the kills of ``fuzz.kills``; those of studies are theirs."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from fuzz.kills import VICTIMS, killed

CHOSEN = [victim for victim in VICTIMS if victim.name in {"run", "export rosbag"}]


@pytest.mark.parametrize("victim", CHOSEN, ids=lambda victim: victim.name)
def test_what_a_killed_command_leaves_is_whole(victim: object, tmp_path: Path) -> None:
    assert killed(victim, tmp_path, random.Random(7)) == []  # type: ignore[arg-type]
