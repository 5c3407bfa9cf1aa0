"""Floors swept in lines: all of it, nothing touched, not much longer than it must be."""

from __future__ import annotations

import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Goal, Pose2
from pilotage.experiments.build.build import build
from pilotage.experiments.mission import mission_of
from pilotage.kernels.patrol.swept import mark_swept
from pilotage.kernels.tours.entries import anneal_entries, entries_cost
from pilotage.maps.floor import Floor, sweepable
from pilotage.maps.segment_map import SegmentMap, box_segments
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.stack.interface import Belief
from pilotage.stack.navigator.trail import Trail
from pilotage.stack.planning.boustrophedon import BoustrophedonConfig, BoustrophedonPlanner
from pilotage.stack.planning.node_search import line_length_m
from pilotage.stack.planning.planner import PlanRequest, PlanResult
from pilotage.stack.planning.sweep_detours import completed
from pilotage.stack.planning.sweep_floor import Sought, covered, rest_of, surely_covered, whole_floor
from pilotage.stack.planning.sweep_room import CELLS, Keeping, path_floor
from support.missions import MISSIONS

ROOM = [[0, 0, 10, 0], [10, 0, 10, 8], [10, 8, 0, 8], [0, 8, 0, 0]]
FLOORS = {
    "a room": np.array(ROOM, dtype=float),
    "two rooms": np.array([*ROOM, [6, 0, 6, 3], [6, 4.2, 6, 8]], dtype=float),
    "a box askew": np.vstack([ROOM, box_segments(5.0, 4.0, 2.0, 1.0, 0.6)]),
    "a slanted wall": np.array([*ROOM, [0, 5, 4, 8]], dtype=float),
}
MOST = 1.06
"""Of area over width: 1.1 is what is asked for; the same lines without changes take more. Without the overlap
of passes that forgives what a robot drives beside them, which is 1.2 cm where nothing is said."""


def swept(walls: FloatArray, goal: tuple[float, float] = (1.0, 1.0)) -> tuple[WorldMap, PlanResult]:
    world = WorldMap(
        "floor", (0.0, 0.0, 10.0, 8.0), geometry=SegmentMap(walls, np.zeros((0, 3)), (0.0, 0.0, 10.0, 8.0))
    )
    planner = BoustrophedonPlanner(BoustrophedonConfig(width_m=0.8, clearance_m=0.4, overlap_m=0.0024))
    request = PlanRequest(Pose2(1.0, 1.0, 0.0), Goal(*goal), world.field, np.random.default_rng(0))
    return world, planner.plan(request)


@cache
def swept_floor(name: str) -> tuple[WorldMap, PlanResult]:
    """One of the floors, planned once for all that look at its path."""
    return swept(FLOORS[name])


@pytest.mark.parametrize("name", FLOORS)
def test_the_whole_floor_is_swept_and_nothing_is_touched(name: str) -> None:
    world, result = swept_floor(name)
    assert result.path is not None
    xy = np.ascontiguousarray(result.path.states[:, :2])
    assert min(world.walls.distance_m(x, y) for x, y in xy) >= 0.399
    floor = Floor.of(world, 0.4, 0.8 / 12, (1.0, 1.0))
    covered = np.zeros_like(floor.reachable)
    mark_swept(xy, 0.4, *floor.origin_xy_m, floor.cell_m, covered)
    assert not (floor.reachable & ~covered).any()
    area_m2 = np.count_nonzero(floor.swept) * floor.cell_m**2
    assert result.path.length_m * 0.8 / area_m2 <= MOST


NO_DISCS = np.zeros((0, 3))
NARROW_DOOR = np.array([*ROOM, [6, 0, 6, 3], [6, 3.7, 6, 8]], dtype=float)
BODY = Footprint.disc(0.3)


@pytest.mark.parametrize("clearance_m", [0.36, 0.42, 0.5])
def test_where_there_is_no_room_for_its_clearance_it_goes_with_what_its_body_needs(
    clearance_m: float,
) -> None:
    """A door of 0.7 m, a body of 0.3 m that keeps more where it can, and a room on either side."""
    world = WorldMap(
        "rooms", (0.0, 0.0, 10.0, 8.0), geometry=SegmentMap(NARROW_DOOR, NO_DISCS, (0.0, 0.0, 10.0, 8.0))
    )
    planner = BoustrophedonPlanner(BoustrophedonConfig(width_m=0.8, clearance_m=clearance_m))
    rng = np.random.default_rng(0)
    request = PlanRequest(Pose2(1.0, 1.0, 0.0), Goal(1.0, 1.0), world.field, rng, footprint=BODY)
    result = planner.plan(request)
    assert result.path is not None
    assert result.covers
    xy = np.ascontiguousarray(result.path.states[:, :2])
    kept_m = np.array([world.walls.distance_m(x, y) for x, y in xy])
    assert kept_m.min() >= 0.3
    in_the_door = np.hypot(*(xy - [6.0, 3.35]).T) < 0.6
    assert kept_m[~in_the_door].min() >= clearance_m - 0.001
    floor = Floor.of(world, 0.3, 0.8 / 12, (1.0, 1.0))
    assert not (floor.reachable & ~covered(floor, xy, 0.8)).any()
    area_m2 = np.count_nonzero(sweepable(floor, 0.8)) * floor.cell_m**2
    assert result.path.length_m * 0.8 / area_m2 <= 1.12


def test_a_clearance_that_would_shut_a_door_is_kept_everywhere_else() -> None:
    """A door of 0.48 m in a thin wall, and a body of 0.17 m that would keep 0.25 m."""
    walls = np.array([*ROOM, [6, 0, 6, 3], [6, 3.48, 6, 8]], dtype=float)
    world = WorldMap(
        "rooms", (0.0, 0.0, 10.0, 8.0), geometry=SegmentMap(walls, NO_DISCS, (0.0, 0.0, 10.0, 8.0))
    )
    told = Floor.of(world, 0.17, 0.02, (1.0, 1.0), exact=True)
    floor = path_floor(world.field, Keeping(0.17, 0.25, (1.0, 1.0)), 0.24, told, CELLS[0])
    assert floor.reachable[floor.cell_of(np.array([1.0, 1.0]))]
    assert floor.reachable[floor.cell_of(np.array([8.0, 4.0]))]
    for beside_a_wall in ((0.2, 4.0), (3.0, 0.2), (5.8, 6.0), (9.8, 4.0)):
        assert not floor.reachable[floor.cell_of(np.array(beside_a_wall))]
    through = floor.reachable & (np.abs(floor.clearance_m - 0.24) < 0.005)
    assert np.abs(floor.middles(through)[:, 0] - 6.0).min() < 0.05, "the door's middle"


def test_a_nook_that_coarse_cells_of_a_path_miss_is_swept() -> None:
    """5 cm to spare, on a floor so large that a path's cells are 4 cm wide; it was left without a word."""
    side, low, high = 40.0, 12.03, 12.68
    around = [[0, 0, side, 0], [side, 0, side, side], [side, side, 0, side], [0, side, 0, 0]]
    walls = np.array([*around, [0, low, 6, low], [0, high, 6, high]])
    bounds_m = 0.0, 0.0, side, side
    world = WorldMap("hall", bounds_m, geometry=SegmentMap(walls, NO_DISCS, bounds_m))
    sought = whole_floor(world.field, Keeping(0.3, 0.33, (20.0, 20.0)), 0.6, 0.012)
    assert not (sought.floor.reachable & ~sought.must).any()


def test_a_detour_begins_where_the_floor_is_near_not_where_a_wall_is_between() -> None:
    """What a path left lay 1 m from it, behind a wall, and 4 m on this side: around the wall it went."""
    walls = np.array([*ROOM, [0, 4, 8.8, 4], [2.5, 4, 2.5, 5.5]], dtype=float)
    bounds_m = 0.0, 0.0, 10.0, 8.0
    world = WorldMap("rooms", bounds_m, geometry=SegmentMap(walls, NO_DISCS, bounds_m))
    sought = whole_floor(world.field, Keeping(0.2, 0.25, (1.0, 3.4)), 0.4, 0.012)
    must = np.zeros_like(sought.must)
    must[sought.floor.cell_of(np.array([1.0, 4.5]))] = True
    path = np.array([[1.0, 3.4], [9.4, 3.4], [9.4, 6.0], [4.0, 6.0]])
    found = completed(replace(sought, must=must), path)
    assert (covered(sought.floor, found, 0.4) & must).any()
    assert line_length_m(found) - line_length_m(path) < 9.0


@pytest.mark.parametrize("radius_m", [0.172, 0.175, 0.176, 0.21, 0.25])
def test_all_of_the_floor_is_to_be_swept_however_near_to_walls_its_cells_lie(radius_m: float) -> None:
    """A row of cells along a wall that was none of a path's was out of its reach, and left for good."""
    walls = np.array(
        [[0, 0, 6.2, 0], [6.2, 0, 6.2, 4], [6.2, 4, 0, 4], [0, 4, 0, 0], [3, 0, 3, 2]], dtype=float
    )
    world = WorldMap(
        "rooms", (0.0, 0.0, 6.2, 4.0), geometry=SegmentMap(walls, NO_DISCS, (0.0, 0.0, 6.2, 4.0))
    )
    sought = whole_floor(world.field, Keeping(radius_m, 0.3, (1.0, 1.0)), 1.6 * radius_m, 0.012)
    assert np.array_equal(sought.must, sought.floor.reachable)


def test_a_body_keeps_room_for_what_its_lasers_stop_it_before_where_there_is_some() -> None:
    """Planned for a clearance that the body itself needs it was stopped beside walls, a dozen times."""
    world = WorldMap(
        "rooms", (0.0, 0.0, 10.0, 8.0), geometry=SegmentMap(NARROW_DOOR, NO_DISCS, (0.0, 0.0, 10.0, 8.0))
    )
    planner = BoustrophedonPlanner(BoustrophedonConfig(width_m=0.5, clearance_m=0.3))
    rng = np.random.default_rng(0)
    request = PlanRequest(Pose2(1.0, 1.0, 0.0), Goal(1.0, 1.0), world.field, rng, footprint=BODY)
    path = planner.plan(request).path
    assert path is not None
    kept_m = np.array([world.walls.distance_m(x, y) for x, y in path.states[:, :2]])
    in_the_door = np.hypot(*(path.states[:, :2] - [6.0, 3.35]).T) < 0.6
    assert kept_m[~in_the_door].min() >= 0.33


@pytest.mark.parametrize(
    ("mostly_m", "now_and_then_m", "overlap_m", "counts"),
    [(0.0004, 0.0029, 0.012, True), (0.0206, 0.0527, 0.02, True), (0.0206, 0.2, 0.02, False)],
)
def test_who_is_now_and_then_less_sure_drives_back_only_for_much_of_that(
    mostly_m: float, now_and_then_m: float, overlap_m: float, counts: bool
) -> None:
    """Sure of 0.4 mm, and for a moment of 1.3 mm, it asked for 16 m for three cells; on cells of 0.1 m, where
    passes beside one another are off alike, 485 m were driven for 1.3 m² that were swept."""
    world, whole = swept_floor("a room")
    assert whole.path is not None
    xy, floor = whole.path.states[:, :2], Floor.of(world, 0.4, 0.01, (1.0, 1.0))
    std_m = np.full(len(xy), mostly_m)
    std_m[::3] = now_and_then_m
    swept = surely_covered(floor, np.column_stack([xy, std_m]), 0.8, overlap_m)
    assert np.array_equal(swept, covered(floor, xy, 0.8)) == counts


@pytest.mark.parametrize(("unsure_m", "overlap_m"), [(0.0, 0.0024), (0.01, 0.015), (1.0, 0.04)])
def test_passes_overlap_by_more_where_the_robot_is_unsure_of_its_place(
    unsure_m: float, overlap_m: float
) -> None:
    """Two of 80 m x 44 m were left at 99.976 and 99.985 %: 12 mm, where lines were up to 18 mm apart."""
    world, _ = swept_floor("a room")
    config = BoustrophedonConfig(width_m=0.8, clearance_m=0.4, overlap_m=0.0024)
    rng = np.random.default_rng(0)
    request = PlanRequest(Pose2(1.0, 1.0, 0.0), Goal(1.0, 1.0), world.field, rng, unsure_m=unsure_m)
    path = BoustrophedonPlanner(config).plan(request).path
    assert path is not None
    floor = Floor.of(world, 0.4, 0.8 / 36, (1.0, 1.0), exact=True)
    left = [
        np.count_nonzero(floor.reachable & ~covered(floor, path.states[:, :2], 0.8 - narrower_m))
        for narrower_m in (overlap_m, overlap_m + 0.06)
    ]
    assert left[0] <= 0.001 * np.count_nonzero(floor.reachable)
    assert left[1] > 5 * left[0] + 20, "passes overlap by no more than that"


def test_how_far_along_a_corridor_it_was_takes_nothing_off_what_it_swept() -> None:
    """Lines of 40 m beside walls 3 m apart were driven again and again: 1.49 times area over width."""
    cov = np.diag([0.04, 1e-6, 1e-6])
    trail = Trail()
    for x, y in [(0.1 * k, 1.0) for k in range(50)] + [(4.9, 1.0 + 0.1 * k) for k in range(1, 20)]:
        trail.add(Belief(Pose2(x, y, 0.0), cov))
    std_m = trail.rows[:, 2]
    assert std_m[0] == pytest.approx(0.2), "who has not moved may be off in any direction"
    assert std_m[1:50] == pytest.approx(0.001)
    assert std_m[50:] == pytest.approx(0.2)


def test_of_what_was_driven_the_rest_is_swept_and_no_more() -> None:
    world, whole = swept_floor("a room")
    planner = BoustrophedonPlanner(BoustrophedonConfig(width_m=0.8, clearance_m=0.4))
    assert whole.path is not None

    def rest_after(driven: FloatArray, std_m: FloatArray) -> PlanResult:
        trail = np.column_stack([driven, std_m])
        rng = np.random.default_rng(0)
        here = Pose2(float(driven[-1, 0]), float(driven[-1, 1]), 0.0)
        return planner.plan(PlanRequest(here, Goal(1.0, 1.0), world.field, rng, trail=trail))

    xy = whole.path.states[:, :2]
    sure = np.full(len(xy), 0.005)
    nothing = rest_after(xy, sure)
    assert not nothing.covers
    assert nothing.path is not None
    assert nothing.path.length_m < 0.1
    assert nothing.reason.endswith(" cm²")  # so little is left at a time that it was told as 0.0 m²
    # A third of the way through it was carried off: for four metres it drove its first lines again.
    elsewhere, first = xy.copy(), len(xy) // 3
    elsewhere[first : first + 80] = xy[:80]
    floor = Floor.of(world, 0.4, 0.8 / 12, (1.0, 1.0))
    left = floor.reachable & ~covered(floor, elsewhere, 0.8)
    assert left.any()
    rest = rest_after(elsewhere, sure)
    assert rest.covers
    assert rest.path is not None
    assert not (left & ~covered(floor, rest.path.states[:, :2], 0.8)).any()
    middle = floor.middles(left).mean(axis=0)
    there_and_back_m = 2.0 * float(np.hypot(*(middle - [1.0, 1.0])))
    assert rest.path.length_m < there_and_back_m + 5.0
    # It went astray at once: all of a large room is left.
    again = rest_after(xy[:4], sure[:4]).path
    assert again is not None
    assert not (floor.reachable & ~covered(floor, again.states[:, :2], 0.8)).any()
    assert again.length_m < 1.05 * whole.path.length_m
    # It drove all of it, but for those four metres did not know well where.
    unsure = sure.copy()
    unsure[first : first + 80] = 0.1
    assert rest_after(xy, unsure).covers


def test_the_least_of_what_was_left_is_left_for_good() -> None:
    world, whole = swept_floor("a room")
    assert whole.path is not None
    xy = whole.path.states[:, :2]
    floor = Floor.of(world, 0.4, 0.8 / 12, (1.0, 1.0))
    sought = Sought(floor, floor, floor.reachable, np.zeros_like(floor.reachable), 0.8)
    driven = np.column_stack([xy[40:], np.zeros(len(xy) - 40)])
    rest = rest_of(sought, driven, 0.8, 1.0).must
    share = np.count_nonzero(rest) / np.count_nonzero(floor.reachable)
    assert 0.0 < share < 0.1
    assert not rest_of(sought, driven, 0.8, 1.0 - 1.01 * share).must.any()
    assert (rest_of(sought, np.empty((0, 3)), 0.8, 1.0).must == sought.must).all()
    assert (rest_of(sought, driven, 0.8, 1.0 - 0.99 * share / 2).must <= rest).all()


@pytest.mark.parametrize(("width_m", "most_m2"), [(0.05, 62.5), (1e-5, 2.5e-6), (1e5, 0.0)])
def test_a_pass_that_the_maps_cells_tell_nothing_of_is_refused(width_m: float, most_m2: float) -> None:
    """One was divided by no area, with a warning; the other was told that its start stood in a wall.

    Of 320 m x 236 m one was told to sweep 1.74 m wide, and not that a part of the map would do.
    """
    world, _ = swept_floor("a room")
    remedy = f"; of so narrow a pass cells tell of {most_m2:g} m² at most: take a part of the map"
    remedy *= most_m2 > 0.0
    room = {"map": "room", "bounds_m": list(world.bounds_m), "walls_m": ROOM}
    sweep = f"expected a width_m of 0.0566 to 8 for a map of 10 m x 8 m, found {width_m:g}{remedy}$"
    changed = copy.deepcopy(MISSIONS["sweep-floor"])
    changed["world"] |= {"map": room, "start": {"x_m": 1.0, "y_m": 1.0}}
    changed["task"] = {"name": "sweep-floor", "width_m": width_m}
    with pytest.raises(InputError, match=f"task 'sweep-floor': {sweep}".replace("+", r"\+")):
        build(mission_of(changed))
    planner = BoustrophedonPlanner(BoustrophedonConfig(width_m=width_m, overlap_m=0.0))
    request = PlanRequest(Pose2(1.0, 1.0, 0.0), Goal(1.0, 1.0), world.field, np.random.default_rng(0))
    with pytest.raises(InputError, match=f"planner 'boustrophedon': {sweep}".replace("+", r"\+")):
        planner.plan(request)


def test_a_pass_much_wider_than_the_body_is_planned_in_cells_that_know_where_the_body_fits() -> None:
    """Cells of a twelfth of the width were wider than the passage that it starts in."""
    walls = np.array([[0, 0, 9, 0], [9, 0, 9, 8], [9, 8, 0, 8], [0, 8, 0, 0], [0, 0.5, 8, 0.5]], dtype=float)
    bounds_m = (0.0, 0.0, 9.0, 8.0)
    world = WorldMap("floor", bounds_m, geometry=SegmentMap(walls, np.zeros((0, 3)), bounds_m))
    planner = BoustrophedonPlanner(BoustrophedonConfig(width_m=7.0, clearance_m=0.22))
    start, goal = Pose2(0.25, 0.25, 0.0), Goal(0.25, 0.25)
    result = planner.plan(PlanRequest(start, goal, world.field, np.random.default_rng(0)))
    assert result.path is not None, result.reason


def test_a_goal_that_is_walled_off_is_no_path() -> None:
    _, result = swept(np.array([*ROOM, [6, 0, 6, 8]], dtype=float), (8.0, 4.0))
    assert result.path is None
    assert "expected a place on the reachable floor" in result.reason


def test_a_disc_covers_what_is_within_its_radius_of_a_line() -> None:
    rng = np.random.default_rng(1)
    path = rng.uniform(0.0, 4.0, (6, 2))
    covered = np.zeros((40, 40), np.bool_)
    mark_swept(path, 0.3, 0.0, 0.0, 0.1, covered)
    dense = np.concatenate([a + (b - a) * np.linspace(0, 1, 400)[:, None] for a, b in zip(path, path[1:])])  # noqa: B905, RUF007
    x, y = np.meshgrid(0.05 + 0.1 * np.arange(40), 0.05 + 0.1 * np.arange(40))
    away = np.hypot(x[..., None] - dense[:, 0], y[..., None] - dense[:, 1]).min(axis=2)
    assert covered[away < 0.299].all()
    assert not covered[away > 0.301].any()


def test_things_in_a_row_are_visited_one_after_the_other() -> None:
    """Each is a line to be driven either way; the best order and ends are known."""
    rng = np.random.default_rng(2)
    mixed = rng.permutation(7)
    ends = np.array([[[3.0 * k, 0.0], [3.0 * k + 2.0, 0.0]] for k in mixed])
    variants = np.stack([ends, ends[:, ::-1]], axis=1).reshape(-1, 2)
    places = np.vstack([variants, [-1.0, 0.0], [21.0, 0.0]])
    away = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    order, which = anneal_entries(away, 7, 2, rng.random((8000, 5)), 2.0)
    assert mixed[order].tolist() == list(range(7))
    assert not which.any()
    assert entries_cost(away, order, which, 2) == pytest.approx(8.0)
