"""Who follows a plan exactly drives so that it can stop on its own half of the way to what is on no map."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.types import FloatArray
from pilotage.experiments.mission import load_mission, mission_of
from pilotage.experiments.run import run_mission
from pilotage.kernels.control.own_half import poses_in_own_half
from pilotage.kernels.rrt.hybrid import poses_that_fit
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap
from pilotage.models.footprint import NO_CORNERS, Footprint
from pilotage.stack.navigator.reference import Reference
from pilotage.stack.navigator.yielding import Act, Yielding, YieldingConfig
from pilotage.stack.planning.outline import car_of, ground_of

CORNERS = np.array([[0.8, 0.3], [-0.2, 0.3], [-0.2, -0.3], [0.8, -0.3]])
RADIUS_M = math.hypot(0.8, 0.3)
AHEAD = np.column_stack([np.arange(0.0, 3.0, 0.01), np.zeros(300), np.zeros(300)])
GAP_M = 0.1


def clear(points: list[tuple[float, float]], corners: FloatArray = CORNERS) -> float:
    """How far straight ahead is clear."""
    outline = (corners, RADIUS_M if len(corners) else 0.3, 0.2)
    return 0.01 * (poses_in_own_half(AHEAD, outline, np.array(points), GAP_M) - 1)


def test_it_goes_half_of_what_is_left_between_both_but_for_the_gap() -> None:
    assert clear([(2.0, 0.0)]) == pytest.approx(0.5 * (2.0 - 0.8 - GAP_M), abs=0.011)
    assert clear([(2.0, 0.0)], NO_CORNERS) == pytest.approx(0.5 * (2.0 - 0.3 - GAP_M), abs=0.011)


def test_along_and_away_it_goes_as_it_likes() -> None:
    assert clear([(0.3, 0.35), (0.0, -0.35), (-0.3, 0.0), (-1.0, 2.0)]) > 2.9
    assert clear([(0.85, 0.0)]) == 0.0


def test_corners_that_a_turn_swings_out_count_and_a_disc_has_none() -> None:
    turn = np.column_stack([np.zeros((60, 2)), np.linspace(0.0, 0.6, 60)])
    beside = np.array([[0.7, 0.45]])
    assert poses_in_own_half(turn, (CORNERS, RADIUS_M, 0.2), beside, GAP_M) < 10
    assert poses_in_own_half(turn, (NO_CORNERS, 0.3, 0.3), beside, GAP_M) == 60


@settings(max_examples=80, deadline=None)
@given(
    st.floats(1.0, 4.0),
    st.floats(-3.2, 3.2),
    st.floats(-3.2, 3.2),
    st.floats(-1.2, 1.2),
    st.floats(-1.2, 1.2),
)
def test_two_that_both_keep_to_their_halves_never_touch(
    apart_m: float, bearing: float, heading: float, bend: float, other_bend: float
) -> None:
    """Whatever each decides, one look at the other's outline is enough for all that follows from it."""

    def outline(pose: FloatArray) -> FloatArray:
        c, s = math.cos(pose[2]), math.sin(pose[2])
        spread = np.linspace(0.0, 1.0, 20, endpoint=False)[:, None]
        sides = np.concatenate(
            [a + spread * (b - a) for a, b in zip(CORNERS, np.roll(CORNERS, -1, 0), strict=True)]
        )
        placed_m: FloatArray = sides @ np.array([[c, s], [-s, c]]) + pose[:2]
        return placed_m

    def arc(bend: float) -> FloatArray:
        s = np.linspace(0.0, 2.0, 200)
        theta = bend * s
        x = np.concatenate([[0.0], np.cumsum(np.cos(theta[1:]) * np.diff(s))])
        y = np.concatenate([[0.0], np.cumsum(np.sin(theta[1:]) * np.diff(s))])
        return np.column_stack([x, y, theta])

    def placed(pose: FloatArray, at: FloatArray) -> FloatArray:
        c, s = math.cos(at[2]), math.sin(at[2])
        return np.array(
            [at[0] + c * pose[0] - s * pose[1], at[1] + s * pose[0] + c * pose[1], at[2] + pose[2]]
        )

    here = np.zeros(3)
    there = np.array([apart_m * math.cos(bearing), apart_m * math.sin(bearing), heading])
    mine, other = outline(here), outline(there)
    gap = np.hypot(*(mine[:, None] - other[None]).transpose(2, 0, 1)).min()
    if gap < 0.2:
        return
    c, s = math.cos(heading), math.sin(heading)
    seen_by_other = (mine - there[:2]) @ np.array([[c, -s], [s, c]])
    ends = []
    for at, path, seen in ((here, arc(bend), other), (there, arc(other_bend), seen_by_other)):
        count = poses_in_own_half(path, (CORNERS, RADIUS_M, 0.2), np.ascontiguousarray(seen), GAP_M)
        ends.append(outline(placed(path[count - 1], at)))
    # Outlines are seen at points some centimetres apart.
    assert np.hypot(*(ends[0][:, None] - ends[1][None]).transpose(2, 0, 1)).min() > 0.5 * GAP_M


def test_a_reference_by_the_clock_gives_its_rows_and_at_half_the_rate_lies_between() -> None:
    rows = np.column_stack([0.1 * np.arange(1, 6), np.zeros((5, 2)), np.full(5, 1.0), np.full(5, 0.2)])
    by_clock, slow = Reference(rows, 0.1), Reference(rows, 0.1)
    slow.rate = 0.5
    for row in rows:
        assert by_clock.step()[:5].tolist() == row.tolist()
        slow.step()
    assert by_clock.done
    assert not slow.done
    x, _, _, v, w, to_go_m = slow.step()
    assert (x, v, w, to_go_m) == pytest.approx((0.3, 0.5, 0.1, 0.2))


def test_who_is_held_up_looks_for_a_path_around_and_then_backs_all_the_way() -> None:
    yielding = Yielding(YieldingConfig(), 0.1, np.random.default_rng(0))
    for x_m in np.arange(0.0, 5.0, 0.03):
        yielding.drove(np.array([x_m, 0.0, 0.0]), backs=False)
    acts = [yielding.step(0.0, 0.0, backs=False) for _ in range(600)]
    done = [act for act in acts if act is not Act.NOTHING]
    assert done[0] is Act.AROUND
    assert set(done[1:]) == {Act.BACK}
    back = yielding.way_back()
    assert back[0, 0] == pytest.approx(4.98)
    assert np.hypot(*(back[-1] - back[0])[:2]) > 2.0
    for pose in back:
        yielding.drove(pose, backs=True)
    assert yielding.way_back()[0, 0] == pytest.approx(back[-1, 0])


@pytest.mark.parametrize("seed", [0, 1])
def test_a_car_drives_around_a_post_that_is_on_no_map(seed: int) -> None:
    """It rammed it: navigator maneuver looked at nothing that its map did not show."""
    post = "world.obstacles=[{kind: circle, centre_m: [3.1, 4.5], radius_m: 0.25}]"
    metrics = run_mission(load_mission("car-park", [post], seed=seed), save=False).metrics
    assert metrics["success"], metrics["reason"]
    assert metrics["collisions"] == 0


def _two_cars(half_width_m: float) -> dict[str, Any]:
    """Two rooms, a corridor between them, and a car in each that is to go to the other."""
    low, high = 4.0 - half_width_m, 4.0 + half_width_m
    corners = [
        *((0, 0), (6, 0), (6, low), (10, low), (10, 0), (16, 0)),
        *((16, 8), (10, 8), (10, high), (6, high), (6, 8), (0, 8)),
    ]
    walls = [[*a, *b] for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    wheels = {"name": "bicycle", "wheelbase_m": 0.4, "max_steering_rad": 0.8, "max_steering_rate_rad_s": 2.0}
    lidar = {
        "name": "lidar",
        "beams": 180,
        "field_of_view_rad": 6.28318,
        "max_range_m": 12,
        "mount": {"x_m": 0.2},
    }
    sides = {
        "west": ((1.5, 3.0, 0.0), (14.5, 3.0)),
        "east": ((14.5, 5.0, math.pi), (1.5, 5.0)),
    }
    return {
        "mission": "two-cars",
        "world": {"map": {"map": "corridor", "walls_m": walls}},
        "robot": {
            "footprint": {"points_m": [[0.6, 0.25], [-0.2, 0.25], [-0.2, -0.25], [0.6, -0.25]]},
            "motion": {**wheels, "max_speed_m_s": 0.8},
            "sensors": {"odometry": {"name": "wheel-odometry"}, "lidar": {**lidar, "mount": {"x_m": 0.2}}},
        },
        "robots": [
            {
                "name": name,
                "start": {"x_m": x, "y_m": y, "theta_rad": theta},
                "goal": {"x_m": to[0], "y_m": to[1], "tolerance_m": 0.4},
            }
            for name, ((x, y, theta), to) in sides.items()
        ],
        "task": "reach",
        "stack": {
            "initial": {"x_var_m2": 0.0009, "y_var_m2": 0.0009, "theta_var_rad2": 0.0009},
            "localizer": "ekf-walls",
            "navigator": "maneuver",
            "planner": "hybrid-astar",
        },
        "run": {"time_limit_s": 200},
    }


@pytest.mark.parametrize(
    ("half_width_m", "seed"),
    [
        (0.5, 1),
        (0.5, 4),
        pytest.param(0.5, 3, marks=pytest.mark.xfail(reason="takes 210 s", strict=False)),
        (0.95, 3),
    ],
)
def test_two_cars_that_meet_in_a_corridor_both_arrive(half_width_m: float, seed: int) -> None:
    """Where there is room for two they pass each other; where there is none one backs out. They rammed.

    Which of them does is left to chance and to their estimates: of six seeds one takes longer than 200 s.
    """
    metrics = run_mission(mission_of(_two_cars(half_width_m), seed=seed), save=False).metrics
    assert metrics["success"], metrics["reason"]
    assert metrics["collisions"] == 0


@pytest.mark.parametrize("dt_s", [0.02, 0.5])
def test_however_long_its_steps_a_car_is_not_astray_where_it_should_be(dt_s: float) -> None:
    """It was held against where it should be at the end of the step: 0.25 m off in steps of half a second."""
    values = _two_cars(0.9)
    values["robots"] = values["robots"][:1]
    values["run"] = {"time_limit_s": 120, "dt_s": dt_s}
    for sensor in values["robot"]["sensors"].values():
        sensor["rate_hz"] = min(10.0, 1.0 / dt_s)
    metrics = run_mission(mission_of(values, seed=1), save=False).metrics
    assert metrics["success"], metrics["reason"]
    assert metrics.get("replans", 0) == 0


def test_poses_fit_until_one_comes_nearer_than_the_first_that_does_not_fit() -> None:
    field = DistanceField.from_map(SegmentMap.of(np.array([[-3.0, 0.5, 3.0, 0.5], [-3.0, -2.0, 3.0, -2.0]])))
    car = car_of(Footprint.polygon(CORNERS), 0.25, 1.0)
    ground = ground_of(field, car)
    along = np.column_stack([np.linspace(-1.0, 1.0, 9), np.zeros((9, 2))])
    assert poses_that_fit(along, 1e-3, car, ground) == 9
    assert poses_that_fit(along + 0.01 * np.arange(9)[:, None] * [0, 1, 0], 1e-3, car, ground) == 1
    assert poses_that_fit(along - 0.01 * np.arange(9)[:, None] * [0, 1, 0], 1e-3, car, ground) == 9
