"""Where robots have a passage to themselves, what waiting there costs, and the plans taken for that."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pilotage.experiments.build.build import build
from pilotage.experiments.mission import load_mission, mission_of, read_mission
from pilotage.maps.floor import Floor
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.meetings import is_crowded, keeps_apart, slowed, waits_m
from pilotage.stack.patrol.partition import Plan
from pilotage.stack.patrol.passages import OPEN, Passages
from pilotage.stack.patrol.roadmap import Roadmap
from pilotage.stack.patrol.strategies.adaptive_rounds import AdaptiveRoundsConfig, best_plan
from pilotage.stack.patrol.strategy import PatrolSetting
from pilotage.stack.patrol.tours import Round

RADIUS_M, MEETING_M = 0.3, 2.0


def walled(width_m: float, height_m: float, *walls: tuple[float, float, float, float]) -> WorldMap:
    edge = [(0, 0, width_m, 0), (width_m, 0, width_m, height_m), (width_m, height_m, 0, height_m)]
    segments = np.array([*edge, (0, height_m, 0, 0), *walls], dtype=float)
    geometry = SegmentMap(segments, np.zeros((0, 3)), (0.0, 0.0, width_m, height_m))
    return WorldMap("walled", geometry.bounds_m, geometry=geometry)


def row(world: WorldMap, *places: tuple[float, float]) -> tuple[PatrolGraph, Passages]:
    """Places one after the other, joined to the next."""
    floor, count = Floor.of(world, RADIUS_M), len(places)
    joined = np.abs(np.subtract.outer(np.arange(count), np.arange(count))) == 1
    xy = np.array(places)
    graph = PatrolGraph.of(xy, floor.lengths_m(xy, joined))
    return graph, Passages.of(floor, graph, RADIUS_M)


def with_door(width_m: float) -> WorldMap:
    """Two rooms of 4 m x 5 m with a door."""
    half_m = 0.5 * width_m
    return walled(8, 5, (4, 0, 4, 2.5 - half_m), (4, 2.5 + half_m, 4, 5))


def with_corridor() -> WorldMap:
    """A corridor of 6 m with room for one between two rooms."""
    low, high = 2.05, 2.95
    walls = [(4, 0, 4, low), (4, high, 4, 5), (10, 0, 10, low), (10, high, 10, 5)]
    return walled(14, 5, *walls, (4, low, 10, low), (4, high, 10, high))


@pytest.mark.parametrize(("width_m", "pieces"), [(0.8, 1), (1.0, 1), (1.3, 1), (1.8, 0), (3.0, 0)])
def test_a_door_has_room_for_one_or_for_two(width_m: float, pieces: int) -> None:
    _, passages = row(with_door(width_m), (2.0, 2.5), (6.0, 2.5))
    assert passages.pieces == pieces
    if pieces:
        (there,), (back,) = passages.stretches[0, 1], passages.stretches[1, 0]
        assert there.begin_m <= 2.0 <= there.end_m
        assert there.end_m - there.begin_m < 1.0
        assert (back.begin_m, back.end_m) == pytest.approx((4.0 - there.end_m, 4.0 - there.begin_m))
        assert back.piece == there.piece


@pytest.mark.parametrize(
    ("width_m", "is_for_one"), [(0.9, 1), (1.0, 1), (1.2, 1), (1.35, 1), (1.6, 0), (3.0, 0)]
)
def test_for_lanes_a_door_is_as_wide_as_it_is(width_m: float, is_for_one: int) -> None:
    """In a thin wall, wherever it lies between the nodes; nothing else is narrow, no corner of a room."""
    clearance_m, lane_m, pass_m = 0.38, 0.35, 0.73
    for shift_m in (0.0, 0.04, 0.07, 0.11):
        x, low, high = 4.0 + shift_m, 2.5 + shift_m - 0.5 * width_m, 2.5 + shift_m + 0.5 * width_m
        world = walled(8, 5, (x, 0, x, low), (x, high, x, 5))
        places = np.array([[2.0, 2.5], [6.0, 2.5]])
        roadmap = Roadmap(world, places, np.zeros((0, 2)), clearance_m, 1.0, 0.15, 0.5, lane_m)
        told = [
            roadmap.narrowest_m(x - ahead_m, 2.5 + off_m, roadmap.time_s(1), 5.0, 2.0)[1] < pass_m
            for ahead_m in (0.5, 0.7, 0.9, 1.1)
            for off_m in (-0.6, 0.0, 0.6)
        ]
        assert all(told) if is_for_one else not any(told)
        rows, columns = np.nonzero(np.isfinite(roadmap.slowness) & (roadmap._width_m < pass_m))
        off = np.hypot(0.15 * columns - x, 0.15 * rows - 2.5 - shift_m)
        assert len(off) == 0 or (is_for_one and off.max() < 0.8)


def test_who_turns_within_a_corridor_was_in_it_once() -> None:
    graph, passages = row(with_corridor(), (2.0, 2.5), (7.0, 2.5), (12.0, 2.5))
    assert passages.pieces == 2
    through, short = Round.through(graph, np.array([0, 1, 2])), Round.through(graph, np.array([0, 1]))
    there, back = passages.transits(through)
    # There and back, each through both halves.
    assert there.ways.keys() == {(0, 1), (1, 1)}
    assert back.ways.keys() == {(0, -1), (1, -1)}
    assert [once.end_m - once.begin_m for once in (there, back)] == pytest.approx([6.0, 6.0], abs=1.0)
    ((begin_m, end_m),) = there.against(back)
    assert (begin_m, end_m) == pytest.approx((there.begin_m, there.end_m), abs=0.5)
    assert there.against(there) == []
    for walk in (short, Round.through(graph, np.array([1, 0]))):  # also one that begins there
        (once,) = passages.transits(walk)
        assert once.ways.keys() == {(0, 1), (0, -1)}
        assert once.end_m - once.begin_m == pytest.approx(6.0, abs=1.0)
        for way, (since_m, until_m) in once.ways.items():
            assert once.begin_m - 1e-9 <= since_m <= until_m <= once.end_m + 1e-9, way


def test_who_comes_out_of_a_door_into_a_corridor_meets_who_comes_along_it_and_in_at_the_door() -> None:
    """Of a long passage only the door is shared with who turns in there, not all of it."""
    walls = [(0.0, 1.1, 3.5, 1.1), (4.5, 1.1, 9.5, 1.1), (10.5, 1.1, 14.0, 1.1), (7.0, 1.1, 7.0, 5.0)]
    floor = Floor.of(walled(14, 5, *walls), RADIUS_M)
    places = np.array([[4.0, 3.5], [4.0, 0.55], [10.0, 0.55], [10.0, 3.5]])
    graph = PatrolGraph.of(places, floor.lengths_m(places, np.eye(4, k=1) + np.eye(4, k=-1) > 0.0))
    passages = Passages.of(floor, graph, RADIUS_M)
    out_and_along, back = passages.transits(Round.through(graph, np.array([0, 1, 2, 3])))
    assert out_and_along.end_m - out_and_along.begin_m == pytest.approx(8.0, abs=1.5)
    (whole,) = out_and_along.against(back)
    assert whole == pytest.approx((out_and_along.begin_m, out_and_along.end_m), abs=0.7)
    # Who comes along the corridor the same way and in at the first door.
    other = Round.through(graph, np.array([1, 0]))
    (in_and_out,) = passages.transits(other)
    parts = out_and_along.against(in_and_out)
    assert sum(end_m - begin_m for begin_m, end_m in parts) < 2.5


def test_waits_by_hand() -> None:
    """To and fro through a door, each by itself at random; nobody waits for himself, nor for other rooms."""
    graph, passages = row(with_door(1.0), (1.0, 1.0), (2.0, 2.5), (6.0, 2.5), (7.0, 4.0))
    walk, left, right = (Round.through(graph, np.array(v)) for v in ([1, 2], [0, 1], [2, 3]))
    stretch = passages.stretches[1, 2][0]
    time_m = stretch.end_m - stretch.begin_m + MEETING_M
    rate = 1.0 / walk.length_m  # who comes the same way is followed
    wait_m = 2.0 * rate * time_m**2 / (2.0 * (1.0 - rate * time_m))
    assert waits_m(Plan((walk,), (2,), 0.0, 0.0), passages, MEETING_M) == pytest.approx([wait_m])
    both = Plan((walk, walk), (1, 1), 0.0, 0.0)
    assert waits_m(both, passages, MEETING_M) == pytest.approx([wait_m, wait_m])
    assert waits_m(Plan((walk,), (1,), 0.0, 0.0), passages, MEETING_M) == pytest.approx([0.0])
    assert waits_m(Plan((left, right), (1, 3), 0.0, 0.0), passages, MEETING_M) == pytest.approx([0.0, 0.0])
    assert slowed(both, passages, MEETING_M).rounds[1].length_m == pytest.approx(walk.length_m + wait_m)
    assert slowed(both, OPEN, MEETING_M).rounds[1].length_m == walk.length_m
    # Where a passage is always taken a wait is long, not without end nor below nothing.
    crowd = waits_m(Plan((walk,), (12,), 0.0, 0.0), passages, MEETING_M)
    assert wait_m < crowd[0] < 1000.0


def test_who_go_round_one_way_wait_for_nobody() -> None:
    """Two rooms with two doors: in by the one, out by the other. Who comes the other way round is met."""
    walls = [(4.0, 0.0, 4.0, 1.0), (4.0, 2.0, 4.0, 6.0), (4.0, 7.0, 4.0, 8.0)]
    floor = Floor.of(walled(8, 8, *walls), RADIUS_M)
    places = np.array([[2.0, 1.5], [6.0, 1.5], [6.0, 6.5], [2.0, 6.5]])
    around = np.abs(np.subtract.outer(np.arange(4), np.arange(4))) % 2 == 1
    graph = PatrolGraph.of(places, floor.lengths_m(places, around))
    passages = Passages.of(floor, graph, RADIUS_M)
    assert passages.pieces == 2
    walk, contrary = (Round.through(graph, np.array(v)) for v in ([0, 1, 2, 3], [3, 2, 1, 0]))
    assert waits_m(Plan((walk,), (8,), 0.0, 0.0), passages, MEETING_M).tolist() == [0.0]
    same = waits_m(Plan((walk, walk), (3, 5), 0.0, 0.0), passages, MEETING_M)
    against = waits_m(Plan((walk, contrary), (1, 1), 0.0, 0.0), passages, MEETING_M)
    assert same.tolist() == [0.0, 0.0]
    assert (against > 0.1).all()


def test_who_is_in_a_passage_has_nobody_behind_in_it() -> None:
    graph, passages = row(with_corridor(), (2.0, 2.5), (12.0, 2.5))
    walk, stands = Round.best(graph), Round.through(graph, np.array([0]))
    (begin_m, end_m, _), _ = passages.transits(walk)
    spare_m = 0.5 * walk.length_m - (end_m - begin_m)
    assert not is_crowded(walk, 2, passages, 0.9 * spare_m)
    assert is_crowded(walk, 2, passages, 1.1 * spare_m)
    assert not is_crowded(walk, 2, OPEN, 1.1 * spare_m)
    assert not is_crowded(walk, 1, passages, 100.0)
    assert not is_crowded(stands, 2, passages, 100.0)


def rooms(across: int, up: int) -> dict[str, Any]:
    """Rooms of 5 m, each with a door of 1 m to the next ones."""
    side = 5.0
    width, height = side * across, side * up
    walls = [[0, 0, width, 0], [width, 0, width, height], [width, height, 0, height], [0, height, 0, 0]]
    for k in range(1, across):
        for j in range(up):
            low, x = side * j, side * k
            walls += [[x, low, x, low + 2.0], [x, low + 3.0, x, low + side]]
    for j in range(1, up):
        for k in range(across):
            left, y = side * k, side * j
            walls += [[left, y, left + 2.0, y], [left + 3.0, y, left + side, y]]
    return {"map": {"map": "rooms", "bounds_m": [0, 0, width, height], "walls_m": walls}}


def planned(across: int, up: int, size: int) -> PatrolSetting:
    """What robots in so many rooms are told."""
    values = read_mission("museum-patrol")
    values["world"] = rooms(across, up)
    values["team"] = {"size": size, "strategy": "adaptive-rounds", "radio": {}}
    values["task"], values["run"]["time_limit_s"] = {"name": "patrol", "duration_s": 1.0}, 1.0
    stack: Any = build(mission_of(values, seed=0)).team[0].stack
    setting: PatrolSetting = stack._context.task.strategy._setting
    return setting


def test_in_rooms_robots_go_round_one_way() -> None:
    """A tour comes through each door once. Shares are to and fro: half turns, at 1.4 times the bound."""
    setting = planned(4, 3, 8)
    assert setting.passages.pieces > 10
    assert best_plan(setting, 8, AdaptiveRoundsConfig()).sizes == (8,)
    # As where turning back costs nothing.
    assert best_plan(replace(setting, turn_m=0.0), 8, AdaptiveRoundsConfig()).sizes == (8,)
    # Who is too near behind another watches it, and is held up.
    roomy = best_plan(setting, 8, AdaptiveRoundsConfig(headway_m=8.0))
    assert len(roomy.sizes) > 1
    assert all(n == 1 or walk.length_m > 8.0 * n for walk, n in zip(roomy.rounds, roomy.sizes, strict=True))


def test_two_who_stand_at_one_place_are_on_no_round_too_near_to_each_other() -> None:
    graph, passages = row(walled(16, 5), (1.0, 2.5), (8.0, 2.5), (15.0, 2.5))
    setting = replace(planned(2, 2, 4), graph=graph, passages=passages, turn_m=0.0)
    assert best_plan(setting, 4, AdaptiveRoundsConfig()).sizes == (2, 1, 1)


def test_who_meets_mates_head_on_in_a_passage_shares_no_round_there() -> None:
    """Two rooms and a door between: whoever comes through comes back, half a round later."""
    graph, passages = row(with_door(1.0), (1.0, 2.5), (7.0, 2.5))
    walk = Round.best(graph)
    assert passages.pieces == 1
    # One is in one room when the other is in the other, but both want through the door at once.
    assert not keeps_apart(walk, 2, passages, 0.0, 2.5)
    assert keeps_apart(walk, 1, passages, 0.0, 2.5)
    assert keeps_apart(walk, 2, OPEN, 0.5 * walk.length_m, 2.5)
    assert not keeps_apart(walk, 2, OPEN, 0.6 * walk.length_m, 2.5)
    # Nearer to one end its times there and back are no half a round apart.
    graph, passages = row(with_door(1.0), (3.0, 2.5), (7.0, 2.5))
    assert keeps_apart(Round.best(graph), 2, passages, 0.0, 0.5)


@pytest.mark.parametrize(
    ("speed_m_s", "rate_rad_s", "turn_m"), [(1.0, 2.0, np.pi / 2 + 0.25 - 1.0), (0.2, 2.0, 0.0)]
)
def test_what_turning_back_costs_is_what_the_slowest_says(
    speed_m_s: float, rate_rad_s: float, turn_m: float
) -> None:
    """Beyond the way of half a metre to the place and back, which who turns there is spared."""
    values = read_mission("museum-patrol")
    values["world"] = rooms(2, 1)
    motion = {"name": "differential-drive", "max_speed_m_s": speed_m_s, "max_turn_rate_rad_s": rate_rad_s}
    values["robot"]["motion"] = motion
    values["team"] = {"size": 2, "strategy": "adaptive-rounds", "radio": {}}
    values["task"], values["run"]["time_limit_s"] = {"name": "patrol", "duration_s": 1.0}, 1.0
    experiment = build(mission_of(values, seed=0))
    task: Any = experiment.task
    assert task.patrol.turn_m == pytest.approx(turn_m)
    stack: Any = experiment.team[1].stack
    assert stack._context.task.strategy._setting.turn_m == task.patrol.turn_m


def test_more_robots_than_places_stand_at_them() -> None:
    graph, _ = row(walled(14, 5), (1.0, 2.5), (7.0, 2.5), (13.0, 2.5))
    setting = PatrolSetting(graph, 0, np.arange(8) % 3, 1.0, np.random.default_rng(0))
    plan = best_plan(setting, 8, AdaptiveRoundsConfig())
    assert plan.worst_m == 0.0
    assert sorted(plan.sizes) == [2, 3, 3]


def test_cells_of_many_points_are_those_of_each() -> None:
    """Points beyond the floor as well, and on the borders of cells."""
    floor = Floor.of(with_corridor(), 0.3)
    rng = np.random.default_rng(0)
    points = np.vstack([rng.uniform(-3.0, 12.0, (300, 2)), 0.1 * rng.integers(-10, 100, (300, 2))])
    rows, columns = floor.cells_of(points)
    assert list(zip(rows.tolist(), columns.tolist(), strict=True)) == [floor.cell_of(p) for p in points]


def test_passages_of_a_map_are_followed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every trial of a study, and a run after its warm-up, searched each edge's path anew."""
    found: list[float] = []
    of = Passages.of

    def counted(floor: Floor, graph: PatrolGraph, radius_m: float) -> Passages:
        found.append(radius_m)
        return of(floor, graph, radius_m)

    monkeypatch.setattr(Passages, "of", counted)
    short = ["task.duration_s=10", "run.time_limit_s=10"]
    one, other, larger = (
        build(load_mission("museum-patrol", [*short, f"robot.footprint={{radius_m: {radius_m}}}"], seed)).task
        for radius_m, seed in ((0.3, 1), (0.3, 2), (0.25, 1))
    )
    assert found in ([0.3, 0.25], [0.25])  # another test may have met this map
    assert one.patrol.passages is other.patrol.passages  # type: ignore[attr-defined]
    assert larger.patrol.passages is not one.patrol.passages  # type: ignore[attr-defined]
