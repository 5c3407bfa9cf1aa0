"""Floors that passages are too narrow for are told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import Pose2
from pilotage.evaluation.narrow_passages import cut_off
from pilotage.experiments.build.build import build
from pilotage.experiments.mission import mission_of, read_mission
from pilotage.maps.floor import Floor
from pilotage.maps.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from pilotage.maps.world_map import WorldMap
from pilotage.stack.patrol.derive import derive_drivable
from support.patrol_floors import walled, with_door


@pytest.mark.parametrize(("radius_m", "share"), [(0.2, 0.0), (0.4, 0.0), (0.6, 0.5)])
def test_a_room_behind_a_door_that_is_too_narrow_is_left_out(radius_m: float, share: float) -> None:
    floor = Floor.of(with_door(1.0), radius_m, inside_xy_m=(2.0, 2.5))
    assert floor.cut_off_fraction == pytest.approx(share, abs=0.02)
    told = [event.text for event in cut_off(floor)]
    assert len(told) == (share > 0.0)
    assert all("a body 1.20 m across" in text for text in told)


def test_a_start_with_too_little_to_spare_says_how_much_is_asked_for() -> None:
    """It was "0.374 m from walls, found 0.38 m, but no passage so wide leads there"."""
    floor = Floor.of(walled(8, 0.75), 0.374, 0.01, (1.0, 0.375), exact=True)
    with pytest.raises(InputError, match=r"^start \(1, 0\.375\): .*, 0\.394 m from walls, found 0\.38 m$"):
        floor.roomy(0.02, 0.3, (1.0, 0.375))


@pytest.mark.parametrize("x_m", [0.0, 0.05, -7.6, 0.03])
@pytest.mark.parametrize("y_m", [0.0, 0.05, -5.55])
def test_a_passage_is_found_wherever_the_map_begins(x_m: float, y_m: float) -> None:
    """A room was lost where no cell of 0.1 m, or no node, lay in the middle of its door of 0.75 m."""
    cells = np.zeros((61, 122), np.bool_)
    cells[[0, -1]] = cells[:, [0, 60, -1]] = True
    cells[20:35, 60] = False
    grid = OccupancyGrid.of(cells, 0.05, Pose2(x_m, y_m, 0.0))
    world = WorldMap("rooms", (x_m, y_m, x_m + 6.1, y_m + 3.05), grid=grid)
    floor = Floor.of(world, 0.35, inside_xy_m=(x_m + 1.5, y_m + 1.5))
    assert floor.reachable[floor.cell_of(np.array([x_m + 4.5, y_m + 1.5]))]


@pytest.mark.parametrize(("side_m", "cells", "both"), [(0.1, 8, True), (0.05, 16, True), (0.1, 7, False)])
@pytest.mark.parametrize("x_m", [0.0, 0.03, -17.5])
def test_a_patrol_counts_on_doors_as_wide_as_it_asks_for(
    side_m: float, cells: int, both: bool, x_m: float
) -> None:
    """A body of 0.6 m with 0.1 m on either side: of drawn houses with doors of 0.8 m one room was left."""
    drawn = np.zeros((round(3.1 / side_m), round(6.3 / side_m)), np.bool_)
    drawn[[0, -1]] = drawn[:, [0, 31, -1]] = True
    drawn[10 : 10 + cells, 31] = False
    rows, columns = drawn.shape
    grid = OccupancyGrid.of(drawn, side_m, Pose2(x_m, -7.6, 0.0))
    world = WorldMap("rooms", (x_m, -7.6, x_m + columns * side_m, -7.6 + rows * side_m), grid=grid)
    _, derived = derive_drivable(world, 0.3)
    x = derived.graph.vertices_xy_m[:, 0] - x_m
    assert (x.min() < 31 * side_m and x.max() > 32 * side_m) == both


def test_what_nobody_could_come_to_is_not_left_out() -> None:
    """A closed room is no floor behind a narrow passage."""
    floor = Floor.of(walled(8, 5, (4, 0, 4, 5)), 0.3, inside_xy_m=(2.0, 2.5))
    assert floor.apart_fraction == pytest.approx(0.5, abs=0.05)
    assert floor.cut_off_fraction == 0.0
    assert cut_off(floor) == []


def test_what_is_solid_is_no_floor_that_nothing_leads_to() -> None:
    """Of rooms amid unknown cells a sweep told up to 96 % of the floor as beyond reach, a patrol nothing."""
    cells = np.full((100, 120), UNKNOWN, dtype=np.int8)
    cells[20:80, 30:90] = FREE
    cells[40:55, 50:70] = OCCUPIED
    grid = OccupancyGrid(cells, 0.05, Pose2(0.0, 0.0, 0.0))
    world = WorldMap("a room", (0.0, 0.0, 6.0, 5.0), grid=grid)
    sampled, exact = (Floor.of(world, 0.2, inside_xy_m=(2.0, 1.5), exact=exact) for exact in (False, True))
    assert sampled.apart_fraction == exact.apart_fraction == 0.0
    assert np.count_nonzero(exact.reachable) == pytest.approx(np.count_nonzero(sampled.reachable), rel=0.05)


@pytest.mark.parametrize(("door_m", "told"), [(0.5, ["cut-off"]), (1.2, [])])
def test_a_patrol_that_leaves_half_of_the_floor_out_says_so(door_m: float, told: list[str]) -> None:
    values, half_m = read_mission("museum-patrol"), 0.5 * door_m
    walls = [[0.0, 0.0, 8.0, 0.0], [8.0, 0.0, 8.0, 5.0], [8.0, 5.0, 0.0, 5.0], [0.0, 5.0, 0.0, 0.0]]
    walls += [[4.0, 0.0, 4.0, 2.5 - half_m], [4.0, 2.5 + half_m, 4.0, 5.0]]
    values["world"] = {"map": {"map": "two rooms", "bounds_m": [0, 0, 8, 5], "walls_m": walls}}
    values["team"] = {"size": 1, "strategy": "cyclic"}
    values["task"] = {"name": "patrol", "duration_s": 1.0}
    task: Any = build(mission_of(values, seed=0)).task
    assert [event.kind for event in task.events] == told
