"""Patrol graphs: read, refused, laid over a floor; tours on them."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contract.patrol_examples import lattice
from pilotage.core.errors import InputError
from pilotage.evaluation.shortest_path import shortest_path
from pilotage.kernels.control import eikonal
from pilotage.kernels.scans.sight import hidden
from pilotage.maps.floor import Floor
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.stack.patrol.derive import DerivationConfig, derive_drivable, derive_graph
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.graph_file import on_floor, read_patrol_graph
from pilotage.stack.patrol.roadmap import MOST_NODES, Roadmap, usual_spacing_m
from pilotage.stack.patrol.tours import Round, spread

PAIR = "2 100 80 0.1 1 2\n\n0 10 20 1 1 E 30\n\n1 40 20 1 0 W 34"
# Two rooms of 6 m x 5 m, a door of 1.2 m between them.
ROOMS = SegmentMap(
    np.array(
        [[0, 0, 12, 0], [12, 0, 12, 5], [12, 5, 0, 5], [0, 5, 0, 0], [6, 0, 6, 1.9], [6, 3.1, 6, 5]],
        dtype=float,
    ),
    np.zeros((0, 3)),
    (0.0, 0.0, 12.0, 5.0),
)
WORLD = WorldMap("rooms", ROOMS.bounds_m, geometry=ROOMS)


def graph_in(folder: Path, text: str) -> PatrolGraph:
    path = folder / "floor.graph"
    path.write_text(text)
    return read_patrol_graph(path)


def test_a_file_in_pixels_becomes_metres(tmp_path: Path) -> None:
    graph = graph_in(tmp_path, PAIR)
    assert np.allclose(graph.vertices_xy_m, [[2.0, 4.0], [5.0, 4.0]])
    assert graph.edges_m[0, 1] == graph.edges_m[1, 0] == pytest.approx(3.2)  # costs of 30 and 34
    assert graph_in(tmp_path, PAIR.replace("34", "3")).edges_m[0, 1] == pytest.approx(
        3.0
    )  # not below straight
    one_way = graph_in(tmp_path, PAIR.replace("1 40 20 1 0 W 34", "1 40 20 0"))
    assert one_way.edges_m[0, 1] == one_way.edges_m[1, 0] == pytest.approx(3.0)
    about_middle = graph_in(tmp_path, PAIR.replace("10 20 1", "-10 -20 1"))
    assert np.allclose(about_middle.vertices_xy_m, [[0.0, 0.0], [5.0, 4.0]])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PAIR[:-3], "cut short"),
        ("", "cut short"),
        (PAIR + " 7", "no more"),
        (PAIR.replace("0.1", "-1"), "above 0"),
        (PAIR.replace("0.1", "nan"), "found 'nan'"),
        (PAIR.replace("\n1 40", "\n2 40"), "expected vertex 1, found 2"),
        (PAIR.replace("1 0 W", "1 5 W"), "neighbours among"),
        (PAIR.replace("10 20 1 1 E 30", "10 20 0").replace("1 0 W 34", "0"), "connected"),
        (PAIR.replace("E 30", "E x"), "found 'x'"),
        ("99999" + PAIR[1:], "at most 2,000"),
        (PAIR.replace("E 30", "E -30"), "line 3: expected the cost from vertex 0 to 1 not below 0"),
        (PAIR.replace("40 20", "4_0 20"), "line 5: expected a pixel of vertex 1, found '4_0'"),
        (PAIR.replace("\n", "\r\n").replace("\n1 40", "\nx 40"), "line 5: expected vertex 1, found 'x'"),
    ],
)
def test_what_is_no_graph_is_refused_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        graph_in(tmp_path, text)
    assert "\n" not in str(caught.value)
    assert "floor.graph" in str(caught.value)


def test_neighbours_that_are_told_twice_are_one(tmp_path: Path) -> None:
    """One of the published files has such a vertex."""
    twice = graph_in(tmp_path, PAIR.replace("1 1 E 30", "2 1 W 99 1 E 30"))
    assert twice == graph_in(tmp_path, PAIR)


@settings(max_examples=200, deadline=None)
@given(st.data())
def test_damaged_files_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    words = PAIR.split()
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.integers(0, len(words) - 1))
        words[place] = data.draw(
            st.sampled_from(["", "-1", "0", "1e400", "nan", "x", "3", "9" * 30, "٣", "1.5"])
        )
    try:
        graph = graph_in(tmp_path_factory.mktemp("damaged"), " ".join(words))
    except InputError:
        return
    assert np.isfinite(graph.shortest_m).all()


def test_paths_follow_edges_and_have_the_shortest_length() -> None:
    graph = lattice()
    for a in range(len(graph)):
        for b in range(len(graph)):
            path = graph.path(a, b)
            legs = [graph.edges_m[u, v] for u, v in pairwise(path)]
            assert sum(legs) == pytest.approx(graph.shortest_m[a, b])
            assert all(math.isfinite(leg) for leg in legs)


def test_the_best_round_of_a_lattice_with_a_dead_end_is_known() -> None:
    walk = Round.best(lattice(4, 3, 2.0))
    assert walk.length_m == pytest.approx(12 * 2.0 + 2 * 6.0)
    assert set(walk.stops.tolist()) == set(range(13))
    legs = np.diff([*walk.at_m, walk.length_m])
    assert np.allclose(legs, lattice().edges_m[walk.stops, np.roll(walk.stops, -1)])


def test_slots_are_evenly_spaced_and_can_be_reached_in_time() -> None:
    graph = lattice()
    walk, starts = Round.best(graph), np.array([0, 0, 5, 12])
    slots = spread(walk, graph, starts, 0.5, 10.0)
    # Where each would have begun at one instant, had it driven on before.
    last_s = max(slot.leaves_s for slot in slots)
    at_m = np.sort(
        [(walk.at_m[slot.place] + 0.5 * (last_s - slot.leaves_s)) % walk.length_m for slot in slots]
    )
    gaps = np.diff([*at_m, at_m[0] + walk.length_m])
    assert np.allclose(gaps, walk.length_m / 4)
    for start, slot in zip(starts, slots, strict=True):
        assert slot.leaves_s >= 10.0 + graph.shortest_m[start, walk.stops[slot.place]] / 0.5 - 1e-9


def test_edges_on_a_floor_are_as_long_as_the_path_that_is_driven() -> None:
    floor = Floor.of(WORLD, 0.3)
    far = 30.0
    graph = PatrolGraph.of(np.array([[3.0, 4.4], [9.0, 4.4]]), np.array([[0.0, far], [far, 0.0]]))
    length = on_floor(graph, floor).edges_m[0, 1]
    exact = shortest_path(ROOMS, (3.0, 4.4), (9.0, 4.4), 0.3)
    assert exact is not None
    assert exact.length_m - 0.1 < length < 1.06 * exact.length_m


def test_what_no_passage_leads_to_is_told() -> None:
    """A door of 1.2 m: two robots of radius 0.7 m would fit behind it, and cannot come there."""
    assert Floor.of(WORLD, 0.3).apart_fraction == 0.0
    assert Floor.of(WORLD, 0.7, inside_xy_m=(3.0, 2.0)).apart_fraction == pytest.approx(0.5, abs=0.02)


def test_what_is_behind_a_passage_with_too_little_to_spare_can_be_left_out() -> None:
    """A door of 1.2 m leaves a body of 0.55 m 5 cm on either side."""
    floor = Floor.of(WORLD, 0.55, 0.02, (3.0, 2.0), exact=True)
    beside = floor.cell_of(np.array([9.0, 2.0]))
    for spare_m, left in ((0.03, True), (0.07, False)):
        roomy = floor.roomy(spare_m, 0.2, (3.0, 2.0))
        assert roomy.reachable[beside] == left
        here = floor.middles(floor.reachable)[:, 0] < 5.4
        assert roomy.reachable[floor.reachable][here].all(), "all along the walls"


@pytest.mark.parametrize("place", [(6.0, 1.0), (20.0, 2.0), (6.0, 4.0)])
def test_vertices_in_walls_are_refused(place: tuple[float, float]) -> None:
    graph = PatrolGraph.of(np.array([[3.0, 2.0], place]), np.array([[0.0, 9.0], [9.0, 0.0]]))
    if place == (6.0, 1.0) or place == (6.0, 4.0):
        floor = Floor.of(WORLD, 0.7, inside_xy_m=(3.0, 2.0))  # the door is too narrow, the wall near
    else:
        floor = Floor.of(WORLD, 0.3)
    with pytest.raises(InputError, match=r"my.graph: vertex 1 \(.*expected a place on the reachable floor"):
        on_floor(graph, floor, "my.graph")


@pytest.mark.parametrize(
    ("place", "in_wall"), [((6.0, 1.0), True), ((0.03, 2.0), True), ((0.25, 2.0), False)]
)
def test_vertices_in_thin_walls_are_refused_though_the_floor_is_near(
    place: tuple[float, float], *, in_wall: bool
) -> None:
    """They were taken for what the robot comes to half a metre off; beside a wall that is what is meant."""
    graph = PatrolGraph.of(np.array([[3.0, 2.0], place]), np.array([[0.0, 9.0], [9.0, 0.0]]))
    floor = Floor.of(WORLD, 0.3)
    if in_wall:
        with pytest.raises(
            InputError, match=r"my.graph: vertex 1 \(.*expected a place on the floor, found a wall"
        ):
            on_floor(graph, floor, "my.graph")
    else:
        assert len(on_floor(graph, floor, "my.graph")) == 2


def test_two_vertices_at_one_place_are_told() -> None:
    places, lengths_m = np.array([[3.0, 2.0], [3.0, 2.0]]), np.array([[0.0, 9.0], [9.0, 0.0]])
    graph = PatrolGraph.of(places, lengths_m)
    with pytest.raises(InputError, match="found 0 m from vertex 0 to 1, which are at one place"):
        on_floor(graph, Floor.of(WORLD, 0.3))


def test_every_point_of_a_derived_floor_is_seen_from_a_vertex() -> None:
    floor = Floor.of(WORLD, 0.3)
    derived = derive_graph(WORLD, floor, DerivationConfig(reach_m=5.0))
    graph = derived.graph
    assert derived.rooms == 2
    assert len(derived.doors_xy_m) == 1
    assert np.hypot(*(derived.doors_xy_m[0] - [6.0, 2.5])) < 0.4
    viewpoints = graph.vertices_xy_m[: derived.viewpoints]
    for x, y in derived.points_xy_m:
        assert any(
            math.hypot(x - vx, y - vy) <= 5.0 and not hidden(vx, vy, x, y, ROOMS.segments_m, ROOMS.circles_m)
            for vx, vy in viewpoints
        )
    assert all(ROOMS.distance_m(x, y) >= 0.25 for x, y in graph.vertices_xy_m)
    assert len(graph) < 12


def test_a_floor_without_room_for_the_robot_is_refused() -> None:
    with pytest.raises(InputError, match="found none"):
        Floor.of(WORLD, 4.0)
    solid = WorldMap("solid", (0.0, 0.0, 2.0, 2.0), grid=OccupancyGrid.of(np.ones((20, 20), bool), 0.1))
    with pytest.raises(InputError, match="found none"):
        Floor.of(solid, 0.2)


@pytest.mark.parametrize("reach_m", [1e-9, 0.08])
def test_a_laser_that_sees_next_to_nothing_is_refused_at_once(reach_m: float) -> None:
    with pytest.raises(InputError, match="expected at most 400 vertices"):
        derive_graph(WORLD, Floor.of(WORLD, 0.3), DerivationConfig(reach_m=reach_m))


def passage(width_m: float, low: float = 2.03, begin: float = 4.0, end: float = 6.0) -> WorldMap:
    """Two rooms, and a passage from one to the other, off the lattice of everything."""
    high, far = low + width_m, end + 4.0
    walls = [[0, 0, begin, 0], [0, 0, 0, 5], [0, 5, begin, 5], [begin, 0, begin, low]]
    walls += [[begin, high, begin, 5], [begin, low, end, low], [begin, high, end, high]]
    walls += [[end, 0, end, low], [end, high, end, 5], [end, 0, far, 0], [far, 0, far, 5], [end, 5, far, 5]]
    rooms = SegmentMap(np.array(walls, dtype=float), np.zeros((0, 3)), (0.0, 0.0, far, 5.0))
    return WorldMap("passage", rooms.bounds_m, rooms)


@pytest.mark.parametrize(("width_m", "both"), [(0.72, False), (1.2, True)])
def test_a_derived_graph_counts_on_what_can_be_driven(width_m: float, both: bool) -> None:
    """Who keeps 8 cm from walls does not come through 72 cm: one of the rooms is the floor then."""
    world = passage(width_m)
    _, derived = derive_drivable(world, 0.3)
    vertices = derived.graph.vertices_xy_m
    assert (vertices[:, 0].min() < 4.0 and vertices[:, 0].max() > 6.0) == both
    roadmap = Roadmap(world, vertices, np.zeros((0, 2)), 0.38, 1.0, 0.15, 0.5, 0.35)
    assert all(math.isfinite(roadmap.longest_s(vertex)) for vertex in range(len(vertices)))


def test_a_place_behind_a_door_that_is_too_narrow_is_left_out_however_near_the_door() -> None:
    """The nearest cell of the floor that was left lay before the door, and the mission was refused."""
    world = passage(0.75, low=2.03, begin=2.72, end=2.81)
    _, derived = derive_drivable(world, 0.3, (4.8, 2.0))
    vertices = derived.graph.vertices_xy_m
    assert vertices[:, 0].min() > 2.81
    Roadmap(world, vertices, np.zeros((0, 2)), 0.38, 1.0, 0.15, 0.5, 0.35)


def test_a_passage_whose_middle_lies_between_two_cells_is_part_of_the_floor() -> None:
    """Of a floor with corridors of 0.9 m all but one room was left out without a word."""
    world = passage(0.88, low=1.96)
    _, derived = derive_drivable(world, 0.3)
    vertices = derived.graph.vertices_xy_m
    assert vertices[:, 0].min() < 4.0
    assert vertices[:, 0].max() > 6.0
    # Who begins in it is on the floor as well.
    assert len(derive_drivable(world, 0.3, (5.0, 2.4))[1].graph) == len(derived.graph)


@pytest.mark.parametrize(("width_m", "low"), [(0.86, 2.03), (0.8, 2.03), (0.79, 2.05)])
def test_a_passage_between_the_nodes_is_found_on_finer_ones(width_m: float, low: float) -> None:
    """Also where the nodes of the map's distances leave no room in its middle."""
    places = np.array([[2.0, 2.5], [8.0, 2.5]])
    roadmap = Roadmap(passage(width_m, low), places, np.zeros((0, 2)), 0.38, 1.0, 0.15, 0.5, 0.35)
    assert roadmap.spacing_m < 0.15
    assert 6.0 < roadmap.longest_s(0) < 14.0
    with pytest.raises(InputError, match="found none from vertex 0 to 1 of 2"):
        Roadmap(passage(0.74), places, np.zeros((0, 2)), 0.38, 1.0, 0.15, 0.5, 0.35)


@pytest.mark.parametrize("angle_rad", [0.2, 0.3, 0.6])
def test_straight_on_through_the_middle_of_a_door_leads_nearer(angle_rad: float) -> None:
    """In one of 0.95 m across the lattice nodes lay one by one: for a third of the way 5 cm on were worse."""
    along = np.array([math.cos(angle_rad), math.sin(angle_rad)])
    turn = np.array([along, [-along[1], along[0]]])
    geometry = passage(0.95).geometry
    assert isinstance(geometry, SegmentMap)
    walls = (geometry.segments_m.reshape(-1, 2) @ turn).reshape(-1, 4)
    turned = SegmentMap(walls, np.zeros((0, 3)), (-3.0, 0.0, 10.0, 11.0))
    world, places = WorldMap("turned", turned.bounds_m, turned), np.array([[2.0, 2.5], [8.0, 2.5]])
    roadmap = Roadmap(world, places @ turn, np.zeros((0, 2)), 0.38, 1.0, 0.15, 0.5, 0.35)
    field = roadmap.placed(roadmap.time_s(1))
    middle = np.column_stack([np.linspace(3.8, 6.2, 241), np.full(241, 2.505)]) @ turn
    for x, y in middle.tolist():
        on_x, on_y = x + 0.05 * along[0], y + 0.05 * along[1]
        assert eikonal.value_at(on_x, on_y, field, 2.0) < eikonal.value_at(x, y, field, 2.0)


def test_on_a_large_map_nodes_are_farther_apart() -> None:
    """A golf course of 320 m x 236 m was refused, though 0.2 m between nodes show each gap for a robot."""
    assert usual_spacing_m((0.0, 0.0, 60.0, 40.0), 0.38) == 0.15
    spacing_m = usual_spacing_m((-10.0, 5.0, 309.5, 241.2), 0.28)
    assert spacing_m == 0.2
    assert (319.5 / spacing_m) * (236.2 / spacing_m) <= MOST_NODES
    # Where they would step over gaps it is refused as before.
    assert usual_spacing_m((0.0, 0.0, 2000.0, 2000.0), 0.38) == 0.15
    large = WorldMap("field", (0.0, 0.0, 2000.0, 2000.0), passage(1.2).geometry)
    with pytest.raises(InputError, match=r"expected at most 2000000 nodes on a map of 2000\.0 x 2000\.0 m"):
        Roadmap(large, np.array([[2.0, 2.5]]), np.zeros((0, 2)), 0.38, 1.0, 0.15, 0.5, 0.35)


def test_where_there_is_room_nodes_are_as_far_apart_as_asked_for() -> None:
    places = np.array([[2.0, 2.5], [8.0, 2.5]])
    assert Roadmap(passage(1.2), places, np.zeros((0, 2)), 0.38, 1.0, 0.15, 0.5, 0.35).spacing_m == 0.15


def test_the_vertex_that_is_nearest_behind_a_wall_is_not_where_a_robot_begins() -> None:
    floor = Floor.of(WORLD, 0.25)
    places = np.array([[5.4, 4.4], [8.5, 2.5]])
    # The other one is 1.2 m away, through the wall.
    points = np.array([[6.6, 4.4], [5.0, 2.5]])
    np.testing.assert_array_equal(np.argmin(floor.away_m(places, points), axis=1), [1, 0])
    np.testing.assert_array_equal(np.argmin(floor.away_m(places[::-1], points), axis=1), [0, 1])


def test_graphs_of_the_same_floor_are_one() -> None:
    """So that their tours and shares are worked out once."""
    graph, again = lattice(3, 4), lattice(3, 4)
    assert graph == again
    assert hash(graph) == hash(again)
    assert Round.best(graph) is Round.best(again)
    assert graph != lattice(4, 3)
    assert graph != graph.vertices_xy_m.tobytes()


def test_a_roadmap_keeps_the_fields_that_were_asked_for_last(monkeypatch: pytest.MonkeyPatch) -> None:
    places = np.array([[1.0, 1.0], [5.0, 4.0], [8.0, 1.0], [11.0, 4.0]])
    settings = (WORLD, places, np.zeros((0, 2)), 0.38, 1.0, 0.15, 0.5, 0.35)
    roomy = Roadmap(*settings)
    fields = [roomy.time_s(k) for k in range(4)]
    assert all(roomy.time_s(k) is fields[k] for k in range(4))
    monkeypatch.setattr("pilotage.stack.patrol.roadmap.MOST_FIELD_BYTES", 2 * fields[0].nbytes)
    roadmap = Roadmap(*settings)
    fields = [roadmap.time_s(k) for k in range(4)]
    assert roadmap.time_s(2) is fields[2]
    assert roadmap.time_s(3) is fields[3]
    assert roadmap.time_s(0) is not fields[0]
    assert np.array_equal(roadmap.time_s(0), fields[0])
    assert roadmap.time_s(3) is fields[3]  # asked for after the other one
    assert roadmap.time_s(2) is not fields[2]
