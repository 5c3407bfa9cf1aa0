"""People around the robot: what stands where it was seen through is no part of the building."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.slam.frames import between
from pilotage.kernels.slam.local_map import add_to_map, empty_map
from pilotage.kernels.slam.movers import (
    MOST,
    VOTES,
    add_view,
    empty_views,
    looked_through,
    seen_through,
    without_movers,
)
from pilotage.stack.mapping.slam.clouds import cloud_of_beams
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.tracker import Tracker
from support.laser_rooms import furnished, ranges, room

STEP = np.radians(1.0)
HERE = np.array([2.0, 3.5, 0.2])


def box(x: float, y: float, half_m: float = 0.2) -> FloatArray:
    return np.array(room(x - half_m, y - half_m, x + half_m, y + half_m))


def seen(walls: FloatArray, pose: FloatArray, first_deg: float = -90.0, beams: int = 181) -> FloatArray:
    angles = np.radians(first_deg) + STEP * np.arange(beams)
    return cloud_of_beams(ranges(walls, pose, angles), angles, float(STEP), 25.0)


def through(points: FloatArray, pose: FloatArray, earlier: FloatArray) -> BoolArray:
    views = empty_views(400)
    for _ in range(3 * VOTES):
        add_view(views, earlier, np.zeros(3))
    return seen_through(points, pose, np.zeros(len(points), np.bool_), views)


@pytest.mark.parametrize("first_deg", [-90.0, -180.0, 60.0])
def test_who_came_is_told_from_walls(first_deg: float) -> None:
    beams = 181 if first_deg == -90.0 else 360
    before = seen(furnished(), HERE, first_deg, beams)
    there = HERE + np.array([0.3, 0.1, 0.3])
    visitor = np.concatenate([furnished(), box(3.4, 4.2)])
    now = seen(visitor, there, first_deg, beams)
    told = through(now, between(HERE, there), before)
    world = there[:2] + now[:, :2] @ np.array(
        [[np.cos(there[2]), np.sin(there[2])], [-np.sin(there[2]), np.cos(there[2])]]
    )
    own = np.abs(world - (3.4, 4.2)).max(axis=1) < 0.21
    assert own.sum() > 10
    assert told[own].mean() > 0.8
    assert not told[~own].any()
    # The guess of the motion may be some centimetres and degrees off.
    off = between(HERE, there + np.array([0.05, -0.05, 0.03]))
    assert through(now, off, before)[~own].mean() < 0.02


def test_beams_that_hit_nothing_tell_nothing() -> None:
    wall = np.array([(6.0, 1.0, 6.0, 9.0)])
    before = seen(wall, HERE)
    now = seen(np.concatenate([wall, box(2.0, 5.0)]), HERE)
    aside = now[:, 1] > 1.0
    assert not through(now, np.zeros(3), before)[aside & (now[:, 0] < 1.0)].any()
    assert not through(now, np.zeros(3), before[:5]).any()


def test_a_scan_of_which_most_seems_to_move_is_left_whole() -> None:
    views, hall, nothing = empty_views(200), np.array(room(0.0, 0.0, 10.0, 8.0)), empty_map(200)
    few = seen(np.concatenate([hall, box(4.0, 4.0)]), HERE)
    kept, _ = without_movers(few, HERE, nothing, views)
    assert len(kept) == len(few)
    for _ in range(6):
        add_view(views, seen(hall, HERE), HERE)
    wrong = seen(box(2.0, 3.5, 1.0), HERE)
    kept, share = without_movers(wrong, HERE, nothing, views)
    assert len(kept) == len(wrong)
    assert share >= MOST
    kept, share = without_movers(few, HERE, nothing, views)
    assert len(kept) < len(few)
    assert 0.0 < share < MOST
    # What the map has there has not come.
    known = empty_map(200)
    add_to_map(known, few, HERE, 15, True)
    assert len(without_movers(few, HERE, known, views)[0]) == len(few)


def test_companions_do_not_stop_the_map() -> None:
    """Two people walk along with the robot. As if they were walls, the track stands: 11 m of 14 are lost."""
    rng = np.random.default_rng(2)
    niches = [box(x, y, 0.25) for x in (-1.0, 3.0, 5.5, 8.0, 11.0, 12.0, 16.0) for y in (-1.0, 1.0)]
    walls = np.concatenate([np.array(room(-4.0, -1.0, 20.0, 1.0)), *niches])
    angles = np.radians(-90.0) + STEP * np.arange(181)
    tracker, last = Tracker(SlamConfig()), np.zeros(3)
    for k in range(140):
        pose = np.array([0.1 * k, 0.0, 0.0])
        people = [box(pose[0] + x + 0.2 * np.sin(0.1 * k + x), y) for x, y in ((1.2, 0.6), (1.8, -0.6))]
        around = walls if k < 15 else np.concatenate([walls, *people])
        measured = ranges(around, pose, angles) + 0.01 * rng.standard_normal(181)
        step = 1.03 * between(last, pose)
        tracker.add(cloud_of_beams(measured, angles, float(STEP), 25.0), step, 0.2, 0.2)
        last = pose
    assert np.hypot(*(tracker.pose - last)[:2]) < 0.1


@pytest.mark.parametrize("first_deg", [-90.0, -180.0, 60.0])
def test_nobody_sees_through_walls(first_deg: float) -> None:
    """Of a screen that is gone nearly all is looked through, of what stands nothing."""
    beams = 181 if first_deg == -90.0 else 360
    screen = np.array([(3.2, 3.0, 3.4, 4.5)])
    before = seen(np.concatenate([furnished(), screen]), HERE, first_deg, beams)
    there = HERE + np.array([0.2, -0.1, 0.2])
    assert looked_through(before, HERE, before, HERE)[0] == 0
    assert looked_through(seen(furnished(), there, first_deg, beams), there, before[:3], HERE)[0] == 0
    own = np.hypot(before[:, 0] - 1.3, before[:, 1]) < 0.8
    through, asked = looked_through(seen(furnished(), there, first_deg, beams), there, before[own], HERE)
    assert asked == own.sum() > 30
    assert through > 0.8 * asked
    assert looked_through(before[:5], HERE, before, HERE) == (0, 0)


@pytest.mark.parametrize("carried", [False, True])
def test_a_corner_that_fits_is_no_place_where_known_walls_are_looked_through(*, carried: bool) -> None:
    """A robot is carried into a larger room with the same corner; or a cupboard of its own is taken away."""
    corner = [(3.0, 3.0, 3.0, 0.0), (0.0, 3.0, 3.0, 3.0)]
    small = np.array([*corner, (0.0, 0.0, 0.0, 3.0), (0.0, 0.0, 3.0, 0.0)])
    large = np.array([*corner, *room(-6.0, -5.0, 3.0, 3.0)])
    cupboard = np.array([(2.2, 0.4, 2.8, 1.0)])
    rng, angles = np.random.default_rng(3), np.radians(-180.0) + STEP * np.arange(360)
    tracker, pose = Tracker(SlamConfig()), np.array([1.2, 1.4, 0.7])
    for k in range(12):
        walls = np.concatenate([small, cupboard]) if k < 10 else large if carried else small
        measured = ranges(walls, pose, angles) + 0.01 * rng.standard_normal(360)
        tracker.add(cloud_of_beams(measured, angles, float(STEP), 25.0), np.zeros(3), 0.2, 0.2)
    assert tracker.lost_run == (2 if carried else 0)
