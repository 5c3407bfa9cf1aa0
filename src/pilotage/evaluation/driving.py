"""How well one robot drove: errors, consistency, plan, clearance, recovery."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import BoolArray, FloatArray
from pilotage.evaluation.consistency import longest_outside_s, nees, nees_metrics, nis_metrics
from pilotage.evaluation.finished import FinishedRun, RobotRun
from pilotage.evaluation.pose_errors import pose_errors, rms
from pilotage.evaluation.shortest_path import ShortestPath, shortest_path
from pilotage.kernels.bodies.outline import least_along
from pilotage.maps.segment_map import SegmentMap
from pilotage.models.footprint import Footprint
from pilotage.stack.navigator.goal_config import Mode

WRONG_M, WRONG_RAD = 0.5, 0.1
"""On a floor, a pose farther from the truth than this is wrong."""
ASTRAY_M = 1.0
"""On a floor, an estimate that was this far off has lost track, though it may come back."""
MOST_CELLS = 4_000_000
MOST_SEGMENTS = 400
"""Beyond so many walls no exact shortest path is worked out: its tangent graph grows with their square."""


def poses(trace: Mapping[str, FloatArray], prefix: str) -> FloatArray:
    """(N, 3) x, y, theta of the columns that begin with ``prefix``."""
    return np.column_stack([trace[f"{prefix}_x_m"], trace[f"{prefix}_y_m"], trace[f"{prefix}_theta_rad"]])


def covariances(trace: Mapping[str, FloatArray]) -> FloatArray:
    """(N, 3, 3) covariances of the belief."""
    xx, xy, yy = trace["cov_xx_m2"], trace["cov_xy_m2"], trace["cov_yy_m2"]
    xt, yt, tt = trace["cov_xt_m_rad"], trace["cov_yt_m_rad"], trace["cov_tt_rad2"]
    return np.array([[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]]).transpose(2, 0, 1)


def claimed_at(trace: Mapping[str, FloatArray]) -> BoolArray:
    """(N,) at which steps the robot holds itself for localized; where it says nothing of it, it does."""
    if "localized" not in trace:
        return np.ones(len(trace["t_s"]), dtype=np.bool_)
    return np.asarray(~(trace["localized"] <= 0.5), dtype=np.bool_)


def header(run: FinishedRun, robot: RobotRun) -> dict[str, object]:
    """What every run's object begins with."""
    return {
        "mission": run.mission.mission,
        "seed": run.mission.run.seed,
        "success": False,
        "reason": run.ending or robot.reason or str(robot.status),
        "duration_s": run.duration_s,
        "steps": run.steps,
        "steps_per_s": run.steps / run.loop_s,
        **dict(robot.counts),
    }


def driving_metrics(run: FinishedRun, robot: RobotRun) -> tuple[dict[str, object], FloatArray]:
    """A robot's metrics whatever its task, and its (N,) NEES.

    Errors count after ``run.settle_s``, because the start error is drawn from the initial covariance, and
    while the robot holds itself for localized: an honest "lost" claims no pose. Lengths that tell right from
    wrong are those of floors: on open ground the belief's own ellipse alone does (``silently_wrong_s``).
    """
    trace, config = robot.trace, run.mission.run
    if trace["t_s"].shape[0] == 0:
        return {}, np.zeros(0)
    truth, estimate = poses(trace, "true"), poses(trace, "est")
    values = nees(truth, estimate, covariances(trace))
    counted = _counted(config.settle_s, trace)
    metrics: dict[str, object] = {
        "collisions": robot.collisions,
        "min_clearance_m": float(trace["clearance_m"].min()),
        "path_length_m": robot.driven_m,
    }
    met = robot.encounters
    if met is not None:
        metrics |= {
            "people_collisions": met.collisions,
            "people_touches": met.touches,
            "people_near_share": met.near_share,
        }
        if np.isfinite(met.closest_m):
            metrics["people_closest_m"] = met.closest_m
    metrics |= pose_errors(truth, estimate, counted).metrics()
    if not run.chart.open_ground:
        astray = np.flatnonzero(pose_errors(truth, estimate).distance_m > ASTRAY_M)
        metrics["tracked_s"] = float(trace["t_s"][astray[0] if astray.size else -1])
    # Where nothing is solid, everywhere is open and no place narrow.
    if counted.any() and np.isfinite(trace["clearance_m"]).any():
        metrics |= split_errors(trace, pose_errors(truth, estimate).distance_m, counted)
    metrics |= _consistency(trace, values, counted)
    claimed = claimed_at(trace)
    metrics["silently_wrong_s"] = longest_outside_s(
        trace["t_s"], truth, estimate, covariances(trace), claimed
    )
    return metrics | _recovery(run, robot, truth, estimate), values


def shortest_for(run: FinishedRun, robot: RobotRun) -> ShortestPath | None:
    """Exact shortest path between the ends of the first plan; None where there is nothing to compare.

    The plan begins where the robot believed to be: from elsewhere the shortest path could be the longer one.
    """
    plans = robot.plans
    if not plans or plans[0].given or not robot.stack.initial.known:
        return None
    if run.chart.geometry is None and run.chart.grid is not None and run.chart.grid.cells.size > MOST_CELLS:
        return None
    if run.chart.walls.segments_m.shape[0] > MOST_SEGMENTS:
        return None
    (x0, y0), (x1, y1) = plans[0].states[0, :2].tolist(), plans[0].states[-1, :2].tolist()
    kept_m = plans[0].clearance_m + plans[0].disc_radius_m
    return shortest_path(run.chart.walls, (x0, y0), (x1, y1), kept_m)


def planning_metrics(run: FinishedRun, robot: RobotRun, shortest: ShortestPath | None) -> dict[str, object]:
    """Length, quality and times of the first plan, beside the shortest path at the same clearance."""
    if not robot.plans:
        return {}
    plan = robot.plans[0]
    metrics: dict[str, object] = {
        "planned_length_m": plan.length_m,
        "planning_time_s": plan.planning_time_s,
        "first_solution_s": plan.first_solution_s,
        "planned_clearance_m": clearance_m(plan.states, run.chart.walls, robot.footprint),
        "smoothness": smoothness(plan.waypoints[:, :2]),
    }
    if plan.first_waypoints is not None:
        metrics["first_length_m"] = plan.first_length_m
        metrics["first_smoothness"] = smoothness(plan.first_waypoints[:, :2])
    if shortest is not None:
        metrics["shortest_length_m"] = shortest.length_m
    return metrics


def _counted(settle_s: float, trace: Mapping[str, FloatArray]) -> BoolArray:
    """(N,) at which steps errors count."""
    counted = trace["t_s"] > settle_s
    counted &= claimed_at(trace)
    return np.asarray(counted, dtype=np.bool_)


def _consistency(
    trace: Mapping[str, FloatArray], values: FloatArray, counted: BoolArray
) -> dict[str, object]:
    """NEES, NIS and the share of readings that the filter accepted, over the steps that count."""
    metrics = nees_metrics(values[counted])
    if "nis" not in trace:
        return metrics
    metrics |= nis_metrics(trace["nis"][counted], trace["nis_expected"][counted])
    for what in ("beacons", "lines"):
        seen = trace[f"{what}_seen"][counted].sum() if f"{what}_seen" in trace else 0.0
        if seen > 0.0:
            metrics["accepted_fraction"] = float(trace[f"{what}_accepted"][counted].sum() / seen)
    return metrics


def _recovery(
    run: FinishedRun, robot: RobotRun, truth: FloatArray, estimate: FloatArray
) -> dict[str, object]:
    """How long a robot that can be lost was lost, and how long it was wrong without knowing."""
    trace, known = robot.trace, robot.stack.initial.known
    if "localized" not in trace:
        return {}
    claimed, dt_s = claimed_at(trace), run.mission.run.dt_s
    on_floor = not run.chart.open_ground
    error = estimate - truth
    wrong = np.hypot(error[:, 0], error[:, 1]) > WRONG_M
    wrong |= np.abs(wrap_array_to_pi(error[:, 2])) > WRONG_RAD
    # One that never says so although it is wrong is the worst case of all.
    wrong_for_good = wrong & (trace["t_s"] > run.mission.run.settle_s)
    if claimed.all() and known and not (on_floor and wrong_for_good.any()):
        return {}
    metrics: dict[str, object] = {"lost_s": float(dt_s * (~claimed).sum())}
    if on_floor:
        metrics["wrong_s"] = float(dt_s * (claimed & wrong).sum())
    found = np.flatnonzero(claimed & ~np.concatenate([[known], claimed[:-1]]))
    if found.size:
        since = np.flatnonzero(claimed[: found[-1]])
        begin = float(trace["t_s"][since[-1]]) if since.size else 0.0
        metrics["found_after_s"] = float(trace["t_s"][found[-1]]) - begin
    return metrics


NARROW_M = 0.5
"""Ground is narrow where anything solid is nearer to the body's edge than this."""
REACTIVE = (Mode.LATERAL, Mode.AVOID, Mode.ESCAPE)
"""Modes in which something other than the path follower drives."""


def split_errors(
    trace: Mapping[str, FloatArray], distance_m: FloatArray, counted: BoolArray
) -> dict[str, object]:
    """Position RMSE by what drives the robot and by the room around it (night-watch report 5.1).

    Parameters
    ----------
    distance_m
        (N,) distance of the estimate from the truth at each step.
    counted
        (N,) which steps count.

    Returns
    -------
    ``position_rmse_narrow_m``, ``position_rmse_open_m`` and, where the navigator tells what it does,
    ``position_rmse_reactive_m``, ``position_rmse_following_m``; each only where a step counts for it.
    """
    narrow = trace["clearance_m"] < NARROW_M
    parts = {"narrow": narrow, "open": ~narrow}
    if "mode" in trace:
        reactive = np.isin(trace["mode"], [float(mode) for mode in REACTIVE])
        parts |= {"reactive": reactive, "following": trace["mode"] == float(Mode.FOLLOW)}
    out: dict[str, object] = {}
    for name, part in parts.items():
        chosen = distance_m[counted & part]
        if chosen.size:
            out[f"position_rmse_{name}_m"] = rms(chosen)
    return out


CHECK_M = 0.01
ROUNDING_RAD = 1e-8
"""Turns below this are rounding's own: of a straight line's points none is."""


def smoothness(points_xy_m: FloatArray) -> float:
    """Sum over the inner points of (2 (pi - angle) / (a + b))^2; 0 for a straight line.

    ``angle`` lies between the segments of lengths a and b that meet at a point (the night-watch report's
    third metric). Points that coincide with the one before are left out.
    """
    moved = np.ones(len(points_xy_m), dtype=np.bool_)
    moved[1:] = np.hypot(*np.diff(points_xy_m, axis=0).T) > 0.0
    points = points_xy_m[moved]
    if len(points) < 3:
        return 0.0
    steps = np.diff(points, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    directions = np.arctan2(steps[:, 1], steps[:, 0])
    turns = np.abs((np.diff(directions) + math.pi) % (2.0 * math.pi) - math.pi)  # pi - angle
    turns[turns < ROUNDING_RAD] = 0.0
    return float(np.sum((2.0 * turns / (lengths[:-1] + lengths[1:])) ** 2))


def clearance_m(states: FloatArray, walls: SegmentMap, body: Footprint) -> float:
    """Least distance of the body's edge from the walls along a path, looked at every centimetre.

    Between two states (x, y, theta) the heading turns evenly.
    """
    lengths = np.hypot(*np.diff(states[:, :2], axis=0).T)
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    count = max(2, math.ceil(float(s[-1]) / CHECK_M) + 1)
    at = np.linspace(0.0, float(s[-1]), count)
    columns = states[:, 0], states[:, 1], np.unwrap(states[:, 2])
    fine = np.column_stack([np.interp(at, s, column) for column in columns])
    both = np.ascontiguousarray(np.vstack([fine, states[:, :3]]))
    return float(least_along(both, body.outline, walls.segments_m, walls.circles_m))
