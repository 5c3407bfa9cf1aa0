"""Where a team begins: on the floor that a planner's nodes reach."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import Pose2
from pilotage.experiments.build import open_floor
from pilotage.experiments.build.charts import bounds_of, chart_of
from pilotage.experiments.build.open_floor import OpenFloor
from pilotage.experiments.build.places import settle_places
from pilotage.experiments.mission import load_mission
from pilotage.maps.edge import closed
from pilotage.maps.floor import Floor
from pilotage.maps.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from pilotage.maps.pieces import meant_piece
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.missions.mission import Mission
from pilotage.missions.places import PoseConfig

# A room of 8 m x 5 m and one of 3 m x 5 m, a gap of 0.84 m between them.
WALLS = SegmentMap(
    np.array(
        [[0, 0, 11, 0], [11, 0, 11, 5], [11, 5, 0, 5], [0, 5, 0, 0], [8, 0, 8, 2], [8, 2.84, 8, 5]], float
    ),
    np.zeros((0, 3)),
    (0.0, 0.0, 11.0, 5.0),
)
WORLD = WorldMap("pocket", WALLS.bounds_m, geometry=WALLS)


def test_starts_are_not_drawn_where_a_passage_is_as_wide_as_the_body_alone() -> None:
    floor, rng = OpenFloor(WORLD, 0.4, None), np.random.default_rng(0)
    anywhere = [floor.draw(rng) for _ in range(60)]
    easy = [floor.draw(rng, part=floor.easy) for _ in range(60)]
    assert any(place is not None and place.x_m > 8.5 for place in anywhere)
    assert all(place is not None and place.x_m < 8.5 for place in easy)
    # Close to walls as before: only the passages matter.
    assert any(place is not None and min(place.x_m, place.y_m, 5.0 - place.y_m) < 0.5 for place in easy)


def test_where_no_passage_has_more_room_all_of_the_floor_will_do() -> None:
    floor = OpenFloor(WORLD, 2.45, None)
    assert floor.easy.any()
    assert floor.draw(np.random.default_rng(0), part=floor.easy) is not None


def test_everybody_begins_where_the_widest_of_the_team_can_come() -> None:
    radii = ", ".join(f"{{footprint: {{radius_m: {radius_m}}}}}" for radius_m in (0.2, 0.2, 0.5, 0.2, 0.2))
    mission = load_mission("museum-patrol", (f"robots=[{radii}]", "team.size=5"), 0)
    for seed in range(4):
        run = mission.run.model_copy(update={"seed": seed})
        settled = settle_places(mission.model_copy(update={"run": run}), WORLD)
        assert all(robot.start is not None and robot.start.x_m < 8.0 for robot in settled.robots)


@pytest.mark.parametrize(
    ("about", "low_x_m", "high_x_m"),
    [((9.0, 2.0), 8.0, 11.0), ((8.2, 4.5), 8.0, 11.0), ((2.0, 0.0), 0.0, 8.0), ((50.0, 2.0), 0.0, 8.0)],
)
def test_a_place_beside_a_wall_tells_which_floor_a_task_is_about(
    about: tuple[float, float], low_x_m: float, high_x_m: float
) -> None:
    """A patrol's first vertex too near to a wall was refused as the mission's start, which it has not got.

    One that is nowhere near floor leaves the largest, for the task to say so.
    """
    floor, rng = OpenFloor(WORLD, 0.5, None, about), np.random.default_rng(0)
    drawn = [floor.draw(rng) for _ in range(40)]
    assert all(place is not None and low_x_m < place.x_m < high_x_m for place in drawn)


SQUARE = np.array([[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 1.0, 1.0], [1.0, 1.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    ("side_m", "turn_rad", "shed_m", "inside_m"),
    [(8.0, 0.4, 0.0, 8.0), (8.0, 0.0, 0.0, 8.0), (0.0, 0.0, 3.0, 0.0), (18.5, 0.0, 3.0, 18.5)],
)
def test_starts_are_drawn_inside_of_a_house_whatever_its_yard(
    side_m: float, turn_rad: float, shed_m: float, inside_m: float
) -> None:
    """On a frame of 20 m the floor outside of a house of 8 m was the largest, and teams patrolled around it.

    A shed in a yard is none: there they begin in the yard.
    """
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    turned = np.kron(np.eye(2), np.array([[c, -s], [s, c]]))
    house = (side_m * (SQUARE - 0.5)) @ turned.T + 10.0
    walls = np.concatenate([house] * (side_m > 0.0) + [shed_m * SQUARE + 12.0] * (shed_m > 0.0))
    chart = WorldMap(
        "yard",
        (0.0, 0.0, 20.0, 20.0),
        geometry=SegmentMap(walls, np.zeros((0, 3)), (0.0, 0.0, 20.0, 20.0)),
    )
    floor, rng = OpenFloor(chart, 0.4, None), np.random.default_rng(0)
    for _ in range(40):
        place = floor.draw(rng)
        assert place is not None
        across, along = turned[:2, :2].T @ [place.x_m - 10.0, place.y_m - 10.0]
        assert (max(abs(across), abs(along)) < 0.5 * inside_m) == (inside_m > 0.0)
        assert not (12.0 < place.x_m < 12.0 + shed_m and 12.0 < place.y_m < 12.0 + shed_m)


@pytest.mark.parametrize("open_end", [True, False])
def test_a_hall_that_the_maps_edge_cuts_off_is_no_outside(open_end: bool) -> None:
    """A room of a fifth of its size beside it is not meant, though walls shut that in."""
    pieces = np.zeros((100, 220), np.int64)
    pieces[1:99, 0 if open_end else 1 : 150], pieces[1:60, 160:200] = 1, 2
    edge = np.ones(pieces.shape, np.bool_)
    edge[1:-1, 1:-1] = False
    assert meant_piece(pieces, edge) == 1
    assert meant_piece(np.zeros_like(pieces), edge) == 0


@pytest.mark.parametrize(("end", "turn_rad"), [(False, 0.0), (True, 0.0), (True, 0.4)])
def test_a_house_in_a_grid_is_meant_whatever_its_white_margin(end: bool, turn_rad: float) -> None:
    """Also where a wall is put up around the grid, along which the white runs then."""
    cells = np.full((200, 200), FREE, np.int8)
    cells[60:140, [60, 139]] = cells[[60, 139], 60:140] = OCCUPIED
    origin = Pose2(30.0, 5.0, turn_rad)
    grid = OccupancyGrid(cells, 0.1, origin)
    chart = WorldMap("house", bounds_of(grid), grid=closed(grid) if end else grid)
    floor, rng = OpenFloor(chart, 0.4, None), np.random.default_rng(0)
    inside = Floor.of(chart, 0.3)
    assert inside.apart_fraction == 0.0
    for _ in range(20):
        place = floor.draw(rng)
        assert place is not None
        x, y = origin.placed(np.array([[10.0, 10.0]]))[0]
        assert math.hypot(place.x_m - x, place.y_m - y) < 4.0 * math.sqrt(2.0)
        assert inside.reachable[inside.cell_of(np.array([place.x_m, place.y_m]))]


def test_open_ground_goes_on_beyond_its_map() -> None:
    """Of a crater in it that is closed all around, a sixth of its size, nobody speaks."""
    cells = np.full((200, 200), FREE, np.int8)
    cells[60:140, [60, 139]] = cells[[60, 139], 60:140] = OCCUPIED
    grid = OccupancyGrid(cells, 0.1, Pose2(-10.0, -10.0, 0.0))
    chart = WorldMap("ground", bounds_of(grid), grid=grid, open_ground=True)
    place = OpenFloor(chart, 0.4, None).draw(np.random.default_rng(0))
    assert place is not None
    assert max(abs(place.x_m), abs(place.y_m)) > 4.0


def test_a_map_that_a_robot_made_is_of_where_it_began() -> None:
    """A race track is a twentieth of the white around it; the map's origin is on its start line."""
    cells = np.full((200, 200), OCCUPIED, np.int8)
    cells[:95], cells[97:103, 20:180], cells[105:] = FREE, FREE, FREE
    for origin, track in ((Pose2(-10.0, -10.0, 0.0), True), (Pose2(1.0, 1.0, 0.0), False)):
        grid = OccupancyGrid(cells, 0.1, origin)
        chart = WorldMap("track", bounds_of(grid), grid=closed(grid))
        place = OpenFloor(chart, 0.2, None).draw(np.random.default_rng(0))
        assert place is not None
        assert (abs(place.y_m - origin.y_m - 10.0) < 0.3) == track


def test_places_are_drawn_as_if_one_by_one_however_many_are_thrown_away() -> None:
    floor, rng, other = OpenFloor(WORLD, 2.3, None), np.random.default_rng(5), np.random.default_rng(5)
    place = floor.draw(rng)
    assert place is not None
    thrown_away = -1
    drawn = (0.0, 0.0, 0.0)
    while drawn != (place.x_m, place.y_m, place.theta_rad):
        x, y, theta = other.uniform([0.0, 0.0, -math.pi], [11.0, 5.0, math.pi])
        drawn, thrown_away = (float(x), float(y), float(theta)), thrown_away + 1
    assert thrown_away > 5
    assert rng.random() == other.random()


def test_a_floor_that_is_full_is_found_so_by_arrays(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundred thousand draws were made one by one: the refusal took ten seconds."""

    class Counted(np.random.Generator):
        calls = 0

        def uniform(self, *given: Any, **named: Any) -> Any:
            Counted.calls += 1
            return super().uniform(*given, **named)

    monkeypatch.setattr(open_floor, "room_m", lambda *_: pytest.fail("nobody fits 20 m from the middle"))
    rng = Counted(np.random.PCG64(0))
    assert OpenFloor(WORLD, 0.4, None).draw(rng, [(PoseConfig(x_m=4.0, y_m=2.0), 20.0)]) is None
    assert 0 < Counted.calls <= 1000


class TestLargeRobots:
    """They were drawn 1.5 m apart however large they are: inside each other, and refused for it."""

    def team(self, *overrides: str) -> Mission:
        large = ("robot.footprint.radius_m=1.0", "team.size=6", *overrides)
        mission = load_mission("museum-patrol", large, 0)
        return settle_places(mission, chart_of(mission.world), None)

    def test_stand_apart(self) -> None:
        starts = [robot.start for robot in self.team().robots]
        for index, start in enumerate(starts):
            for other in starts[:index]:
                assert start is not None
                assert other is not None
                assert math.hypot(start.x_m - other.x_m, start.y_m - other.y_m) >= 2.1

    def test_are_refused_for_their_size_where_there_is_no_room_for_so_many(self) -> None:
        with pytest.raises(InputError, match=r"places 5\.1 m apart .* or for smaller robots$"):
            self.team("robot.footprint.radius_m=2.5", "team.size=16")
        with pytest.raises(InputError, match=r"places 30 m apart .* or for less team.spacing_m$"):
            self.team("team.spacing_m=30")


def _map_of(walls: list[list[float]]) -> WorldMap:
    geometry = SegmentMap.of(np.array(walls, float))
    return WorldMap("drawn", geometry.bounds_m, geometry=geometry)


def _ring(*corners: tuple[float, float]) -> list[list[float]]:
    return [[*corners[k - 1], *corners[k]] for k in range(len(corners))]


@pytest.mark.parametrize(
    ("walls", "inside_m", "outside_m"),
    [
        (_ring((0, 0), (20, 0), (20, 3), (3, 3), (3, 20), (0, 20)), (1.5, 10.0), (10.0, 10.0)),
        (_ring((0.0, 0.0), (18.36, 15.46), (15.14, 19.29), (-3.22, 3.82)), (7.57, 9.65), (16.0, 4.0)),
    ],
    ids=["l-shaped", "turned"],
)
def test_starts_are_drawn_inside_of_a_building_that_fills_little_of_its_map(
    walls: list[list[float]], inside_m: tuple[float, float], outside_m: tuple[float, float]
) -> None:
    """The map's corners beyond the walls were the largest floor: a team patrolled outside."""
    world = _map_of(walls)
    floor, rng = OpenFloor(world, 0.4, None), np.random.default_rng(0)
    cells = Floor.of(world, 0.3)
    assert cells.apart_fraction == 0.0
    assert cells.reachable[cells.cell_of(np.array(inside_m))]
    for _ in range(40):
        place = floor.draw(rng)
        assert place is not None
        assert cells.reachable[cells.cell_of(np.array([place.x_m, place.y_m]))]
    with pytest.raises(InputError, match="outside of the building"):
        cells.nearest_cell(np.array(outside_m))
    # Who begins there means to be there.
    around = Floor.of(world, 0.3, inside_xy_m=outside_m)
    assert around.reachable[around.cell_of(np.array(outside_m))]


def test_a_yard_that_is_open_to_one_side_is_no_building_of_the_boxes_in_it() -> None:
    sides = [[0.0, 0.0, 20.0, 0.0], [0.0, 0.0, 0.0, 20.0], [0.0, 20.0, 20.0, 20.0]]
    box, shed = _ring((4, 4), (7, 4), (7, 7), (4, 7)), _ring((17, 10), (20, 10), (20, 13), (17, 13))
    cells = Floor.of(_map_of([*sides, *box, *shed]), 0.3)
    assert cells.reachable[cells.cell_of(np.array([12.0, 12.0]))]
