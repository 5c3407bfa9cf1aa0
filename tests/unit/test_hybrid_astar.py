"""Hybrid A*: the whole path keeps the true outline clear, turns no tighter than it may, ends at the goal."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import pilotage as pl
from pilotage.core.types import Goal, Pose2
from pilotage.kernels.bodies.outline import outline_clearance
from pilotage.kernels.rrt import hybrid
from pilotage.kernels.rrt.clearance import Space
from pilotage.kernels.rrt.dubins import advance
from pilotage.kernels.rrt.reeds_shepp import follow, shortest, word_length
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap
from pilotage.models.footprint import Footprint
from pilotage.stack.planning.hybrid_astar import HybridAstarConfig, HybridAstarPlanner
from pilotage.stack.planning.outline import car_of, ground_of
from pilotage.stack.planning.plan_status import PlanStatus
from support.yards import BAY, CAR, TURNING_M, YARDS, check_car_path, gears, least_clearance_m, request, yard


@pytest.mark.parametrize("name", YARDS)
@pytest.mark.parametrize("theta", [0.0, math.pi / 2, -2.5])
def test_the_whole_path_is_clear_smooth_and_ends_at_the_goal(name: str, theta: float) -> None:
    world = YARDS[name]
    start, goal = Pose2(1.5, 4.5, theta), Goal(7.5, 5.5, -theta)
    planner = HybridAstarPlanner(HybridAstarConfig(clearance_m=0.08))
    result = planner.plan(request(world, start, goal))
    assert result.path is not None, result.reason
    # Between two looks, 4 cm apart, a corner moves little: a chord's sagitta and the outline's turn.
    assert least_clearance_m(result.path, world) >= 0.08 - 0.02 * (1.0 + CAR.radius_m / TURNING_M) - 1e-9
    assert least_clearance_m(result.path, world) > 0.0
    check_car_path(result.path, start, goal, 1.1 * TURNING_M)


def test_it_backs_into_a_bay() -> None:
    start, goal = Pose2(1.5, 5.5, 0.0), Goal(4.5, 8.5, -math.pi / 2)
    result = HybridAstarPlanner(HybridAstarConfig()).plan(request(BAY, start, goal))
    assert result.path is not None, result.reason
    assert least_clearance_m(result.path, BAY) > 0.02
    assert gears(result.path)[-1] < 0.0, "its nose looks out"


def test_what_does_not_fit_is_a_status_with_its_reason() -> None:
    world = yard((4.5, 4.5, 0.2, 9.0))
    planner = HybridAstarPlanner(HybridAstarConfig(most_expansions=3000))
    shut = planner.plan(request(world, Pose2(1.5, 4.5, 0.0), Goal(7.5, 5.5, 0.0)))
    assert (shut.status, shut.path) == (PlanStatus.NO_PATH, None)
    assert "no path from start to goal is wide enough for the outline: 0.40 m" in shut.reason
    assert shut.planning_time_s < 2.0
    at_wall = planner.plan(request(world, Pose2(0.2, 4.5, 0.0), Goal(3.0, 5.5, 0.0)))
    assert at_wall.status is PlanStatus.START_BLOCKED or at_wall.path is not None
    nose_in = planner.plan(request(world, Pose2(1.5, 4.5, 0.0), Goal(8.5, 5.5, 0.0)))
    assert nose_in.status is PlanStatus.GOAL_BLOCKED
    assert "outline" in nose_in.reason


def test_what_the_disc_inside_cannot_show_is_searched_to_the_end() -> None:
    """A gap that lets the disc inside pass, and in which the car cannot turn to its goal."""
    world = yard((4.5, 2.0, 0.2, 4.0), (4.5, 7.3, 0.2, 4.2))
    planner = HybridAstarPlanner(HybridAstarConfig(most_expansions=3000, clearance_m=0.2))
    result = planner.plan(request(world, Pose2(1.5, 4.5, 0.0), Goal(4.5, 4.6, math.pi / 2)))
    assert result.path is None
    assert result.iterations > 0 or result.status is PlanStatus.GOAL_BLOCKED


def test_a_narrow_car_knows_its_way_around_thin_walls() -> None:
    """Estimates looked through walls for who is no thicker than the map's nodes lie apart: it gave up."""
    foot = [[0.3, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.3, -0.1]]
    ends = (1.0, 1.0, 0.0), (2.0, 27.0, 1.57)
    found = pl.plan("museum", *ends, planner="hybrid-astar", footprint=foot, set={"smoother": "none"})
    assert found.success, found.reason
    assert found.length_m < 1.1 * found.shortest_length_m


def test_a_goal_without_a_heading_is_reached_in_one_that_fits() -> None:
    """Straight at it the car would stand across a lane that is narrower than the car is long."""
    world = yard((2.6, 6.5, 4.0, 3.0), (7.4, 6.5, 2.8, 3.0))
    assert world.segments_m.shape[0] > 4
    ask = request(world, Pose2(1.5, 4.0, 0.0), Goal(5.3, 5.6))
    result = HybridAstarPlanner(HybridAstarConfig()).plan(ask)
    assert result.status is PlanStatus.FOUND, result.reason
    assert result.path is not None
    x, y, theta = result.path.states[-1].tolist()
    assert (x, y) == pytest.approx((5.3, 5.6), abs=1e-6)
    assert abs(math.sin(theta)) > 0.8, "along the lane"
    assert least_clearance_m(result.path, world) > 0.0


def test_the_same_query_has_the_same_answer() -> None:
    world = YARDS["a narrow gate"]
    asked = request(world, Pose2(1.5, 4.5, 0.0), Goal(7.5, 5.5, 0.0))
    first, second = (HybridAstarPlanner(HybridAstarConfig()).plan(asked) for _ in range(2))
    assert first.path is not None
    assert second.path is not None
    assert (first.path.states == second.path.states).all()


def test_a_small_table_of_cells_finds_the_same_path() -> None:
    """On large maps only the cells that are reached are kept: all of one of 256 m took 3 GB."""
    query = request(YARDS["a wall to go around"], Pose2(1.5, 4.5, 0.0), Goal(7.5, 5.5, 0.0))
    few, many = (
        HybridAstarPlanner(HybridAstarConfig(most_expansions=most)).plan(query) for most in (4000, 150_000)
    )
    assert few.path is not None
    assert many.path is not None
    assert few.reason == many.reason, "as many expansions, as long a path"
    assert np.array_equal(few.path.states, many.path.states)


CLEARANCE_M = 0.06


def car_and_ground(world: SegmentMap) -> tuple[hybrid.Car, Space]:
    field = DistanceField.from_map(world)
    car = car_of(CAR, CLEARANCE_M, TURNING_M)
    ground = ground_of(field, car)
    return car, ground


@pytest.mark.parametrize("name", YARDS)
def test_curves_and_steps_fit_where_every_pose_of_them_does(name: str) -> None:
    """What is passed over, as there is room for it, would have fitted."""
    car, ground = car_and_ground(YARDS[name])
    rng = np.random.default_rng(5)
    fitted = 0
    for _ in range(400):
        x, y, theta = rng.uniform([0.5, 0.5, -math.pi], [8.5, 8.5, math.pi])
        gx, gy, gth = rng.uniform([0.5, 0.5, -math.pi], [8.5, 8.5, math.pi])
        word, _ = shortest(x, y, theta, gx, gy, gth, TURNING_M, 1.5)
        length = word_length(word, TURNING_M)
        count = max(1, math.ceil(length / hybrid.CHECK_M))
        c, s = math.cos(theta), math.sin(theta)
        along = [follow(word, length * i / count, TURNING_M) for i in range(1, count + 1)]
        every = all(
            hybrid.pose_fits(x + c * wx - s * wy, y + s * wx + c * wy, theta + turned, car, ground)
            for wx, wy, turned, _ in along
        )
        assert hybrid.word_fits(x, y, theta, word, car, ground, hybrid.CHECK_M) == every
        spare = hybrid.spare_at(x, y, theta, car, ground)
        for turn, step in ((0, 0.25), (1, 0.5), (-1, -0.5)):
            count = math.ceil(abs(step) / hybrid.CHECK_M)
            ends = [advance(x, y, theta, turn, TURNING_M, step * i / count) for i in range(1, count + 1)]
            every = all(hybrid.pose_fits(*end, car, ground) for end in ends)
            # Who has no room where it stands is asked for none: a search begins where it fits.
            if spare >= 0.0:
                assert hybrid.arc_fits(x, y, theta, turn, step, spare, car, ground) == every
                fitted += every
    assert 100 < fitted < 1200


def test_whoever_has_room_may_move_by_as_much() -> None:
    """Poses whose outline's points are no farther away than there is to spare fit as well."""
    car, ground = car_and_ground(YARDS["a narrow gate"])
    rng = np.random.default_rng(6)
    roomy = 0
    for _ in range(2000):
        x, y, theta = rng.uniform([0.5, 0.5, -math.pi], [8.5, 8.5, math.pi])
        spare = hybrid.spare_at(x, y, theta, car, ground)
        assert hybrid.pose_fits(x, y, theta, car, ground) == (spare >= 0.0)
        if spare < 0.0:
            continue
        share, way = rng.uniform(), rng.uniform(-math.pi, math.pi)
        turned = math.copysign(share * spare / car.radius, rng.uniform(-1.0, 1.0))
        moved = (1.0 - share) * spare - 1e-9
        assert hybrid.pose_fits(
            x + moved * math.cos(way), y + moved * math.sin(way), theta + turned, car, ground
        )
        roomy += spare > 0.05
    assert roomy > 300


def test_what_is_near_tells_as_much_as_all_that_stands_there() -> None:
    """On a map of thousands of walls each look at the outline asked them all."""
    world = YARDS["a narrow gate"]
    car, ground = car_and_ground(world)
    rng = np.random.default_rng(7)
    close = 0
    for x, y, theta in rng.uniform([0.0, 0.0, -math.pi], [9.0, 9.0, math.pi], (3000, 3)).tolist():
        spare = hybrid.spare_at(x, y, theta, car, ground)
        c, s = math.cos(theta), math.sin(theta)
        clear = outline_clearance(x, y, c, s, car.corners, car.radius, world.segments_m, world.circles_m)
        assert (spare >= 0.0) == (clear >= CLEARANCE_M)
        assert spare <= max(clear - CLEARANCE_M, 0.0) + 1e-9
        close += abs(clear - CLEARANCE_M) < 0.05
    assert close > 100
    assert hybrid.spare_at(9.1, 4.5, 0.0, car, ground) < 0.0, "off the map nothing is known"
    alone = ground._replace(margin=0.0)
    assert hybrid.spare_at(1.0, 4.5, 0.0, car, alone) >= 0.0, "the disc around it is free"
    assert hybrid.spare_at(0.5, 4.5, 0.0, car, alone) < 0.0, "a field alone knows no outline"


HALL = yard(
    *((6.0 * i + 3.0 * (k % 2), 3.0 * k, 0.3, 2.0) for i in range(1, 4) for k in range(1, 6)), side_m=18.0
)
ACROSS = Pose2(1.5, 1.5, 0.0), Goal(16.0, 16.0, 0.0)


def test_a_large_floor_is_crossed_with_few_expansions() -> None:
    """By estimates below the truth nearly every place is as good: patience alone gives up."""
    patient = HybridAstarConfig(most_expansions=5000, greed=1.0)
    given_up = HybridAstarPlanner(patient).plan(request(HALL, *ACROSS))
    assert given_up.path is None
    assert "given up after 5001" in given_up.reason
    found = HybridAstarPlanner(HybridAstarConfig(most_expansions=5000)).plan(request(HALL, *ACROSS))
    assert found.path is not None
    assert found.iterations < 1000
    assert found.path.length_m < 1.1 * math.hypot(14.5, 14.5)
    assert least_clearance_m(found.path, HALL) > 0.0


def test_where_greed_finds_nothing_patience_does() -> None:
    world, start, goal = YARDS["a narrow gate"], Pose2(1.5, 4.5, 0.0), Goal(7.5, 5.5, 0.0)
    patient = HybridAstarPlanner(HybridAstarConfig(greed=1.0)).plan(request(world, start, goal))
    # Enough for one expansion: the greedy searches from either end are stopped at the second.
    both = HybridAstarPlanner(HybridAstarConfig(greedy_share=1e-5)).plan(request(world, start, goal))
    assert patient.path is not None
    assert both.path is not None
    assert np.array_equal(both.path.states, patient.path.states)
    assert both.iterations == patient.iterations + 4


def test_where_all_cells_were_looked_at_in_vain_smaller_ones_find_a_path() -> None:
    """Through a door 7 cm wider on either side than the outline, 1 cm more than it keeps."""
    walls = [[0.0, 0.0, 8.0, 0.0], [8.0, 0.0, 8.0, 5.0], [8.0, 5.0, 0.0, 5.0], [0.0, 5.0, 0.0, 0.0]]
    door = [[4.0, 0.0, 4.0, 2.13], [4.0, 2.87, 4.0, 5.0]]
    world = SegmentMap(np.array([*walls, *door]), np.zeros((0, 3)), (0.0, 0.0, 8.0, 5.0))
    long = Footprint.polygon(np.array([[0.9, 0.3], [-0.3, 0.3], [-0.3, -0.3], [0.9, -0.3]]))
    ask = request(world, Pose2(1.5, 1.0, 1.57), Goal(6.5, 4.0, 1.57))
    ask = replace(ask, footprint=long, least_turning_radius_m=0.5)
    found = HybridAstarPlanner(HybridAstarConfig(cell_m=0.2)).plan(ask)
    assert found.path is not None, found.reason
    corners = np.ascontiguousarray(long.points_m)
    for x, y, theta in found.path.states:
        c, s = math.cos(theta), math.sin(theta)
        around = corners, long.radius_m, world.segments_m, world.circles_m
        assert outline_clearance(x, y, c, s, *around) > 0.0


CAR_AT_THE_KERB = Footprint.polygon(np.array([[0.8, 0.3], [-0.2, 0.3], [-0.2, -0.3], [0.8, -0.3]]))


@pytest.mark.parametrize(("gap_m", "kerb_m"), [(1.9, 0.07), (1.6, 0.07), (1.45, 0.1), (1.4, 0.15)])
@pytest.mark.parametrize("parks", [True, False])
def test_a_car_of_a_metre_parks_in_a_gap_not_much_longer_and_leaves_it(
    gap_m: float, kerb_m: float, parks: bool
) -> None:
    """Steps of 25 cm lead nowhere between two cars: it looked for half a minute where 13 moves do."""
    end = 4.0 + gap_m
    street = [[0, 0, 10, 0], [10, 0, 10, 3.2], [10, 3.2, 0, 3.2], [0, 3.2, 0, 0]]
    cars = [[2, 0, 2, 0.7], [2, 0.7, 4, 0.7], [4, 0.7, 4, 0], [end, 0, end, 0.7], [end, 0.7, 8, 0.7]]
    world = SegmentMap(np.array([*street, *cars], dtype=float), np.zeros((0, 3)), (0.0, 0.0, 10.0, 3.2))
    poses = [Pose2(1.0, 1.6, 0.0), Pose2(4.0 + 0.5 * (gap_m - 1.0) + 0.2, kerb_m + 0.3, 0.0)]
    start, goal = poses if parks else poses[::-1]
    ask = request(world, start, Goal(goal.x_m, goal.y_m, goal.theta_rad))
    ask = replace(ask, footprint=CAR_AT_THE_KERB, least_turning_radius_m=0.6 / math.tan(0.5))
    result = HybridAstarPlanner(HybridAstarConfig()).plan(ask)
    assert result.path is not None, result.reason
    assert result.iterations < 100_000
    check_car_path(result.path, start, ask.goal, 1.1 * ask.least_turning_radius_m)
    corners = np.ascontiguousarray(CAR_AT_THE_KERB.points_m)
    for x, y, theta in result.path.states:
        c, s = math.cos(theta), math.sin(theta)
        around = corners, CAR_AT_THE_KERB.radius_m, world.segments_m, world.circles_m
        assert outline_clearance(x, y, c, s, *around) > 0.04


def test_a_lorry_crosses_its_yard_in_steps_of_its_own_size() -> None:
    """In steps of 25 cm it gave up, some metres from where it began."""
    sides = [[0, 0, 128, 0], [128, 0, 128, 88], [128, 88, 0, 88], [0, 88, 0, 0]]
    halls = [[40, 0, 40, 32], [40, 44, 40, 88], [80, 0, 80, 48], [80, 60, 80, 88]]
    racks = [[40, 52, 60, 52], [70, 52, 80, 52], [100, 24, 112, 24], [112, 24, 112, 34], [16, 56, 24, 56]]
    walls = np.array([*sides, *halls, *racks], dtype=float)
    world = SegmentMap(walls, np.zeros((0, 3)), (0.0, 0.0, 128.0, 88.0))
    lorry = Footprint.polygon(np.array([[5.3, 2.0], [-1.3, 2.0], [-1.3, -2.0], [5.3, -2.0]]))
    turning_m = 4.0 / math.tan(0.5)
    start, goal = Pose2(12.0, 12.0, 0.3), Goal(116.0, 76.0, 0.0)
    ask = replace(request(world, start, goal), footprint=lorry, least_turning_radius_m=turning_m)
    result = HybridAstarPlanner(HybridAstarConfig()).plan(ask)
    assert result.path is not None, result.reason
    assert result.path.length_m < 1.5 * math.hypot(104.0, 64.0)
    check_car_path(result.path, start, goal, 1.1 * turning_m)
    corners = np.ascontiguousarray(lorry.points_m)
    for x, y, theta in result.path.states[::4]:
        c, s = math.cos(theta), math.sin(theta)
        around = corners, lorry.radius_m, world.segments_m, world.circles_m
        assert outline_clearance(x, y, c, s, *around) > 0.0
