"""Robots on patrol that take long to stop: how fast they come to bends, and when they are held up."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pilotage.core.types import FloatArray, Pose2
from pilotage.experiments.build.build import build
from pilotage.experiments.mission import mission_of
from pilotage.kernels.control import disc_returns, safe_stop, voronoi_window
from pilotage.kernels.control.straight_stop import speed_to_stop
from pilotage.kernels.geometry.field import Field
from pilotage.stack.navigator.patrol.approach import Approach
from pilotage.stack.navigator.patrol.gate import NO_GATE
from pilotage.stack.navigator.patrol.states import transitions
from support.two_rooms import DOOR_Y_M, two_rooms


def hall(width_m: float) -> Field:
    """Distances to the walls of a corridor along x, and to one that ends it at x = 4."""
    y, x = np.mgrid[:101, :101] * 0.05
    return np.minimum(0.5 * width_m - np.abs(y - 2.5), 4.0 - x).clip(0.0), 0.0, -2.5, 0.05


WAY = np.array([*([0.25 * k, 0.0] for k in range(9)), *([2.0, 0.25 * k] for k in range(1, 3))])
"""Two metres along the middle, then to the left."""


@pytest.mark.parametrize(
    ("width_m", "way", "most_m_s"), [(1.6, WAY[:3], 1.2), (1.6, WAY, 1.2), (5.0, WAY, 1.2)]
)
def test_brakes_that_stop_within_what_is_straight_on_slow_nobody_down(
    width_m: float, way: FloatArray, most_m_s: float
) -> None:
    assert speed_to_stop(way, hall(width_m), 0.3, 1.2, 2.0, 0.15) == most_m_s


def test_who_could_not_stop_straight_on_after_a_bend_slows_down_before_it() -> None:
    """On 0.3 m/s^2: the wall beside the corridor leaves it 0.25 m, behind 0.25 m of the way that is bent."""
    free_m, bend_m = 0.8 - 0.28 - 0.25, 2.25
    reacts = 0.3 * 0.15
    after = math.sqrt(reacts**2 + 2.0 * 0.3 * free_m) - reacts
    expected = math.sqrt(after**2 + 2.0 * 0.3 * bend_m)
    found = speed_to_stop(WAY, hall(1.6), 0.3, 1.3, 0.3, 0.15)
    assert found == pytest.approx(expected, abs=0.05)
    assert speed_to_stop(WAY[4:], hall(1.6), 0.3, 1.3, 0.3, 0.15) < found


def speed_before_the_door(y_m: float, theta: float, braking_m_s2: float) -> float:
    """Of 1.2 m/s, in front of the wall between two rooms, bound for the other one."""
    stack: Any = build(mission_of(two_rooms(DOOR_Y_M), seed=0)).team[1].stack
    context = stack._context
    roadmap, known = context.roadmap, context.field(lost=False)
    behind = roadmap.time_s(int(np.argmax(roadmap.places_xy_m[:, 0])))
    approach = Approach(1.2, braking_m_s2, 0.9, 0.25, 0.3)
    return approach.speed_m_s(roadmap, Pose2(4.3, y_m, theta), behind, -1, known)


def test_weak_brakes_slow_down_before_a_door_beside_their_way() -> None:
    along_wall = -math.pi / 2
    assert speed_before_the_door(1.6, along_wall, 2.0) == 1.2
    assert speed_before_the_door(1.6, along_wall, 0.3) < 1.1


def set_out(braking_m_s2: float) -> Any:
    values = two_rooms(DOOR_Y_M)
    values["robot"]["motion"]["max_acceleration_m_s2"] = braking_m_s2
    stack: Any = build(mission_of(values, seed=0)).team[1].stack
    return transitions.set_out(stack._context)


def test_who_turns_back_for_long_is_not_held_up_meanwhile() -> None:
    """At 0.3 m/s^2 it takes 6.7 s to come to rest from 1 m/s and to come back as fast."""
    weak, strong = (set_out(braking_m_s2).watch for braking_m_s2 in (0.3, 2.0))
    assert not weak.stalled(5.0, 0.0)
    assert not weak.stalled(5.0, 6.6)
    assert not strong.stalled(5.0, 0.0)
    assert strong.stalled(5.0, 9.1)


@pytest.mark.parametrize("slow_m_s", [0.27, 0.0])
def test_who_sets_out_slowly_leaves_a_door_beside_its_edge(slow_m_s: float) -> None:
    """Down the field it may only creep along the edge; a little beside that it may drive.

    Where being slow costs nothing, 0.03 m/s weigh less than a heading that is four degrees off.
    """
    limits, safety = np.array([1.2, 0.3, 0.3, 1.1, 11.0, 0.1]), np.array([0.15, 0.2, 0.06, 0.1, 1.4])
    nobody, edge = np.zeros((0, 2)), np.array([[0.0, -0.327]])
    rows, columns = np.mgrid[:41, :41]
    ahead = np.array([math.cos(-0.75), math.sin(-0.75)])
    time = 10.0 - (0.15 * (columns - 20) * ahead[0] + 0.15 * (rows - 20) * ahead[1]) / 1.2
    pose, v, w = np.array([0.0, 0.0, -0.75]), 0.0, 0.0
    for _ in range(50):
        near = disc_returns.rotated(edge - pose[:2], -pose[2])
        window = 0.9, 0.3, 0.5, 0.25, 6, 15, slow_m_s
        told_v, told_w, _ = voronoi_window.choose(
            v,
            w,
            pose,
            limits,
            safety,
            (near, nobody, nobody),
            (time, -3.0, -3.0, 0.15),
            NO_GATE,
            (np.zeros((1, 1)), 0.0, 0.0, 0.1),
            0.0,
            window,
        )
        for _ in range(10):
            v, w = safe_stop.toward(v, told_v, 0.003), safe_stop.toward(w, told_w, 0.11)
            pose = pose + 0.01 * np.array([v * math.cos(pose[2]), v * math.sin(pose[2]), w])
            assert np.hypot(*(edge - pose[:2]).T).min() > 0.25
    assert (math.hypot(pose[0], pose[1]) > 0.6) == (slow_m_s > 0.0), pose
