"""What a run says of itself is what it seems to say: NEES, halls, shortest paths, traps, plans."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.evaluation.consistency import nees
from pilotage.evaluation.halls import hall_offset_m
from pilotage.experiments.build.obstacles import _leads_in
from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission
from pilotage.maps.segment_map import SegmentMap
from pilotage.report.headline import headline

HALL = SegmentMap(
    np.array(
        [[0.0, 0.0, 20.0, 0.0], [0.0, 20.0, 20.0, 20.0], [5.0, 9.0, 15.0, 9.0], [5.0, 10.5, 15.0, 10.5]]
    ),
    np.zeros((0, 3)),
    (0.0, 0.0, 20.0, 20.0),
)


def along(y_m: float, theta_rad: float, x0: float = 2.0, x1: float = 18.0) -> FloatArray:
    """(N, 3) poses from x0 to x1 at one height."""
    x = np.arange(x0, x1, 0.05)
    return np.column_stack([x, np.full_like(x, y_m), np.full_like(x, theta_rad)])


def test_a_covariance_of_two_ranks_gives_no_nees() -> None:
    """After one step from a known start: forward and turned, and what follows from them sideways."""
    for theta in np.linspace(-3.0, 3.0, 25):
        G = np.array(
            [[math.cos(theta), -0.05 * math.sin(theta)], [math.sin(theta), 0.05 * math.cos(theta)], [0, 1]]
        )
        cov = G @ np.diag([1.3e-5, 1.0e-7]) @ G.T
        error = np.array([[1e-3, 2e-3, 1e-4]])
        assert np.isnan(nees(error, np.zeros((1, 3)), cov[None])[0])
        # With what every later step adds it is regular, however small.
        told = nees(error, np.zeros((1, 3)), (cov + 1e-10 * np.eye(3))[None])[0]
        assert math.isfinite(told)
    same = nees(np.ones((1, 3)), np.zeros((1, 3)), np.diag([1e-14, 1.0, 1e6])[None])[0]
    assert same == pytest.approx(1e14, rel=1e-9)


@pytest.mark.parametrize("theta", [0.0, 0.25, -0.3, math.pi])
def test_a_hall_is_measured_inside(theta: float) -> None:
    assert hall_offset_m(along(9.75, theta), HALL) == pytest.approx(0.0, abs=2e-3)
    assert hall_offset_m(along(9.95, theta), HALL) == pytest.approx(0.2, abs=5e-3)
    assert hall_offset_m(along(9.75, theta, x1=5.5), HALL) is None  # not yet inside
    assert hall_offset_m(along(15.0, theta), HALL) is None


def test_turning_out_of_a_hall_is_not_measured() -> None:
    path = along(9.75, 0.0)
    path[path[:, 0] > 14.2, 1] = 10.1  # at its mouth, a metre before its end
    assert hall_offset_m(path, HALL) == pytest.approx(0.0, abs=2e-3)
    path[path[:, 0] > 13.0, 1] = 10.1
    assert hall_offset_m(path, HALL) == pytest.approx(0.35, abs=5e-3)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_no_plan_is_shorter_than_the_shortest_path(seed: int) -> None:
    """The plan starts from the belief, tens of centimetres off here, and so does what it is held against."""
    mission = load_mission("museum-2", ["run.time_limit_s=0.5", "stack.initial.x_var_m2=0.05"], seed)
    metrics = run_mission(mission, save=False).metrics
    assert metrics["planned_length_m"] >= metrics["shortest_length_m"] - 1e-6  # type: ignore[operator]


def test_a_trap_that_the_plan_leads_into_is_entered_and_left() -> None:
    metrics = run_mission(load_mission("museum-trap", [], 2), save=False).metrics
    assert metrics["success"], metrics["reason"]
    assert (metrics["traps_entered"], metrics["traps_avoided"]) == (1, 0)


def test_a_run_that_ends_before_the_trap_has_not_entered_it() -> None:
    metrics = run_mission(load_mission("museum-trap", ["run.time_limit_s=1"], 2), save=False).metrics
    assert (metrics["traps_entered"], metrics["traps_avoided"]) == (0, 1)


def test_a_plan_that_nobody_drives_says_so() -> None:
    metrics = run_mission(load_mission("museum-plan", ["stack.planner.stop=first"], 0), save=False).metrics
    assert "goal_error_m" not in metrics
    assert headline(metrics).startswith("Planned, and nobody drove: a path of ")


def test_a_head_on_trap_is_refused_where_the_path_turns_into_it() -> None:
    """A pocket of 3 m by 2 m with its back at x = 10; the path comes straight in, or from the side."""
    pocket = np.array([[8.0, -1.5], [10.0, -1.5], [10.0, 1.5], [8.0, 1.5]])
    straight = along(0.0, 0.0, 0.0, 10.0)
    assert _leads_in(straight, pocket, 0.3)
    assert _leads_in(along(0.9, 0.0, 0.0, 10.0), pocket, 0.3)
    assert not _leads_in(along(1.1, 0.0, 0.0, 10.0), pocket, 0.3), "too near a side for the body"
    from_the_side = straight.copy()
    from_the_side[straight[:, 0] < 8.5, 1] = 8.5 - straight[straight[:, 0] < 8.5, 0]
    assert not _leads_in(from_the_side, pocket, 0.3)
    assert not _leads_in(straight[straight[:, 0] > 7.5], pocket, 0.3), "it begins at the mouth"
