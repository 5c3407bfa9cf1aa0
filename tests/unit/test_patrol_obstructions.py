"""Who stands for long and says nothing is planned around: a mate that failed in a door, say."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of, read_mission
from pilotage.stack.navigator.patrol.obstructions import ABSENT_S, KEPT_S, SHUTS_S, Obstructions
from pilotage.stack.patrol.roadmap import Roadmap

NOBODY: FloatArray = np.zeros((0, 2))
BODY: FloatArray = np.array([[3.0, 1.0]])
DOOR_Y_M = 1.0
KEEP_M = 0.68


def two_rooms(*doors_y_m: float) -> dict[str, Any]:
    """Two rooms of 5 m x 6 m, with doors of 1 m between them; a robot fails in the one at the bottom."""
    ends = [0.0, *(end for y in doors_y_m for end in (y - 0.5, y + 0.5)), 6.0]
    walls: list[list[float]] = [[0, 0, 10, 0], [10, 0, 10, 6], [10, 6, 0, 6], [0, 6, 0, 0]]
    walls += [[5, low, 5, high] for low, high in zip(ends[::2], ends[1::2], strict=True)]
    values = read_mission("museum-patrol")
    values["world"] = {"map": {"map": "two rooms", "bounds_m": [0, 0, 10, 6], "walls_m": walls}}
    values["task"] = {"name": "patrol", "duration_s": 120.0, "derive": {"reach_m": 3.0}}
    values["robots"] = [
        {"start": {"x_m": 5.0, "y_m": DOOR_Y_M, "theta_rad": 0.0}},
        {"start": {"x_m": 2.0, "y_m": 3.0, "theta_rad": 0.0}},
        {"start": {"x_m": 1.0, "y_m": 5.0, "theta_rad": 0.0}},
    ]
    values["team"] = {
        "strategy": "cyclic",
        "radio": {},
        "failures": [{"robot": 0, "at_s": 0.0}],
    }
    values["run"]["time_limit_s"] = 120.0
    return values


def roadmap_of(*doors_y_m: float) -> Roadmap:
    stack: Any = build(mission_of(two_rooms(*doors_y_m), seed=0)).team[1].stack
    found = stack._context.roadmap
    assert isinstance(found, Roadmap)
    return found


def seen(kept: Obstructions, t_s: float, bodies: FloatArray, **more: Any) -> bool:
    """One scan; nothing is seen to be absent unless said."""
    absent = more.get("absent", np.zeros(len(kept.known_xy_m), dtype=np.bool_))
    return kept.step(t_s, bodies, absent, more.get("silent", NOBODY), more.get("told", NOBODY))


class TestWhoStands:
    def test_for_long_is_planned_around_and_told(self) -> None:
        kept = Obstructions()
        changes = [seen(kept, 0.5 * k, BODY + 0.01 * (k % 2)) for k in range(41)]
        assert changes.index(True) == round(SHUTS_S / 0.5)
        assert sum(changes) == 1
        assert kept.shutting_xy_m.tolist() == BODY.tolist()
        assert kept.told() == ((3.0, 1.0),)

    def test_where_a_mate_fell_silent_is_planned_around_at_once(self) -> None:
        kept = Obstructions()
        assert seen(kept, 0.0, BODY, silent=BODY + 0.3)
        assert not seen(kept, 1.0, BODY, silent=BODY + 0.3)

    def test_is_forgotten_where_nothing_is_seen_any_more(self) -> None:
        kept = Obstructions()
        seen(kept, 0.0, BODY, silent=BODY)
        gone = np.array([True])
        assert not seen(kept, 0.5 * ABSENT_S, NOBODY, silent=BODY, absent=gone)
        assert seen(kept, 1.1 * ABSENT_S, NOBODY, silent=BODY, absent=gone)
        assert not len(kept.known_xy_m)

    @pytest.mark.parametrize("failed", [True, False])
    def test_is_looked_for_again_unless_a_mate_failed_there(self, failed: bool) -> None:
        kept = Obstructions()
        for t_s in (0.0, SHUTS_S):
            seen(kept, t_s, BODY)
        assert len(kept.shutting_xy_m) == 1
        seen(kept, SHUTS_S + 1.1 * KEPT_S, NOBODY, silent=BODY if failed else NOBODY)
        assert (len(kept.shutting_xy_m) == 1) is failed

    def test_is_taken_from_mates_and_not_told_on(self) -> None:
        kept = Obstructions()
        assert seen(kept, 0.0, NOBODY, told=BODY)
        assert len(kept.shutting_xy_m) == 1
        assert kept.told() == ()
        assert seen(kept, 1.1 * KEPT_S, NOBODY)


class TestPathsAround:
    def test_lead_through_the_other_door(self) -> None:
        roadmap = roadmap_of(DOOR_Y_M, 5.0)
        place = int(np.argmax(roadmap.places_xy_m[:, 0] - roadmap.places_xy_m[:, 1]))
        around = roadmap.around(np.array([[5.0, DOOR_Y_M]]), KEEP_M, (4.0, DOOR_Y_M), 0.9)
        way = around.way(4.0, DOOR_Y_M, around.time_s(place), 20.0)[:, :2]
        assert way[np.argmin(np.abs(way[:, 0] - 5.0)), 1] > 4.5
        straight = roadmap.way(4.0, DOOR_Y_M, roadmap.time_s(place), 20.0)[:, :2]
        assert straight[np.argmin(np.abs(straight[:, 0] - 5.0)), 1] < 1.5
        assert not any(around.is_cut_off(k) for k in range(len(around.places_xy_m)))

    def test_leave_out_what_is_behind_the_only_door(self) -> None:
        roadmap = roadmap_of(DOOR_Y_M)
        around = roadmap.around(np.array([[5.0, DOOR_Y_M]]), KEEP_M, (4.0, DOOR_Y_M), 0.9)
        behind = roadmap.places_xy_m[:, 0] > 6.0
        assert behind.any()
        assert [around.is_cut_off(int(k)) for k in np.flatnonzero(behind)] == [True] * int(behind.sum())
        assert not any(around.is_cut_off(int(k)) for k in np.flatnonzero(roadmap.places_xy_m[:, 0] < 4.0))
        assert around.time_s(int(np.argmax(behind))) is roadmap.time_s(int(np.argmax(behind)))

    def test_come_as_near_to_a_place_as_who_stands_on_it_allows(self) -> None:
        roadmap = roadmap_of(DOOR_Y_M, 5.0)
        place = 0
        x, y = roadmap.places_xy_m[place].tolist()
        around = roadmap.around(np.array([[x, y]]), KEEP_M, (x + 1.0 if x < 4.0 else x - 1.0, y), 0.9)
        row, column = np.unravel_index(int(np.argmin(around.time_s(place))), around.slowness.shape)
        x0, y0 = around.origin_xy_m
        away_m = math.hypot(x0 + column * around.spacing_m - x, y0 + row * around.spacing_m - y)
        assert KEEP_M <= away_m <= 0.9


@pytest.mark.parametrize("doors", [(DOOR_Y_M, 5.0), (DOOR_Y_M,)])
def test_a_mate_that_failed_in_a_door_keeps_nobody(doors: tuple[float, ...]) -> None:
    """They stood before it for good: the way to the next place led through that door."""
    experiment = build(mission_of(two_rooms(*doors), seed=1))
    run = run_loop(experiment)
    metrics = experiment.task.judge(run.finished).metrics
    assert metrics["collisions"] == 0
    task: Any = experiment.task
    idle_s = 120.0 - task._visits.last_s
    x = task.patrol.graph.vertices_xy_m[:, 0]
    assert np.count_nonzero(x < 4.0) >= 2
    assert idle_s[x < 4.0].max() < 40.0
    assert metrics["deadlocks"] == 0
    if len(doors) > 1:
        assert idle_s.max() < 40.0
