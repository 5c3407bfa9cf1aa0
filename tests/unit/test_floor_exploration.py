"""Frontiers of a seen floor, the grid that grows with scans, and what a map of a floor is judged by."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from pilotage.core.types import Pose2, Twist
from pilotage.evaluation.floor_map import floor_map_metrics, reachable_floor
from pilotage.experiments.mission import load_mission, mission_of
from pilotage.experiments.run import run_mission
from pilotage.kernels.slam.frames import composed
from pilotage.maps.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.missions.mission import Mission
from pilotage.sensors.lidar import LidarConfig
from pilotage.stack.control.local.drive import LocalDrive
from pilotage.stack.exploration.floor_frontiers import SeenFloor
from pilotage.stack.interface import Belief, BeliefStatus, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.localization.localizer import Localizer
from pilotage.stack.mapping.scan_grid import ScanGrid, echoes
from pilotage.stack.navigator.floor_explorer import decisions
from pilotage.stack.navigator.floor_explorer.config import FloorExplorerConfig
from pilotage.stack.navigator.floor_explorer.context import Context, led_to
from pilotage.stack.navigator.floor_explorer.own_floor import OwnFloor
from pilotage.stack.navigator.floor_explorer.states import Closing, Done, Exploring, Returning, State
from pilotage.stack.navigator.floor_explorer.targets import Target, Targets
from support.laser_rooms import furnished, ranges, room
from support.missions import MISSIONS
from support.robots import ROOM

HERE = np.array([1.0, 1.0])
BOUNDS_M = (0.0, 0.0, 8.0, 4.0)


def floor_of(states: np.ndarray, here: np.ndarray = HERE) -> SeenFloor:
    return SeenFloor(states.astype(np.int8), np.zeros(2), 0.05, 0.3, here)


def own_floor(grid: object, start_m: np.ndarray, radius_m: float) -> OwnFloor:
    """What a robot of that radius makes of a grid."""
    return OwnFloor(FloorExplorerConfig(), LidarConfig(), cast(ScanGrid, grid), start_m, radius_m)


def half_seen() -> np.ndarray:
    """A room of 8 x 4 m, its right half unseen."""
    states = np.full((80, 160), FREE)
    states[:, 80:] = UNKNOWN
    states[[0, 1, -2, -1], :] = OCCUPIED
    states[:, [0, 1]] = OCCUPIED
    return states


def test_the_seen_ends_at_one_frontier() -> None:
    floor = floor_of(half_seen())
    (frontier,) = floor.frontiers(0.4)
    assert frontier.middle_xy_m == pytest.approx([3.95, 2.0], abs=0.15)
    assert frontier.length_m == pytest.approx(3.8, abs=0.3)
    assert np.hypot(*(floor.point_of(frontier.view) - frontier.middle_xy_m)) <= 1.75
    path = floor.path(frontier.view)
    assert np.hypot(*(path[0] - HERE)) < 0.1
    assert np.hypot(*np.diff(path, axis=0).T).max() < 0.15
    assert frontier.cost_m >= np.hypot(*np.diff(path, axis=0).T).sum() - 1e-9
    assert np.ptp(floor.points_of(frontier.crossings)[:, 1]) == pytest.approx(3.2, abs=0.2)
    assert (np.diff(floor.cost_m[frontier.crossings]) >= 0.0).all()


def test_a_gap_the_robot_does_not_fit_through_is_not_crossed() -> None:
    states = half_seen()
    states[:, 78:80] = OCCUPIED
    states[35:45, 78:80] = FREE
    (frontier,) = floor_of(states).frontiers(0.4)
    assert frontier.view >= 0
    assert frontier.crossings.size == 0


def test_what_is_behind_a_wall_is_out_of_reach() -> None:
    states = half_seen()
    states[:, 50:52] = OCCUPIED
    (frontier,) = floor_of(states).frontiers(0.4)
    assert frontier.view == -1
    assert floor_of(states).path_to(np.array([3.5, 2.0])).shape == (0, 2)


def test_ways_keep_their_clearance() -> None:
    states = half_seen()
    states[0:50, 40:42] = OCCUPIED
    floor = floor_of(states)
    path = floor.path_to(np.array([3.3, 1.0]))
    rows, columns = np.array([floor.cell_of(point) for point in path]).T
    assert floor.distance_m[rows, columns].min() >= 0.3
    assert path[:, 1].max() > 2.5


def test_who_is_cut_off_by_its_clearance_is_led_back_by_what_its_body_takes() -> None:
    """Behind a gap of 0.7 m a robot 0.6 m wide gets back to its start; behind one of 0.4 m it does not."""

    def reached(cells: int) -> bool:
        states = half_seen()
        states[:, 78:82] = OCCUPIED
        states[:, 82:] = FREE
        states[34 : 34 + cells, 78:82] = FREE
        grid = SimpleNamespace(states=states.astype(np.int8), corner_xy_m=np.zeros(2), resolution_m=0.05)
        grid.wall_points = lambda: np.zeros((0, 2))
        floor = own_floor(grid, HERE, 0.3).seen(np.array([5.5, 2.0]))
        return bool(np.isfinite(floor.cost_to(HERE)))

    assert reached(20)
    assert reached(14)
    assert not reached(8)


def test_who_stalls_is_led_by_what_a_line_with_room_leads_to() -> None:
    """Not through a gap beside the path: it got stuck there until it gave up."""
    states = half_seen()
    states[:, 80:] = FREE
    states[:60, 78:80] = OCCUPIED
    states[16:26, 78:80] = FREE
    floor, here = floor_of(states), np.array([3.0, 1.0])
    path = floor.path_to(np.array([5.0, 1.0]))
    around, nearer = led_to(path, here, None), led_to(path, here, floor)
    assert not floor.has_room(here, np.array([5.0, 1.0]))
    assert floor.has_room(here, np.array([1.0, 2.0]))
    assert np.hypot(*(np.array(nearer) - here)) > 0.3
    assert floor.has_room(here, np.array(nearer))
    assert not floor.has_room(here, np.array(around))


def test_a_grid_grows_and_follows_its_poses() -> None:
    scanner = LidarConfig(beams=180, max_range_m=12.0)
    walls, angles = furnished(), LidarConfig(beams=180).beam_angles_rad()
    grid = ScanGrid(scanner, 0.05)
    assert grid.grid().cells.size == 1
    poses = np.array([[2.0, 3.5, 0.2], [8.0, 2.0, 2.0]])
    for pose in poses:
        seen = ranges(walls, pose, angles)
        grid.add(echoes(np.where(np.isfinite(seen), seen, 12.0), scanner), pose)
    there = np.array([30.0, -20.0, 1.0])
    on_walls = grid.wall_points()
    grid.move(np.array([composed(there, pose) for pose in poses]))
    moved = grid.grid()
    centre = grid.wall_points().mean(axis=0)
    np.testing.assert_allclose(centre, composed(there, np.array([*on_walls.mean(axis=0), 0.0]))[:2], atol=0.2)
    inner = composed(there, np.array([5.0, 5.5, 0.0]))
    assert moved.cells[moved.cell_at(inner[0], inner[1])] == FREE
    grid.move(poses)
    back = grid.grid()
    assert back.cells[back.cell_at(5.0, 5.5)] == FREE
    assert back.cells[back.cell_at(inner[0], inner[1])] != FREE
    fine = grid.drawn(0.02)
    assert fine.resolution_m == 0.02
    assert fine.cells[fine.cell_at(5.0, 5.5)] == FREE
    starts, ends = walls[:, :2], walls[:, 2:] - walls[:, :2]
    for drawn in (fine, grid.grid()):
        # Every wall is known to half the diagonal of a cell of either.
        beside = drawn.centres_m(np.argwhere(drawn.cells == OCCUPIED))[:, None] - starts
        share = np.clip((beside * ends).sum(axis=2) / (ends**2).sum(axis=1), 0.0, 1.0)
        off = np.hypot(*np.moveaxis(beside - share[:, :, None] * ends, 2, 0)).min(axis=1)
        assert off.max() < 0.75 * drawn.resolution_m
    grid.keep(1)
    assert len(grid.poses) == 1


def test_a_true_map_has_all_of_the_floor_and_a_shifted_one_its_shift() -> None:
    chart = WorldMap("room", ROOM.bounds_m, ROOM)
    assert len(reachable_floor(chart, 0.3, Pose2(2.0, 2.0, 0.0))) * 0.05**2 == pytest.approx(79.0, abs=1.5)
    cells = np.full((168, 208), FREE, np.int8)
    cells[[3, 4, 163, 164], 4:204] = OCCUPIED
    grid = OccupancyGrid(cells, 0.05, Pose2(-0.2, -0.2, 0.0))
    metrics = floor_map_metrics(grid, chart, 0.3, Pose2(2.0, 2.0, 0.0))
    assert metrics["floor_mapped"] == 1.0
    assert metrics["wall_rms_m"] == pytest.approx(0.025, abs=1e-4)
    shifted = OccupancyGrid(cells, 0.05, Pose2(-0.2, 0.1, 0.0))
    assert float(str(floor_map_metrics(shifted, chart, 0.3, Pose2(2.0, 2.0, 0.0))["wall_rms_m"])) > 0.2


@pytest.mark.parametrize("shift_m", [0.0, 0.013])
def test_a_cell_of_a_thin_wall_is_as_far_off_as_its_nearer_side(shift_m: float) -> None:
    """Half way between both sides the nearest was either: cells were 0.075 off, not 0.025."""
    sides = np.array([[x, 1.0, x, 7.0] for x in (2.0, 2.1, 6.1, 6.0)])
    walls = SegmentMap(np.concatenate([ROOM.segments_m, sides]), np.zeros((0, 3)), ROOM.bounds_m)
    cells = np.full((160, 200), FREE, np.int8)
    cells[40:120, [40, 41, 120, 121]] = OCCUPIED
    grid = OccupancyGrid(cells, 0.05, Pose2(shift_m, 0.0, 0.0))
    metrics = floor_map_metrics(grid, WorldMap("thin", ROOM.bounds_m, walls), 0.3, Pose2(4.0, 4.0, 0.0))
    off = np.array([0.025 + shift_m, 0.025 - shift_m])
    assert metrics["wall_rms_m"] == pytest.approx(np.sqrt((off**2).mean()), abs=1e-9)
    assert metrics["wall_max_m"] == pytest.approx(off.max(), abs=1e-9)


def test_floor_in_a_thin_walls_cells_does_not_count_and_cells_beside_no_wall_do() -> None:
    """Interpolated distances told 0.05 m of rows 0.025 m away, in cells that are rightly occupied."""
    for wall_x_m in (3.95, 4.0):
        sides = np.array([[x, 0.0, x, 6.0] for x in (wall_x_m, wall_x_m + 0.1)])
        walls = SegmentMap(np.concatenate([ROOM.segments_m, sides]), np.zeros((0, 3)), ROOM.bounds_m)
        chart, start = WorldMap("thin", ROOM.bounds_m, walls), Pose2(2.0, 2.0, 0.0)
        cells, column = np.full((160, 200), FREE, np.int8), round(wall_x_m / 0.05)
        cells[40:, column - 1 : column + 3] = OCCUPIED  # beams end on either side of its borders
        grid = OccupancyGrid(cells.copy(), 0.05, Pose2(0.0, 0.0, 0.0))
        assert floor_map_metrics(grid, chart, 0.3, start)["floor_mapped"] == 1.0
        cells[40:80, 40] = OCCUPIED
        missed = 40 / len(reachable_floor(chart, 0.3, start))
        grid = OccupancyGrid(cells, 0.05, Pose2(0.0, 0.0, 0.0))
        assert floor_map_metrics(grid, chart, 0.3, start)["floor_mapped"] == pytest.approx(1.0 - missed)


def test_an_unknown_floor_is_explored_and_mapped() -> None:
    """The mission's stack in a small building: all of it, nothing touched, back, and a map left."""
    room = mission_of(MISSIONS["reach"]).world.model_dump(mode="json")
    unknown = load_mission("museum-unknown", ("stack.navigator.map_resolution_m=0.025",), 1)
    values = unknown.model_dump(mode="json") | {"mission": "two-rooms"}
    values["world"] = room | {"start": {"x_m": 2.0, "y_m": 2.0, "theta_rad": 0.0}, "goal": None}
    metrics = run_mission(mission_of(values), save=False).metrics
    assert metrics["success"] is True, metrics["reason"]
    assert metrics["collisions"] == 0
    assert float(str(metrics["floor_mapped"])) > 0.99
    # Walls on the borders of cells of 0.05 m would be 0.025 off, however well they were seen.
    assert float(str(metrics["wall_rms_m"])) < 0.02
    assert float(str(metrics["return_error_m"])) < 0.1


def unknown_floor(walls_m: list[list[float]], start: Pose2, radius_m: float, seed: int) -> Mission:
    """The museum's explorer, of another size, between other walls."""
    museum = load_mission("museum-unknown", (f"robot.footprint.radius_m={radius_m}",), seed)
    values = museum.model_dump(mode="json") | {"mission": "unknown-floor"}
    values["world"] = mission_of(MISSIONS["reach"]).world.model_dump(mode="json") | {
        "map": {"map": "unknown-floor", "walls_m": walls_m},
        "start": {"x_m": start.x_m, "y_m": start.y_m, "theta_rad": start.theta_rad},
        "goal": None,
    }
    return mission_of(values)


def test_a_frontier_that_a_look_does_not_move_is_driven_through(monkeypatch: pytest.MonkeyPatch) -> None:
    """The next room is in the shadow of a door post: with looks alone it came home with 47 % mapped."""
    met = decisions.meet
    sides: list[list[float]] = [[0, 1, 5, 1], [5, 1, 5, 5], [5, 5, 0, 5], [0, 5, 0, 1], [2.1, 1, 2.1, 4]]
    mission = unknown_floor(sides, Pose2(0.53, 2.73, 2.03), 0.15, 1)
    once: list[Target] = []

    def noted(context: Context, target: Target) -> None:
        once.append(target)
        met(context, target)

    monkeypatch.setattr(decisions, "meet", noted)
    metrics = run_mission(mission, save=False).metrics
    assert metrics["success"] is True, metrics["reason"]
    assert float(str(metrics["floor_mapped"])) > 0.99
    assert metrics["frontiers_given_up"] == 0
    assert metrics["collisions"] == 0
    assert len(once) == len({id(target) for target in once}) >= 2, "each target is met once"


def test_an_explorer_heeds_its_laser_whatever_its_local_controller_says(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One that looks at nothing drives at full speed at whatever stands there."""
    monkeypatch.setattr(LocalDrive, "toward", lambda *_, **__: Twist(1.0, 0.0))
    sides: list[list[float]] = [[0, 0, 5, 0], [5, 0, 5, 3], [5, 3, 0, 3], [0, 3, 0, 0]]
    mission = unknown_floor(sides, Pose2(1.0, 1.5, 0.3), 0.2, 1)
    mission = mission.model_copy(update={"run": mission.run.model_copy(update={"time_limit_s": 8.0})})
    metrics = run_mission(mission, save=False).metrics
    assert metrics["collisions"] == 0
    assert float(str(metrics["path_length_m"])) > 2.0


def test_a_room_behind_a_gap_that_the_body_alone_takes_is_explored() -> None:
    """0.50 m for a robot 0.40 m wide: its clearance asks for 0.52, and it came home with 63 % mapped."""
    sides: list[list[float]] = [
        [0, 0, 8, 0],
        [8, 0, 8, 4],
        [8, 4, 0, 4],
        [0, 4, 0, 0],
        [4, 0, 4, 1.71],
        [4, 2.21, 4, 4],
    ]
    metrics = run_mission(unknown_floor(sides, Pose2(1.5, 1.2, 0.0), 0.2, 3), save=False).metrics
    assert metrics["success"] is True, metrics["reason"]
    assert float(str(metrics["floor_mapped"])) > 0.99
    assert metrics["collisions"] == 0


def deciding(floor: SeenFloor, monkeypatch: pytest.MonkeyPatch) -> Context:
    """An explorer that sees this floor, whichever clearance it asks for, and began at ``HERE``."""
    grid = SimpleNamespace(poses=np.tile([*HERE, 0.0], (4, 1)))
    config, own = FloorExplorerConfig(), own_floor(grid, HERE, 0.3)
    for look in ("seen", "widest"):
        monkeypatch.setattr(own, look, lambda _: floor)
    localizer = cast(Localizer, SimpleNamespace())
    return Context(config, own, Targets(config, 25.0), localizer, 1.0, Journal())


def at(here: np.ndarray, status: BeliefStatus) -> Belief:
    return Belief(Pose2(float(here[0]), float(here[1]), 0.0), np.zeros((3, 3)), status)


def test_who_is_under_way_to_a_gap_goes_on_where_what_it_sees_behind_it_shrinks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It was 1.7 m from afar and under 1 m from before the gap, where the robot turned back."""
    asked: list[float] = []
    floor, seen_m = floor_of(half_seen()), [1.7, 0.6]
    found = Target(np.array([2.0, 2.0]), np.array([2.5, 2.0]), 0.0, False)

    def worth_it(*asking: object) -> list[Target]:
        least_m = cast(float, asking[-1])
        asked.append(least_m)
        return [found] if len(asked) % 2 == 0 and seen_m[len(asked) // 2 - 1] >= least_m else []

    context = deciding(floor, monkeypatch)
    monkeypatch.setattr(context.targets, "worth_it", worth_it)
    state: State = Exploring()
    for _ in range(2):
        state = decisions.decide(context, state, 0.0, at(HERE, BeliefStatus.LOCALIZED))
        assert state == Exploring(found)
    assert asked == [0.4, 1.0, 0.4, 0.4]


def test_who_is_lost_goes_back_to_where_it_knew_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a laser of 3.5 m one left a house, saw nothing that it knew, and stood there to the end."""
    here = np.array([3.4, 2.0])
    seen = Target(np.array([3.5, 2.5]), np.array([3.9, 2.5]), 0.0, True)
    context = deciding(floor_of(half_seen(), here), monkeypatch)
    monkeypatch.setattr(context.targets, "worth_it", lambda *_: [seen])
    lost, known = at(here, BeliefStatus.LOST), at(here, BeliefStatus.LOCALIZED)
    state: State = Exploring(seen)
    for belief, then in ((known, Exploring), (lost, Closing), (lost, Closing), (known, Exploring)):
        state = decisions.decide(context, state, 0.0, belief)
        assert type(state) is then
        assert state.target is not None
    assert len(context.targets._tried) == 1


def test_who_cannot_come_back_says_so_and_decides_nothing_more(monkeypatch: pytest.MonkeyPatch) -> None:
    here = np.array([3.4, 2.0])
    context = deciding(floor_of(half_seen(), here), monkeypatch)
    monkeypatch.setattr(context, "stalled_s", lambda *_: 1e9)
    state: State = Returning()
    for stalls in range(1, decisions.HOME_STALLS + 1):
        assert isinstance(state, Returning)
        state = decisions.decide(context, state, float(stalls), at(here, BeliefStatus.LOCALIZED))
    assert state == Done()
    assert context.status is StackStatus.FAILED
    assert "stuck on its way back" in context.reason


def test_who_turned_back_twice_on_its_way_to_a_frontier_gives_it_up() -> None:
    """Over a plain it became unsure, came back to a wall, and set out again for the same place for ever."""
    targets, floor = Targets(FloorExplorerConfig(), 25.0), floor_of(half_seen())
    pose = Pose2(1.0, 1.0, 0.0)
    (view,) = targets.worth_it(floor, pose, HERE, 0.4)
    targets.met(view)
    (first,) = targets.worth_it(floor, pose, HERE, 0.4)
    assert first.crossing
    targets.unsure(first)
    (again,) = targets.worth_it(floor, pose, HERE, 0.4)
    np.testing.assert_array_equal(again.xy_m, first.xy_m)
    targets.unsure(again)
    left = targets.worth_it(floor, pose, HERE, 0.4)
    assert all(np.hypot(*(other.xy_m - first.xy_m)) > 2.0 for other in left)


def test_frontiers_without_a_wall_in_sight_come_last() -> None:
    """With a laser of 3.5 m robots drove out of a house onto a plain before they had seen its rooms."""
    states = half_seen()
    states[56:58, 60:80] = OCCUPIED  # a wall: behind it a corridor goes on, before it the open floor
    floor, pose = floor_of(states), Pose2(1.0, 1.0, 0.0)
    near, far = (
        Targets(FloorExplorerConfig(), reach_m).worth_it(floor, pose, HERE, 0.4) for reach_m in (25.0, 1.2)
    )
    assert len(near) == len(far) == 2
    np.testing.assert_array_equal(near[0].xy_m, far[1].xy_m)
    assert far[1].score == pytest.approx(near[0].score + FloorExplorerConfig().open_cost_m)
    assert far[0].score == near[1].score


def gap_seen(half_m: float, turned_rad: float) -> tuple[ScanGrid, np.ndarray, np.ndarray]:
    """What was seen of two rooms with a gap between them, and a place in each."""
    scanner = LidarConfig(beams=720, max_range_m=12.0, field_of_view_rad=2.0 * np.pi)
    c, s = np.cos(turned_rad), np.sin(turned_rad)
    turn = np.array([[c, s], [-s, c]])
    posts = room(3.9, 0, 4.1, 2.03 - half_m) + room(3.9, 2.03 + half_m, 4.1, 4)
    walls = np.array([*room(0, 0, 8, 4), *posts])
    walls = np.concatenate([walls[:, :2] @ turn, walls[:, 2:] @ turn], axis=1)
    grid = ScanGrid(scanner, 0.05)
    for x in (2.0, 3.5, 4.0, 4.5, 6.0):
        pose = np.array([*(np.array([x, 2.0]) @ turn), turned_rad])
        grid.add(echoes(ranges(walls, pose, scanner.beam_angles_rad()), scanner), pose)
    return grid, np.array([2.0, 2.0]) @ turn, np.array([6.0, 2.0]) @ turn


@pytest.mark.parametrize("turned_rad", [0.0, 0.4, 0.785])
@pytest.mark.parametrize(("spare_m", "through"), [(0.015, False), (0.04, True)])
def test_gaps_are_told_by_where_walls_are_and_not_by_cells(
    turned_rad: float, spare_m: float, through: bool
) -> None:
    """Cells of 0.1 m said of a gap with 0.065 m to spare that it is shut."""
    grid, here, there = gap_seen(0.17 + spare_m, turned_rad)
    floor = SeenFloor(grid.states, grid.corner_xy_m, 0.05, 0.17 + 0.03, here, grid.wall_points())
    assert np.isfinite(floor.cost_to(there)) == through


@pytest.mark.parametrize("turned_rad", [0.4, 0.6])
def test_who_squeezed_through_a_slanting_gap_is_led_back(turned_rad: float) -> None:
    """Cells shut it even for a body smaller by one of them: one came home with "no path leads back"."""
    grid, start, here = gap_seen(0.17 + 0.025, turned_rad)
    assert np.isfinite(own_floor(grid, start, 0.17).seen(here).cost_to(start))


def test_floor_behind_a_gap_counts_by_the_gap_and_not_by_the_lattice() -> None:
    """Wherever it lies; and cells that a map says nothing of are floor, as they are to bodies."""
    start = Pose2(1.0, 1.0, 0.0)
    for shift_m in (0.0, 0.01, 0.025, 0.04):
        post = np.array([[4, 0, 4, 2 + shift_m - 0.25], [4, 2 + shift_m + 0.25, 4, 4]])
        sides = np.concatenate([room(0, 0, 8, 4), post])
        chart = WorldMap("gap", BOUNDS_M, SegmentMap(sides, np.zeros((0, 3)), BOUNDS_M))
        through, shut = (len(reachable_floor(chart, 0.2, start, spare_m)) for spare_m in (0.045, 0.055))
        assert through > 1.8 * shut > 0
    cells = np.full((80, 160), FREE, np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = OCCUPIED
    told = WorldMap("cells", BOUNDS_M, grid=OccupancyGrid(cells.copy(), 0.05))
    cells[1:-1, 80:-1] = UNKNOWN
    untold = WorldMap("cells", BOUNDS_M, grid=OccupancyGrid(cells, 0.05))
    assert len(reachable_floor(untold, 0.2, start)) == len(reachable_floor(told, 0.2, start)) > 10_000
