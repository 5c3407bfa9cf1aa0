"""Several goals: the best order along paths that lead around walls, visited truly, told on the page."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import Goal, Pose2
from pilotage.experiments.build.build import build
from pilotage.experiments.build.charts import chart_of
from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission
from pilotage.maps.floor import Floor
from pilotage.report.page import write_report
from pilotage.report.rounds import rounds_section
from pilotage.stack.patrol.derive import _grown
from pilotage.stack.planning.rounds import best_rounds

MUSEUM = chart_of(load_mission("museum-1").world)


def test_the_best_order_goes_around_walls_and_not_through_them() -> None:
    """Two rooms with a wall of 10 m between: as the crow flies they are neighbours."""
    places = (Goal(2.5, 14.0), Goal(2.5, 16.0), Goal(6.25, 13.5), Goal(5.0, 16.5))
    found = best_rounds(MUSEUM, Pose2(2.5, 10.0, 0.0), places, False, 0.46, np.random.default_rng(0))
    points = np.array([(2.5, 10.0), *((place.x_m, place.y_m) for place in places)])
    floor = Floor.of(MUSEUM, 0.46, inside_xy_m=(2.5, 10.0))
    lengths = floor.lengths_m(points, np.ones((5, 5), np.bool_))

    def along(order: tuple[int, ...]) -> float:
        return float(sum(lengths[a, b] for a, b in itertools.pairwise((0, *(k + 1 for k in order)))))

    best = min(map(along, itertools.permutations(range(4))))
    assert found.length_m == pytest.approx(best) == along(found.order)
    assert found.bound_m == found.length_m
    assert found.given_m == pytest.approx(along((0, 1, 2, 3)))
    assert set(found.order[:2]) == {0, 2}, "both in the room first, then both in the hall"
    assert lengths[1, 2] > 10.0 * np.hypot(*(points[1] - points[2]))


def test_rounds_may_end_where_they_are_told_and_begin_anywhere() -> None:
    places = (Goal(1.0, 1.0), Goal(10.0, 3.0), Goal(20.0, 3.0))
    rng = np.random.default_rng(0)
    back = best_rounds(MUSEUM, Pose2(5.0, 1.0, 0.0), places, True, 0.46, rng)
    assert back.order[-1] == 2
    lost = best_rounds(MUSEUM, None, places, False, 0.46, rng)
    assert lost.order in ((0, 1, 2), (2, 1, 0))


def test_every_room_of_the_museum_is_visited(tmp_path: Path) -> None:
    """The whole rounds, seed 1; a room is what is left of the floor where passages below 2.6 m are closed."""
    mission = load_mission("museum-rounds", [], 1)
    result = run_mission(mission, out=tmp_path)
    metrics = result.metrics
    assert metrics["success"], metrics["reason"]
    assert metrics["goals_visited"] == metrics["goals_given"] == 24
    times = metrics["goals_reached_at_s"]
    assert isinstance(times, list)
    assert times == sorted(times)
    bound, length, given = (float(metrics[f"rounds_{k}_m"]) for k in ("bound", "length", "given"))  # type: ignore[arg-type]
    assert bound <= length < 0.8 * given
    gap = float(metrics["rounds_gap"])  # type: ignore[arg-type]
    assert gap == pytest.approx(length / bound - 1.0)
    assert gap <= 0.05
    floor = Floor.of(MUSEUM, 0.3, inside_xy_m=(1.0, 1.0))
    from scipy import ndimage

    for width_m, rooms in ((2.6, 21), (4.4, 15)):
        labels, count = ndimage.label(floor.reachable & (floor.clearance_m >= 0.5 * width_m))
        assert count == rooms
        grown = _grown(floor, labels.astype(np.int64))
        visited = {int(grown[floor.cell_of(np.array(place))]) for place in metrics["goals_m"]}  # type: ignore[attr-defined]
        assert visited == set(range(1, rooms + 1))
    assert result.run_dir is not None
    page = write_report(result.run_dir).read_text(encoding="utf-8")
    assert 'id="rounds"' in page
    assert "24 of 24 goals visited" in page.replace("\u00a0", " ").replace("&nbsp;", " ")
    assert 'id="plan-picture"' in page


def goals(*places: tuple[float, float, float]) -> str:
    """As ``--set`` takes them: x, y, tolerance."""
    return "task.goals=[" + ", ".join(f"{{x_m: {x}, y_m: {y}, tolerance_m: {t}}}" for x, y, t in places) + "]"


def test_a_goal_that_was_not_truly_visited_fails_the_task() -> None:
    overrides = ["world.obstacles=[]", "world.goal={x_m: 3.0, y_m: 1.2}", "run.time_limit_s=120"]
    near = run_mission(
        load_mission("museum-1", [*overrides, goals((2.0, 3.0, 0.3), (2.0, 5.5, 0.3))], 0), save=False
    )
    assert near.success, near.metrics["reason"]
    assert near.metrics["goals_visited"] == 3
    # By its wheels alone it is half a metre off.
    wheels = [*overrides, "stack.localizer={name: dead-reckoning}"]
    far = run_mission(
        load_mission("museum-1", [*wheels, goals((2.0, 3.0, 0.1), (2.0, 5.5, 2.0))], 2), save=False
    )
    assert not far.success
    assert far.metrics["goals_visited"] == 0
    assert str(far.metrics["reason"]).startswith("the robot says it arrived, but came not within ")


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ([goals((2.5, 2.5, 0.3), (5.0, 5.0, 0.3)), "task.order=best"], "task 'reach', goal 1"),
        ([goals((30.0, 35.0, 0.3)), "task.order=best"], "goal"),
        ([goals((2.5, 2.5, 0.3)), "task.order=best", "task.ends_there=true"], "task.ends_there"),
        ([goals((2.5, 2.5, 0.3)), "task.order=shortest"], "task.order"),
    ],
)
def test_goals_that_cannot_be_are_refused(overrides: list[str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        build(load_mission("museum-1", ["world.obstacles=[]", *overrides]))


@pytest.mark.parametrize("metrics", [{}, {"goals_m": [[1, 2]], "goals_reached_at_s": [1.0]}, {"goals_m": 3}])
def test_a_run_without_rounds_has_no_section(metrics: dict[str, Any]) -> None:
    assert rounds_section(metrics).html == ""


def test_damaged_rounds_leave_gaps() -> None:
    made = rounds_section({"goals_m": [[1, 2], "x", [3]], "goals_reached_at_s": [5.0, None]}).html
    assert made.count("not reached") == 2
