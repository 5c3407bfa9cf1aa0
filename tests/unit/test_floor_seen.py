"""What of a floor was seen when, against brute force; the fewest guards of rooms whose number is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.types import BoolArray, FloatArray
from pilotage.evaluation.floor_seen import floor_seen, guard_bound
from pilotage.kernels.scans.sight import hidden
from pilotage.maps.floor import Floor
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.stack.patrol.derive import views

WALLS = np.array([[0, 0, 8, 0], [8, 0, 8, 6], [8, 6, 0, 6], [0, 6, 0, 0], [4, 0, 4, 2.5], [4, 3.5, 4, 6.0]])
ROOMS = SegmentMap(WALLS, np.array([[2.0, 4.0, 0.3]]), (0.0, 0.0, 8.0, 6.0))
POINTS = np.stack(np.meshgrid(np.arange(0.2, 8.0, 0.4), np.arange(0.2, 6.0, 0.4)), axis=-1).reshape(-1, 2)


def in_view(pose: FloatArray, reach_m: float, half_view_rad: float, margin_rad: float) -> BoolArray:
    """By one line of sight a point; with a margin, that of three neighbouring lines, the least."""
    x, y, theta = pose
    out = np.zeros(len(POINTS), np.bool_)
    for k, (px, py) in enumerate(POINTS):
        away, bearing = math.hypot(px - x, py - y), math.atan2(py - y, px - x)
        turned = (bearing - theta + math.pi) % (2.0 * math.pi) - math.pi
        ends = [
            (x + away * math.cos(bearing + d), y + away * math.sin(bearing + d))
            for d in (-margin_rad, 0.0, margin_rad)
        ]
        out[k] = (
            away <= reach_m
            and abs(turned) <= half_view_rad - margin_rad
            and not any(hidden(x, y, *end, ROOMS.segments_m, ROOMS.circles_m) for end in ends)
        )
    return out


@pytest.mark.parametrize("view_rad", [2.0 * math.pi, math.pi])
def test_what_is_called_seen_is_in_sight_and_little_in_sight_is_missed(view_rad: float) -> None:
    rng = np.random.default_rng(5)
    for _ in range(12):
        pose = np.array([rng.uniform(0.3, 3.7), rng.uniform(0.3, 3.4), rng.uniform(-3.0, 3.0)])
        found = floor_seen(np.array([0.0, 1.0]), pose[None, None].repeat(2, 0), POINTS, ROOMS, 5.0, view_rad)
        seen = found.point_worst_s == 1.0  # just before the second look all are 1 s old
        assert seen.all()
        seen = found.point_last_s == 1.0
        assert not (seen & ~in_view(pose, 5.0, 0.5 * view_rad, 0.0)).any()
        surely = in_view(pose, 5.0, 0.5 * view_rad, 2.0 * math.pi / 720)
        assert not (surely & ~seen).any()


def test_ages_windows_and_robots_that_see_nothing() -> None:
    left, right = np.array([1.0, 3.0, 0.0]), np.array([7.0, 1.0, 0.0])
    nothing = np.full(3, math.nan)
    poses = np.array([[left, right], [left, nothing], [left, nothing], [nothing, right]])
    found = floor_seen(np.array([0.0, 10.0, 20.0, 30.0]), poses, POINTS, ROOMS, 20.0, windows_s=(0.0, 25.0))
    of_left, of_right = in_view(left, 20.0, 4.0, 0.01), in_view(right, 20.0, 4.0, 0.01)
    only_right = of_right & ~in_view(left, 20.0, 4.0, 0.0)
    only_left = of_left & ~in_view(right, 20.0, 4.0, 0.0)
    assert only_left.any()
    assert only_right.any()
    assert (found.point_worst_s[only_right] == 30.0).all()
    assert (found.point_mean_s[only_right] == 7.5).all()  # 0, 10, 20, 0
    assert (found.point_last_s[only_left] == 20.0).all()
    assert found.share[3, 0] == pytest.approx(np.mean(found.point_last_s == 30.0))
    assert found.share[3, 1] > found.share[3, 0]
    assert found.age_worst_s == 30.0
    later = floor_seen(np.array([0.0, 10.0, 20.0, 30.0]), poses, POINTS, ROOMS, 20.0, warm_s=30.0)
    assert later.point_mean_s[only_left] == pytest.approx(10.0)


def test_one_room_needs_one_guard_and_three_in_a_row_one_in_each_door() -> None:
    walls = [[0, 0, 12, 0], [12, 0, 12, 4], [12, 4, 0, 4], [0, 4, 0, 0]]
    walls += [[4, 0, 4, 3], [8, 1, 8, 4]]
    for segments, fewest in ((walls[:4], 1), (walls, 2)):
        rooms = SegmentMap(np.array(segments, dtype=float), np.zeros((0, 3)), (0.0, 0.0, 12.0, 4.0))
        world = WorldMap("row", rooms.bounds_m, geometry=rooms)
        _, _, seen = views(world, Floor.of(world, 0.2), 30.0, 0.5, 0.5)
        assert guard_bound(seen) == (fewest, fewest)


def test_the_bound_holds_where_greed_takes_one_too_many() -> None:
    seen = np.array([[1, 1, 0, 1, 1, 0], [1, 1, 1, 0, 0, 0], [0, 0, 0, 1, 1, 1]], dtype=np.bool_)
    assert guard_bound(seen) == (2, 2)
    assert guard_bound(np.zeros((3, 4), np.bool_)) == (0, 0)
