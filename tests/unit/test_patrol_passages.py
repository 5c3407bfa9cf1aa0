"""Where robots have a passage to themselves, and the plans taken for that."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pilotage.experiments.build.build import build
from pilotage.experiments.mission import mission_of, read_mission
from pilotage.maps.floor import Floor
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.passages import Passages
from pilotage.stack.patrol.plan_choice import PlanChoice, best_plan
from pilotage.stack.patrol.roadmap import Roadmap
from pilotage.stack.patrol.shut_paths import OpenGraph, ShutPaths
from pilotage.stack.patrol.strategy import PatrolSetting
from pilotage.stack.patrol.task import PatrolSite
from support.patrol_floors import on_floor, row, walled, with_corridor, with_door


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


def test_how_tight_it_is_for_two_is_told_along_each_edge_that_leads_there() -> None:
    graph, passages = row(with_door(1.0), (2.0, 2.5), (6.0, 2.5))
    there, back = passages.tight[0, 1], passages.tight[1, 0]
    np.testing.assert_array_equal(there, back[::-1])
    assert len(there) == 1 + 4.0 / 0.5
    assert there.max() == there[len(there) // 2] == 1.0
    # 2 m from the nearest wall, where two need 0.76 m.
    assert there[0] == pytest.approx((0.76 / 2.0) ** 2, rel=0.1)

    graph, passages = row(with_corridor(), (2.0, 2.5), (7.0, 2.5), (12.0, 2.5))
    left = OpenGraph.of(graph, passages, ShutPaths(unreached=(0,))).passages
    assert set(left.tight) == set(left.stretches) == {(0, 1), (1, 0)}
    np.testing.assert_array_equal(left.tight[0, 1], passages.tight[1, 2])
    longer = OpenGraph.of(graph, passages, ShutPaths(detours=((0, 1, 9.0),))).passages
    assert set(longer.tight) == set(longer.stretches) == {(1, 2), (2, 1)}


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
        step_m = roadmap.spacing_m
        off = np.hypot(step_m * columns - x, step_m * rows - 2.5 - shift_m)
        assert len(off) == 0 or (is_for_one and off.max() < 0.8)


@pytest.mark.parametrize(("width_m", "is_for_one"), [(1.45, True), (1.58, False)])
def test_a_corridor_is_as_wide_wherever_nodes_lie(width_m: float, is_for_one: bool) -> None:
    """Two pass each other where half of it is no less than 0.76 m, by both of a node's widths."""
    for shift_m in (0.0, 0.03, 0.06, 0.09, 0.12):
        low = 1.5 + shift_m
        walls = [(3, 0, 3, low), (3, low, 12, low), (12, low, 12, 0)]
        high = [(x0, low + width_m + low - y0, x1, low + width_m + low - y1) for x0, y0, x1, y1 in walls]
        world = walled(15, 2 * low + width_m, *walls, *high)
        places = np.array([[1.5, low + 0.5 * width_m], [13.5, low + 0.5 * width_m]])
        roadmap = Roadmap(world, places, np.zeros((0, 2)), 0.38, 1.0, 0.15, 0.5, 0.35)
        along = roadmap.way(4.0, float(places[0, 1]), roadmap.time_s(1), 7.0)
        told = [
            along[:, 2].min(),
            roadmap.narrowest_m(4.0, float(places[0, 1]), roadmap.time_s(1), 7.0, 7.0)[1],
        ]
        assert [room_m < 0.76 for room_m in told] == [is_for_one] * 2


def test_doors_that_face_each_other_make_no_place_to_pass() -> None:
    """A disc that two need lies between them, in one place; nobody waits there."""
    low, high, doors = 4.0, 5.4, ((5.0, 5.8), (8.4, 9.4), (12.0, 12.8))
    assert all(np.hypot(0.5 * (end - begin), 0.5 * (high - low)) > 0.76 for begin, end in doors)
    walls: list[tuple[float, float, float, float]] = []
    for y in (low, high):
        edges = [0.0, *(x for door in doors for x in door), 18.0]
        walls += [(a, y, b, y) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    places = [(0.6, 4.7), (17.4, 4.7), (5.4, 2.0), (12.4, 7.5)]
    _, passages = on_floor(walled(18, 9.4, *walls), places, [(0, 1), (0, 2), (1, 3)])
    (there,) = passages.stretches[0, 1]
    assert there.end_m - there.begin_m > 15.0


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
    assert best_plan(setting, [1.0] * 8, PlanChoice()).sizes == (8,)
    # Who is too near behind another watches it, and is held up.
    roomy = best_plan(setting, [1.0] * 8, PlanChoice(headway_m=12.0))
    assert len(roomy.sizes) > 1
    assert all(n == 1 or walk.length_m > 12.0 * n for walk, n in zip(roomy.rounds, roomy.sizes, strict=True))


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
    plan = best_plan(setting, [1.0] * 8, PlanChoice())
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
    values = read_mission("museum-patrol")
    values["world"] = rooms(1, 2)  # no other test may have met this map
    values["team"] = {"size": 2, "strategy": "cyclic", "radio": {}}
    values["task"], values["run"]["time_limit_s"] = {"name": "patrol", "duration_s": 1.0}, 1.0

    def site(radius_m: float, seed: int) -> PatrolSite:
        values["robot"]["footprint"] = {"radius_m": radius_m}
        task: Any = build(mission_of(values, seed=seed)).task
        patrol: PatrolSite = task.patrol
        return patrol

    one, other, smaller = site(0.3, 1), site(0.3, 2), site(0.25, 1)
    assert found == [0.3, 0.25]
    assert one.passages is other.passages
    assert smaller.passages is not one.passages
