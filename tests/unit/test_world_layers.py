"""What a world of layers answers, against brute force; and what it refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.errors import InputError
from pilotage.core.types import Pose2
from pilotage.maps.elevation import ElevationModel
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.markings import FloorMarkings
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.outlines import outlines
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.line_sensor import LineSensorConfig
from pilotage.sim.worlds.traffic import NOWHERE_M, Traffic
from pilotage.sim.worlds.world import World
from support.worlds import ROOM_MAP, robot, simulator

WIDE = (-50.0, -50.0, 50.0, 50.0)
NOTCHED = Footprint.polygon(
    np.array([[0.6, 0.3], [-0.4, 0.3], [-0.1, 0.0], [-0.4, -0.3], [0.6, -0.3], [0.5, 0.0]])
)
SHAPES = [
    Footprint.disc(0.35),
    Footprint.polygon(np.array([[0.5, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.5, -0.2]])),
]
SHAPES.append(NOTCHED)


def random_grid(seed: int, theta: float, filled: float = 0.08) -> OccupancyGrid:
    rng = np.random.default_rng(seed)
    rows, columns = int(rng.integers(5, 40)), int(rng.integers(5, 40))
    cells = np.where(rng.random((rows, columns)) < filled, 100, 0).astype(np.int8)
    cells[rng.random((rows, columns)) < 0.05] = -1
    cells[int(rng.integers(rows)), int(rng.integers(columns))] = 100
    return OccupancyGrid(cells, 0.25, Pose2(float(rng.uniform(-3, 3)), float(rng.uniform(-3, 3)), theta))


def both_worlds(grid: OccupancyGrid) -> tuple[World, World]:
    """The grid as cells, and as its outlines among the walls."""
    walls = SegmentMap(outlines(grid), np.zeros((0, 3)), WIDE)
    return World.of(WorldMap("grid", WIDE, grid=grid)), World.of(WorldMap("walls", WIDE, geometry=walls))


def free_poses(grid: OccupancyGrid, seed: int, count: int = 6) -> np.ndarray:
    """Poses on free cells, and some outside the grid."""
    rng = np.random.default_rng(seed)
    free = np.argwhere(grid.cells == 0)
    places = free[rng.integers(len(free), size=count)] + rng.uniform(0.05, 0.95, (count, 2))
    points = grid.points_m(places)
    points[-1] = grid.points_m(np.array([[-5.3, grid.columns * rng.uniform()]]))[0]
    return np.column_stack([points, rng.uniform(-math.pi, math.pi, count)])


@given(st.integers(0, 10_000), st.sampled_from([0.0, 0.5, math.pi / 2, -2.7]), st.sampled_from([1.5, 30.0]))
def test_scans_on_a_grid_end_at_its_outlines(seed: int, theta: float, reach: float) -> None:
    grid = random_grid(seed, theta)
    cells, walls = both_worlds(grid)
    poses = free_poses(grid, seed)
    for angles in (np.linspace(-2.0, 2.0, 97), np.arange(7) * 2 * math.pi / 7, np.array([0.3])):
        on_cells, on_walls = cells.scan(poses, angles, reach), walls.scan(poses, angles, reach)
        # A beam that grazes a corner may end at it or pass it.
        off = np.abs(on_cells - on_walls) > 1e-9
        assert off.sum() == 0
    assert cells.beam(poses, 40.0) == pytest.approx(walls.beam(poses, 40.0), abs=1e-9)


@given(st.integers(0, 10_000), st.sampled_from([0.0, 0.5, -2.7]), st.floats(0.05, 2.5))
def test_cones_on_a_grid_return_what_its_outlines_do(seed: int, theta: float, width: float) -> None:
    grid = random_grid(seed, theta)
    cells, walls = both_worlds(grid)
    poses = free_poses(grid, seed)
    reach = 2.0
    on_cells, on_walls = cells.cone(poses, width, reach), walls.cone(poses, width, reach)
    near = np.minimum(on_cells, on_walls) < reach
    assert on_cells[near] == pytest.approx(on_walls[near], abs=1e-9)


@pytest.mark.parametrize("shape", SHAPES, ids=["disc", "box", "notched"])
@given(seed=st.integers(0, 10_000), theta=st.sampled_from([0.0, 0.5, -2.7]))
def test_clearance_on_a_grid_is_that_from_its_outlines(shape: Footprint, seed: int, theta: float) -> None:
    grid = random_grid(seed, theta)
    cells, walls = both_worlds(grid)
    poses = free_poses(grid, seed)
    on_cells, on_walls = cells.clearance_m(shape, poses), walls.clearance_m(shape, poses)
    apart = on_walls >= 0.0
    assert on_cells[apart] == pytest.approx(on_walls[apart], abs=1e-9)
    # How deep an overlap is depends on where sides are cut in two.
    assert (on_cells[~apart] < 0.0).all()


def sampled(points: np.ndarray, spacing: float = 0.008) -> np.ndarray:
    """Points along a closed polygon."""
    out = []
    for start, end in zip(points, np.roll(points, -1, axis=0), strict=True):
        count = max(2, int(np.hypot(*(end - start)) / spacing))
        out.append(start + np.linspace(0.0, 1.0, count)[:, None] * (end - start))
    return np.concatenate(out)


@pytest.mark.parametrize("shape", SHAPES, ids=["disc", "box", "notched"])
@settings(max_examples=50)
@given(seed=st.integers(0, 10_000))
def test_clearance_is_the_least_distance_between_sampled_outlines(shape: Footprint, seed: int) -> None:
    rng = np.random.default_rng(seed)
    segments = np.hstack([(a := rng.uniform(-2, 2, (3, 2))), a + rng.uniform(-1, 1, (3, 2))])
    circles = np.column_stack([rng.uniform(-2, 2, (2, 2)), rng.uniform(0.05, 0.4, 2)])
    world = World.of(WorldMap("some", WIDE), segments, circles)
    pose = Pose2.from_array(rng.uniform([-1.5, -1.5, -math.pi], [1.5, 1.5, math.pi]))
    found = float(world.clearance_m(shape, pose.as_array()[None, :])[0])
    c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
    turn = np.linspace(0, 2 * math.pi, 200)
    outline = (
        shape.radius_m * np.column_stack([np.cos(turn), np.sin(turn)]) if shape.is_disc else shape.points_m
    )
    edge = sampled(outline) @ np.array([[c, s], [-s, c]]) + [pose.x_m, pose.y_m]
    points = [
        a + np.linspace(0, 1, 200)[:, None] * (b - a)
        for a, b in zip(segments[:, :2], segments[:, 2:], strict=True)
    ]
    points += [np.column_stack([x + r * np.cos(turn), y + r * np.sin(turn)]) for x, y, r in circles]
    solid = np.concatenate(points)
    # Squared distances by one product: hundreds of thousands of pairs.
    squared = (edge**2).sum(1)[:, None] + (solid**2).sum(1)[None, :] - 2.0 * edge @ solid.T
    brute = math.sqrt(max(float(squared.min()), 0.0))
    if found >= 0.0:
        assert found == pytest.approx(brute, abs=1.2e-2)
    else:
        middles = np.hypot(*(circles[:, :2] - [pose.x_m, pose.y_m]).T)
        assert brute < 1.2e-2 or _any_inside(solid, pose, shape) or (middles < circles[:, 2]).any()


def _any_inside(points: np.ndarray, pose: Pose2, shape: Footprint) -> bool:
    from matplotlib.path import Path

    c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
    own = (points - [pose.x_m, pose.y_m]) @ np.array([[c, -s], [s, c]])
    if shape.is_disc:
        return bool((np.hypot(*own.T) < shape.radius_m + 1e-3).any())
    return bool(Path(shape.points_m).contains_points(own, radius=1e-3).any())


@given(st.integers(0, 10_000), st.floats(-3, 3), st.floats(-3, 3), st.floats(-3.1, 3.1))
def test_clearance_changes_by_no_more_than_the_outline_moves(
    seed: int, dx: float, dy: float, turn: float
) -> None:
    """What the sweep relies on, in overlaps too."""
    rng = np.random.default_rng(seed)
    segments = rng.uniform(-1.2, 1.2, (2, 4))
    circles = np.column_stack([rng.uniform(-1.2, 1.2, (1, 2)), [0.2]])
    world = World.of(WorldMap("some", WIDE), segments, circles)
    first = np.array([*rng.uniform(-1, 1, 2), rng.uniform(-3, 3)])
    scale = 0.02
    second = first + scale * np.array([dx, dy, turn])
    for shape in SHAPES:
        a, b = world.clearance_m(shape, np.array([first, second]))
        moved = scale * (math.hypot(dx, dy) + (0.0 if shape.is_disc else shape.radius_m * abs(turn)))
        if min(a, b) > -1e-3:
            assert abs(a - b) <= moved + 1e-9


def test_traffic_is_seen_and_kept_clear_of_but_for_oneself() -> None:
    box = SHAPES[1]
    traffic = Traffic([Footprint.disc(0.2), box], np.array([0.3]))
    assert traffic.circles_m[1].tolist() == [NOWHERE_M, NOWHERE_M, 0.3]
    traffic.put_people(np.array([[3.0, 0.0]]))
    world = World.of(WorldMap("empty", WIDE)).with_traffic(traffic)
    traffic.circles_m[0, :2] = 0.0, 0.0
    corners = box.points_m + np.array([0.0, 4.0])
    traffic.segments_m[:] = np.hstack([corners, np.roll(corners, -1, axis=0)])
    at = np.array([[0.0, 0.0, 0.0]])
    assert world.scan(at, np.array([0.0]), 9.0, traffic.own[:1])[0, 0] == pytest.approx(2.7)
    assert world.beam(np.array([[0.0, 0.0, math.pi / 2]]), 9.0, traffic.own[0])[0] == pytest.approx(3.8)
    assert world.beam(np.array([[0.0, 4.0, -math.pi / 2]]), 9.0, traffic.own[1])[0] == pytest.approx(3.8)
    assert world.cone(at, 0.5, 9.0, traffic.own[0])[0] == pytest.approx(2.7)
    assert world.clearance_m(Footprint.disc(0.2), at, traffic.own[0])[0] == pytest.approx(2.5)
    assert world.clearance_m(box, np.array([[0.0, 4.0, 0.0]]), traffic.own[1])[0] == pytest.approx(3.6)
    traffic.put_people(np.array([[4.0, 0.0]]))
    assert world.scan(at, np.array([0.0]), 9.0, traffic.own[:1])[0, 0] == pytest.approx(3.7)
    traffic.put_people(np.array([[np.nan, np.nan]]))
    assert world.scan(at, np.array([0.0]), 9.0, traffic.own[:1])[0, 0] == 9.0


def test_cells_and_bodies_hide_landmarks() -> None:
    cells = np.zeros((10, 10), np.int8)
    cells[4, 5] = 100
    marks = Landmarks(np.array([3, 8]), np.array([[9.0, 5.5], [5.0, 9.0]]))
    world = World.of(WorldMap("grid", (0, 0, 10, 10), grid=OccupancyGrid(cells, 1.0), landmarks=marks))
    ids, ranges, _ = world.landmarks_in_sight(Pose2(1.0, 5.5, 0.0), 20.0, 2 * math.pi)
    assert ids.tolist() == [8]
    assert ranges[0] == pytest.approx(math.hypot(4.0, 3.5))
    ids, _, bearings = world.landmarks_in_sight(Pose2(7.0, 5.5, math.pi / 2), 20.0, 2 * math.pi)
    assert ids.tolist() == [3, 8]
    assert bearings[0] == pytest.approx(-math.pi / 2)


def test_markings_are_dark_and_nothing_else() -> None:
    marks = FloorMarkings((2.0, 1.0), (10, 5), np.array([[0.5, 0.5, 1.5, 0.5]]), 0.02, True)
    world = World.of(WorldMap("sheet", (0, 0, 2, 1), markings=marks))
    points = np.array([[1.0, 0.505], [1.0, 0.6], [-0.1, 0.5]])
    assert world.is_dark(points).tolist() == [True, False, True]
    assert not World.of(WorldMap("bare", WIDE)).is_dark(points).any()


def test_open_ground_has_heights_and_hazards_that_stop_nobody() -> None:
    x = np.arange(20.0) * 2.0
    heights = np.tile(np.where(x > 20.0, x - 20.0, 0.0), (10, 1)).astype(np.float32)
    model = ElevationModel(heights, 2.0)
    chart = WorldMap(
        "hill",
        (0, 0, 40, 20),
        grid=model.hazards(30.0),
        elevation=model,
        slope_limit_deg=30.0,
        open_ground=True,
    )
    world = World.of(chart)
    points = np.array([[5.0, 10.0], [31.0, 10.0], [-5.0, 3.0]])
    assert world.on_hazard(points).tolist() == [False, True, True]
    assert world.slopes_rad(points)[:2] == pytest.approx([0.0, math.pi / 4])
    assert world.heights_m(points)[1] == pytest.approx(10.0)
    assert np.isnan(world.slopes_rad(points)[2])
    _, part = world.advance(Footprint.disc(1.5), Pose2(5.0, 10.0, 0.0), (30.0, 0.0, 0.0))
    assert part == 1.0
    sim = simulator(robot(start=Pose2(5.0, 10.0, 0.0)), chart)
    assert not sim.bodies[0].on_hazard
    sim.bodies[0].carry_to(Pose2(31.0, 10.0, 0.0))
    assert sim.bodies[0].on_hazard
    with pytest.raises(InputError, match="found hazards on open ground, heights"):
        simulator(robot({"scan": LidarConfig()}), chart)


@given(st.floats(-6.0, 12.0), st.floats(-6.0, 12.0), st.sampled_from([0.0, 0.4, -2.0]))
def test_hazards_of_one_point_and_of_many_agree(x: float, y: float, theta: float) -> None:
    grid = random_grid(3, theta, 0.4)
    ground = World.of(WorldMap("ground", WIDE, grid=grid, open_ground=True)).ground
    assert ground is not None
    assert ground.on_hazard(x, y) is bool(ground.on_hazards(np.array([[x, y]]))[0])


def test_what_no_layer_can_answer_is_refused_in_one_line() -> None:
    empty = WorldMap("void", (0, 0, 10, 8))
    for config, words in (
        (LidarConfig(), "it: lidar needs a world with walls or a grid, or others about, found an empty map"),
        (InfraredConfig(rate_hz=10), "infrared needs a world with walls or a grid"),
        (LineSensorConfig(rate_hz=10), "line-sensor needs a world with floor markings, found an empty map"),
    ):
        with pytest.raises(InputError, match=words) as caught:
            simulator(robot({"it": config}), empty)
        assert "\n" not in str(caught.value)


def test_places_without_room_are_refused() -> None:
    world = World.of(ROOM_MAP)
    world.check_place("world.start", SHAPES[1], Pose2(2.0, 2.0, 0.0))
    with pytest.raises(InputError, match=r"world\.start: expected room for the robot's footprint"):
        world.check_place("world.start", SHAPES[1], Pose2(4.8, 2.0, 0.0))
    with pytest.raises(InputError, match="expected a place on the map 'room'"):
        world.check_place("world.start", SHAPES[0], Pose2(-4.8, 2.0, 0.0))
