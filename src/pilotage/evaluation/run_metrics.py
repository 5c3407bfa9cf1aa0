"""The metrics of one run, from its trace; their keys are the JSON keys of the command line."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import BoolArray, FloatArray
from pilotage.evaluation.consistency import nees, nees_metrics, nis_metrics
from pilotage.evaluation.halls import hall_offset_m
from pilotage.evaluation.plan_quality import clearance_m, smoothness
from pilotage.evaluation.pose_errors import pose_errors
from pilotage.evaluation.shortest_path import ShortestPath, shortest_path
from pilotage.evaluation.split_errors import split_errors
from pilotage.maps.segment_map import SegmentMap
from pilotage.missions.floor import FloorMission
from pilotage.stack.interface import PlannedPath

WRONG_M, WRONG_RAD = 0.5, 0.1
"""A pose farther from the truth than this is wrong."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a run ended, as seen from outside.

    Attributes
    ----------
    loop_s
        Wall time of the control steps, planning apart.
    shortest
        Exact shortest path at the first plan's clearance; None for a prescribed route.
    counts
        What the stack counted: attempts, replans, escapes.
    """

    arrived: bool
    reason: str
    loop_s: float
    plans: Sequence[PlannedPath]
    shortest: ShortestPath | None
    counts: Mapping[str, int]


def shortest_for(
    mission: FloorMission, plans: Sequence[PlannedPath], floor: SegmentMap
) -> ShortestPath | None:
    """Exact shortest path to hold against the first plan; None where there is nothing to compare."""
    goal, start = mission.world.goal, mission.world.start
    if goal is None or not plans or plans[0].given or not mission.stack.initial.known:
        return None
    return shortest_path(floor, (start.x_m, start.y_m), (goal.x_m, goal.y_m), plans[0].clearance_m)


def poses(trace: Mapping[str, FloatArray], prefix: str) -> FloatArray:
    """(N, 3) x, y, theta of the columns that begin with ``prefix``."""
    return np.column_stack([trace[f"{prefix}_x_m"], trace[f"{prefix}_y_m"], trace[f"{prefix}_theta_rad"]])


def covariances(trace: Mapping[str, FloatArray]) -> FloatArray:
    """(N, 3, 3) covariances of the belief."""
    xx, xy, yy = trace["cov_xx_m2"], trace["cov_xy_m2"], trace["cov_yy_m2"]
    xt, yt, tt = trace["cov_xt_m_rad"], trace["cov_yt_m_rad"], trace["cov_tt_rad2"]
    return np.array([[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]]).transpose(2, 0, 1)


def run_metrics(
    mission: FloorMission, trace: Mapping[str, FloatArray], outcome: Outcome, floor: SegmentMap
) -> tuple[dict[str, object], FloatArray]:
    """Compute a run's metrics, and its (N,) NEES.

    Errors count after ``run.settle_s``, because the start error is drawn from the initial covariance, and
    while the robot holds itself for localized: an honest "lost" claims no pose.
    """
    steps = trace["t_s"].shape[0]
    metrics: dict[str, object] = {
        "mission": mission.mission,
        "seed": mission.run.seed,
        "success": False,
        "reason": outcome.reason,
        "duration_s": float(trace["t_s"][-1]) if steps else 0.0,
        "steps": steps,
        "steps_per_s": steps / outcome.loop_s,
        **dict(outcome.counts),
    }
    metrics |= _planning(outcome, floor, mission.robot.body.radius_m)
    if steps == 0:
        return metrics, np.zeros(0)
    truth, estimate = poses(trace, "true"), poses(trace, "est")
    values = nees(truth, estimate, covariances(trace))
    collisions = int(trace["collisions"][-1])
    metrics["collisions"] = collisions
    metrics["min_clearance_m"] = float(trace["clearance_m"].min())
    driven = np.hypot(*np.diff(truth[:, :2], axis=0).T)
    # A robot that was carried did not drive there.
    carried = driven > 2.0 * mission.robot.motion.max_speed_m_s * mission.run.dt_s
    metrics["path_length_m"] = float(driven[~carried].sum())
    metrics |= _errors(mission, trace, truth, estimate)
    metrics |= _consistency(mission, trace, values)
    metrics |= _recovery(mission, trace, truth, estimate)
    metrics["hall_offset_m"] = hall_offset_m(truth, floor)
    goal = mission.world.goal
    if goal is None:
        metrics["success"] = outcome.arrived and collisions == 0
        return metrics, values
    goal_error = math.hypot(truth[-1, 0] - goal.x_m, truth[-1, 1] - goal.y_m)
    metrics["goal_error_m"] = goal_error
    reached = goal_error <= goal.tolerance_m
    # Without a controller nobody drives: a plan is all that is asked for.
    drives = mission.stack.controller is not None
    metrics["success"] = outcome.arrived and collisions == 0 and (reached or not drives)
    if drives and outcome.arrived and not reached:
        metrics["reason"] = f"the robot says it arrived, but stands {goal_error:.2f} m from its goal"
    return metrics, values


def _planning(outcome: Outcome, floor: SegmentMap, body_radius_m: float) -> dict[str, object]:
    """Length, quality and times of the first plan, beside the shortest path at the same clearance."""
    if not outcome.plans:
        return {}
    plan = outcome.plans[0]
    metrics: dict[str, object] = {
        "planned_length_m": plan.length_m,
        "planning_time_s": plan.planning_time_s,
        "first_solution_s": plan.first_solution_s,
        "planned_clearance_m": clearance_m(plan.states, floor, body_radius_m),
        "smoothness": smoothness(plan.waypoints[:, :2]),
    }
    if outcome.shortest is not None:
        metrics["shortest_length_m"] = outcome.shortest.length_m
    return metrics


def _counted(mission: FloorMission, trace: Mapping[str, FloatArray]) -> BoolArray:
    """(N,) at which steps errors count."""
    counted = trace["t_s"] > mission.run.settle_s
    if "localized" in trace:
        counted &= trace["localized"] > 0.5
    return counted


def _recovery(
    mission: FloorMission, trace: Mapping[str, FloatArray], truth: FloatArray, estimate: FloatArray
) -> dict[str, object]:
    """How long a robot that can be lost was lost, and how long it was wrong without knowing."""
    if "localized" not in trace:
        return {}
    claimed, dt_s = trace["localized"] > 0.5, mission.run.dt_s
    error = estimate - truth
    wrong = np.hypot(error[:, 0], error[:, 1]) > WRONG_M
    wrong |= np.abs(wrap_array_to_pi(error[:, 2])) > WRONG_RAD
    # One that never says so although it is wrong is the worst case of all.
    wrong_for_good = wrong & (trace["t_s"] > mission.run.settle_s)
    if claimed.all() and mission.stack.initial.known and not wrong_for_good.any():
        return {}
    metrics: dict[str, object] = {
        "lost_s": float(dt_s * (~claimed).sum()),
        "wrong_s": float(dt_s * (claimed & wrong).sum()),
    }
    found = np.flatnonzero(claimed & ~np.concatenate([[mission.stack.initial.known], claimed[:-1]]))
    if found.size:
        since = np.flatnonzero(claimed[: found[-1]])
        begin = float(trace["t_s"][since[-1]]) if since.size else 0.0
        metrics["found_after_s"] = float(trace["t_s"][found[-1]]) - begin
    return metrics


def _errors(
    mission: FloorMission, trace: Mapping[str, FloatArray], truth: FloatArray, estimate: FloatArray
) -> dict[str, object]:
    counted = _counted(mission, trace)
    metrics = pose_errors(truth, estimate, counted).metrics()
    if not counted.any():
        return metrics
    return metrics | split_errors(trace, pose_errors(truth, estimate).distance_m, counted)


def _consistency(
    mission: FloorMission, trace: Mapping[str, FloatArray], values: FloatArray
) -> dict[str, object]:
    """NEES, NIS and the share of readings that the filter accepted, over the steps that count."""
    counted = _counted(mission, trace)
    metrics = nees_metrics(values[counted])
    if "nis" not in trace:
        return metrics
    metrics |= nis_metrics(trace["nis"][counted], trace["nis_expected"][counted])
    for what in ("beacons", "lines"):
        seen = trace[f"{what}_seen"][counted].sum() if f"{what}_seen" in trace else 0.0
        if seen > 0.0:
            metrics["accepted_fraction"] = float(trace[f"{what}_accepted"][counted].sum() / seen)
    return metrics
