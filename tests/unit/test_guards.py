"""What is seen from where, against brute force; the fewest guards of rooms whose number is known."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import linprog

from pilotage.core.types import BoolArray, FloatArray
from pilotage.evaluation.guards import fewest_guards
from pilotage.kernels.patrol.cover import holding_no_other
from pilotage.kernels.patrol.visibility import seen_from
from pilotage.kernels.scans.sight import hidden
from pilotage.maps.floor import Floor
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.stack.patrol.derive import views

WALLS = np.array([[0, 0, 8, 0], [8, 0, 8, 6], [8, 6, 0, 6], [0, 6, 0, 0], [4, 0, 4, 2.5], [4, 3.5, 4, 6.0]])
ROOMS = SegmentMap(WALLS, np.array([[2.0, 4.0, 0.3]]), (0.0, 0.0, 8.0, 6.0))
POINTS = np.stack(np.meshgrid(np.arange(0.2, 8.0, 0.4), np.arange(0.2, 6.0, 0.4)), axis=-1).reshape(-1, 2)


def in_view(place: FloatArray, reach_m: float, margin_rad: float) -> BoolArray:
    """By one line of sight a point; with a margin, that of three neighbouring lines, the least."""
    (x, y), out = place, np.zeros(len(POINTS), np.bool_)
    for k, (px, py) in enumerate(POINTS):
        away, bearing = math.hypot(px - x, py - y), math.atan2(py - y, px - x)
        ends = [
            (x + away * math.cos(bearing + d), y + away * math.sin(bearing + d))
            for d in (-margin_rad, 0.0, margin_rad)
        ]
        out[k] = away <= reach_m and not any(
            hidden(x, y, *end, ROOMS.segments_m, ROOMS.circles_m) for end in ends
        )
    return out


def test_what_is_called_seen_is_in_sight_and_little_in_sight_is_missed() -> None:
    rng = np.random.default_rng(5)
    for _ in range(12):
        place = np.array([rng.uniform(0.3, 3.7), rng.uniform(0.3, 3.4)])
        seen = seen_from(place[None], 5.0, POINTS, 720, ROOMS.segments_m, ROOMS.circles_m)[0]
        assert seen.any()
        assert not (seen & ~in_view(place, 5.0, 0.0)).any()
        assert not (in_view(place, 5.0, 2.0 * math.pi / 720) & ~seen).any()


def test_one_room_needs_one_guard_and_three_in_a_row_one_in_each_door() -> None:
    walls = [[0, 0, 12, 0], [12, 0, 12, 4], [12, 4, 0, 4], [0, 4, 0, 0]]
    walls += [[4, 0, 4, 3], [8, 1, 8, 4]]
    for segments, fewest in ((walls[:4], 1), (walls, 2)):
        rooms = SegmentMap(np.array(segments, dtype=float), np.zeros((0, 3)), (0.0, 0.0, 12.0, 4.0))
        world = WorldMap("row", rooms.bounds_m, geometry=rooms)
        _, _, seen = views(world, Floor.of(world, 0.2), 30.0, 0.5, 0.5)
        assert fewest_guards(seen) == (fewest, fewest)


def test_the_bound_holds_where_greed_takes_one_too_many() -> None:
    seen = np.array([[1, 1, 0, 1, 1, 0], [1, 1, 1, 0, 0, 0], [0, 0, 0, 1, 1, 1]], dtype=np.bool_)
    assert fewest_guards(seen) == (2, 3)
    assert fewest_guards(np.zeros((3, 4), np.bool_)) == (0, 0)


def test_what_others_imply_is_left_out_and_changes_no_bound() -> None:
    """The relaxation of all the rows and columns has the same optimum."""
    rng = np.random.default_rng(7)
    for _ in range(20):
        seen = rng.random((12, 30)) < 0.25
        some = seen[:, seen.any(axis=0)].astype(float)
        whole = linprog(np.ones(12), A_ub=-some.T, b_ub=-np.ones(some.shape[1]))
        least, enough = fewest_guards(seen)
        assert whole.fun is not None
        assert least == math.ceil(whole.fun - 1e-6) <= enough


def test_of_sets_those_are_kept_that_hold_no_other_one() -> None:
    rng = np.random.default_rng(11)
    for count, size in ((1, 1), (20, 5), (30, 64), (40, 130)):
        sets = rng.random((count, size)) < rng.choice([0.05, 0.3, 0.9])
        sets[count // 2] = sets[0]
        packed = np.packbits(np.pad(sets, ((0, 0), (0, -size % 64))), axis=1).view(np.uint64)
        kept = [
            not any(
                not (sets[j] & ~sets[i]).any() and (sets[j].sum() < sets[i].sum() or j < i)
                for j in range(count)
                if j != i and (sets[j].sum(), j) < (sets[i].sum(), i)
            )
            for i in range(count)
        ]
        assert holding_no_other(packed, sets.sum(axis=1)).tolist() == kept
