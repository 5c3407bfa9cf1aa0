"""The walls near a place: none within reach is left out, whatever was asked before."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.kernels.geometry import plane
from pilotage.maps.near_walls import FEW, NearWalls

NO_CIRCLES = np.zeros((0, 3))


def many_walls(seed: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """More than are handed out as a whole, short ones and some that cross the floor."""
    rng = np.random.default_rng(seed)
    begin = rng.uniform(-20.0, 20.0, (4 * FEW, 2))
    length = np.where(rng.random(4 * FEW) < 0.02, 30.0, 0.5)
    return np.hstack([begin, begin + length[:, None] * rng.standard_normal((4 * FEW, 2))])


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 1000),
    st.lists(st.tuples(st.floats(-25, 25), st.floats(-25, 25), st.floats(0.0, 12.0)), max_size=12),
)
def test_every_wall_within_reach_is_handed_out(seed: int, asked: list[tuple[float, float, float]]) -> None:
    segments = many_walls(seed)
    walls = NearWalls(segments)
    for x, y, reach in asked:
        near = walls.near(x, y, reach)
        truth = plane.distance_to_nearest(x, y, segments, NO_CIRCLES)
        if truth < reach:
            assert plane.distance_to_nearest(x, y, near, NO_CIRCLES) == truth
        for wall in segments[::7]:
            if plane.distance_to_nearest(x, y, wall[None], NO_CIRCLES) < reach:
                assert (near == wall).all(axis=1).any()


def test_a_reach_of_a_robot_is_a_small_part_of_many_walls() -> None:
    segments = many_walls(0)
    assert NearWalls(segments).near(0.0, 0.0, 0.5).shape[0] < 0.2 * segments.shape[0]


def test_few_walls_are_handed_out_as_they_are() -> None:
    segments = many_walls(0)[:FEW]
    assert NearWalls(segments).near(0.0, 0.0, 0.5) is segments
