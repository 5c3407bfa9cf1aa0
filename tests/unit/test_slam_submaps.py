"""Submaps of a track, drawn when they are asked for."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest

from pilotage.stack.mapping.slam import submaps as room
from pilotage.stack.mapping.slam.clouds import Clouds
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.submaps import KEPT_SUBMAPS, Extent, Submaps


@pytest.mark.parametrize(("count", "looks"), [(300, 1), (KEPT_SUBMAPS + 1, 2)])
def test_a_buildings_submaps_are_drawn_once_and_no_more_are_kept_than_memory_has(
    count: int, looks: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Intel's 292 were drawn seven times each: each round looks at all of them, and 64 were kept."""
    drawn: Counter[int] = Counter()
    draw = room.drawn

    def counted(clouds: Clouds, poses: Any, chosen: Any, frame: Any, cell_m: float) -> room.Submap:
        drawn[int(chosen[0])] += 1
        return draw(clouds, poses, chosen, frame, cell_m)

    monkeypatch.setattr(room, "drawn", counted)
    submaps = Submaps(SlamConfig())
    clouds = Clouds.of([np.tile([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], (2, 1))] * count)
    submaps.lay(clouds, np.zeros((count, 3)), [Extent(k, k, k) for k in range(count)])
    for _ in range(2):
        for index in range(count):
            assert submaps[index].fine.shape == (1, 6)
    assert set(drawn.values()) == {looks}
    assert len(submaps._drawn) <= KEPT_SUBMAPS
