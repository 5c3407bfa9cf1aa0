"""The report's planning annex: coarse checks, first paths, and smoothed ones beside the report's."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.core.types import Goal, Pose2
from pilotage.evaluation.driving import smoothness
from pilotage.experiments.build.charts import load_chart
from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission
from pilotage.experiments.studies.study import load_study
from pilotage.kernels.rrt.clearance import curve_is_free
from pilotage.kernels.rrt.dubins import Curve
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap
from pilotage.stack.planning.driving_space import space_for
from pilotage.stack.planning.planner import PLANNERS, PlanRequest

FIRST = ["stack.planner.stop=first", "stack.planner.iterations=100000"]


def planned(seed: int, *overrides: str) -> dict[str, object]:
    """Metrics of one query."""
    return run_mission(load_mission("museum-plan", [*FIRST, *overrides], seed), save=False).metrics


@pytest.mark.parametrize("spacing_m", [0.1, 0.25, 0.5, 1.0])
def test_an_edge_is_checked_at_the_spacing_asked_for(spacing_m: float) -> None:
    """A straight of 3 m grazes a wall along it, which is seen where it is longer than the spacing."""
    seen = {}
    for longer in (1.1, 0.5):
        seen[longer] = 0
        for at in np.linspace(1.3, 3.7 - longer * spacing_m, 21):
            walls = np.array([[at, 1.0, at + longer * spacing_m, 1.0]])
            floor = SegmentMap(walls, np.zeros((0, 3)), (0.0, 0.0, 5.0, 2.0))
            space = space_for(DistanceField.from_map(floor), 0.05)
            straight = Curve(1.0, 1.049, 0.0, 0.5, 0, 0.0, 3.0, 0.0)
            assert not curve_is_free(straight, space, 0.05, 0.01)
            seen[longer] += not curve_is_free(straight, space, 0.05, spacing_m)
    assert seen[1.1] == 21
    assert seen[0.5] < 21


def test_validation_distance_changes_the_search_and_no_path_comes_too_near() -> None:
    lengths = set()
    for spacing in ("null", "0.1", "0.6", "1.0"):
        metrics = planned(1, f"stack.planner.validation_distance_m={spacing}")
        assert metrics["success"]
        assert metrics["planned_clearance_m"] >= 0.16 - 1e-6  # type: ignore[operator]
        lengths.add(round(float(metrics["first_length_m"]), 6))  # type: ignore[arg-type]
    assert len(lengths) > 1


def test_the_search_goes_on_where_an_edge_that_was_cut_leaves_it() -> None:
    """Round corners, coarse checks join edges that cut them; the search begins again where they are cut."""
    floor = load_chart("museum").walls
    field = DistanceField.from_map(floor)
    parameters = {"validation_distance_m": 0.5, "clearance_m": 0.46, "iterations": 5_000}
    planner = PLANNERS.entry("rrt-star-dubins").factory(
        PLANNERS.configure("rrt-star-dubins", parameters, "planner")
    )
    for seed in range(6):
        for start, goal in (
            (Pose2(1.0, 1.0, 0.0), Goal(2.0, 27.0)),
            (Pose2(2.0, 37.0, 0.0), Goal(37.0, 10.0)),
        ):
            request = PlanRequest(start, goal, field, np.random.default_rng(seed))
            assert planner.plan(request).path is not None


@pytest.mark.parametrize("cell", range(0, 31, 6))
def test_smoothed_first_paths_are_as_short_and_as_smooth_as_the_report_s(cell: int) -> None:
    """All 31 settings, 30 seeds each: study museum-planner-first."""
    found = load_study("museum-planner-first").cells[cell]
    each = [planned(seed, *found.overrides) for seed in (0, 1)]
    for key in ("planned_length_m", "smoothness"):
        mean = np.mean([float(metrics[key]) for metrics in each])  # type: ignore[arg-type]
        assert mean <= found.published[key]
    for metrics in each:
        assert metrics["first_length_m"] >= metrics["planned_length_m"]  # type: ignore[operator]
        assert metrics["first_smoothness"] >= 0.0  # type: ignore[operator]


def test_waypoints_stay_as_near_as_the_planner_connects() -> None:
    from pilotage.experiments.build.build import build

    mission = load_mission("museum-plan", [*FIRST, "stack.planner.max_connection_distance_m=0.75"], 3)
    (plan,) = build(mission).team[0].journal.plans
    away = np.hypot(*np.diff(plan.waypoints[:, :2], axis=0).T)
    assert away.max() <= 0.75 + 0.05
    assert plan.first_waypoints is not None
    assert np.hypot(*np.diff(plan.first_waypoints[:, :2], axis=0).T).max() <= 0.75 + 1e-9


@pytest.mark.parametrize("angle_rad", np.linspace(-3.1, 3.1, 9).tolist())
def test_a_straight_line_is_smooth_at_any_angle(angle_rad: float) -> None:
    """A page told 1.05e-18: rounding turns a little at every point."""
    ahead = np.array([np.cos(angle_rad), np.sin(angle_rad)])
    assert smoothness([3.7, -11.3] + np.linspace(0.0, 7.3, 60)[:, None] * ahead) == 0.0
    assert smoothness(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 1e-3]])) == pytest.approx(1e-6, rel=1e-3)
