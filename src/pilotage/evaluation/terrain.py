"""How well a rover drove over terrain: hazards, heights along its path, and what it believed on it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.evaluation.driving import covariances, poses
from pilotage.evaluation.finished import FinishedRun, RobotRun
from pilotage.evaluation.position_region import bent_regions, squared_off
from pilotage.evaluation.relief import relief
from pilotage.kernels.grids.blocked_distance import distance_to_blocked
from pilotage.maps.occupancy_grid import OccupancyGrid, squared_distances
from pilotage.maps.world_map import WorldMap
from pilotage.models.motion.bicycle import BicycleConfig

CLEARANCE_REACH_CELLS = 200
"""Farther from hazards than this is not measured."""
NEAR_CELLS = 3.0
"""Points no farther than this beyond the nearest are measured exactly."""


def terrain_columns(run: FinishedRun, robot: RobotRun) -> dict[str, FloatArray]:
    """What is worked out for every row of a rover's trace: path, hazards, heights, uncertainty."""
    trace, chart = robot.trace, run.chart
    points = poses(trace, "true")[:, :2]
    if len(points) == 0 or chart.grid is None:
        return {}
    start = np.array([[robot.start.x_m, robot.start.y_m]])
    steps = np.hypot(*np.diff(np.vstack([start, points]), axis=0).T)
    columns = {
        "distance_m": np.cumsum(steps),
        "hazard_distance_m": if_any_is_near(hazard_distance_m(points, chart.grid), chart.grid),
    }
    if chart.elevation is not None:
        columns["elevation_m"] = chart.elevation.heights_at(points)
        cells = chart.grid.cells_at(points)
        on = ~off_grid(cells, chart.grid)  # a rover may leave the map
        columns["slope_rad"] = np.full(len(points), math.nan)
        columns["slope_rad"][on] = chart.elevation.slopes_at(cells[on])
    if isinstance(robot.motion, BicycleConfig):
        columns["steering_rad"] = steering_rad(trace, robot.motion.wheelbase_m)
    return columns | {"root_determinant_m2": root_determinant(covariances(trace))}


def steering_rad(trace: Mapping[str, FloatArray], wheelbase_m: float) -> FloatArray:
    """(N,) steering angle that a bicycle drove with, tan(gamma) = L w / v; nan where it stood still."""
    speed, rate = trace["v_true_m_s"], trace["w_true_rad_s"]
    moves = speed != 0.0
    found = np.full(len(speed), math.nan)
    found[moves] = np.arctan(wheelbase_m * rate[moves] / speed[moves])
    return found


def terrain_metrics(
    run: FinishedRun, robot: RobotRun, columns: Mapping[str, FloatArray]
) -> dict[str, object]:
    """The numbers of a path over terrain by their JSON keys."""
    trace, chart = robot.trace, run.chart
    truth = poses(trace, "true")
    if not columns:
        return {}
    away = columns["hazard_distance_m"]
    metrics: dict[str, object] = {
        "hazard_contacts": int(np.count_nonzero(on_hazard(truth, chart))),
        "min_clearance_m": float(np.nanmin(away)) if np.isfinite(away).any() else math.nan,
        "end": {"x_m": truth[-1, 0], "y_m": truth[-1, 1], "theta_rad": truth[-1, 2]},
    }
    if chart.elevation is not None and len(truth) > 1:
        profile = relief(chart.elevation, truth[:, :2])
        metrics |= {"climb_m": profile.climb_m, "descent_m": profile.descent_m}
    if robot.stack.localizer is None:
        return metrics
    estimate, covs = poses(trace, "est"), covariances(trace)
    error = estimate[-1] - truth[-1]
    metrics["final_position_error_m"] = float(math.hypot(error[0], error[1]))
    off = squared_off((truth - estimate)[:, :2], covs, bent_regions(trace))
    inside = off <= chi_square_quantile(run.mission.run.ellipse_probability, 2)
    metrics["ellipse_coverage"] = float(inside.mean())
    metrics["final_in_ellipse"] = bool(inside[-1])
    metrics["final_believed_error_m"] = float(math.sqrt(covs[-1, 0, 0] + covs[-1, 1, 1]))
    # Not a number where nobody listened: before the first reading, and where the truth stood in.
    seen = np.nan_to_num(trace.get("beacons_seen", np.zeros(len(truth)))).astype(np.int64)
    step_m = np.diff(np.concatenate([[0.0], columns["distance_m"]]))
    metrics["blind_stretches"] = len(stretches_without(seen, step_m))
    if "beacons_seen" in trace:
        metrics["sightings"] = int(seen.sum())
    return metrics


def off_grid(cells: IntArray, grid: OccupancyGrid) -> BoolArray:
    """(N,) whether cells (N, 2), as ``cells_at`` tells them, are none of the grid's."""
    return np.asarray((cells < 0).any(axis=1) | (cells[:, 0] >= grid.rows) | (cells[:, 1] >= grid.columns))


def on_hazard(truth: FloatArray, chart: WorldMap) -> BoolArray:
    """(N,) whether (N, 3) poses lie on a hazard or off the ground."""
    grid = chart.grid
    if grid is None:
        return np.zeros(len(truth), dtype=bool)
    cells = grid.cells_at(truth[:, :2])
    off = off_grid(cells, grid)
    off[~off] = grid.blocked()[cells[~off, 0], cells[~off, 1]]
    return off


def why_on_hazard(robot: RobotRun, chart: WorldMap) -> str:
    """How far from its place a robot took itself to be while it stood on hazards."""
    truth = poses(robot.trace, "true")
    there = on_hazard(truth, chart)
    told = f"{np.count_nonzero(there)} of {len(there)} steps end on a hazard"
    if robot.stack.localizer is None:
        return told
    off = (truth - poses(robot.trace, "est"))[there, :2]
    return f"{told}, where the robot took itself to be up to {np.hypot(*off.T).max():.2f} m from its place"


def hazard_distance_m(points_xy_m: FloatArray, grid: OccupancyGrid) -> FloatArray:
    """(N,) distance of points on the grid from the nearest hazard's edge; exact where it is least.

    Farther off by the distance of the cells' middles, less half a cell's diagonal: tens of thousands of exact
    distances would take seconds. More than ``CLEARANCE_REACH_CELLS`` cells are not measured.
    """
    blocked, reach = grid.blocked(), CLEARANCE_REACH_CELLS
    cells = grid.cells_at(points_xy_m)
    rows = np.clip(cells[:, 0], 0, grid.rows - 1)
    columns = np.clip(cells[:, 1], 0, grid.columns - 1)
    # No hazard farther than the reach counts: only the ground around the path is looked at.
    top, left = max(int(rows.min()) - reach, 0), max(int(columns.min()) - reach, 0)
    around = np.ascontiguousarray(
        blocked[top : int(rows.max()) + reach + 1, left : int(columns.max()) + reach + 1]
    )
    if not around.any():
        return np.full(len(points_xy_m), reach * grid.resolution_m)
    between = np.sqrt(squared_distances(around)[rows - top, columns - left].astype(np.float64))
    away = np.clip(between - math.sqrt(0.5), 0.0, float(reach))
    near = between <= between.min() + NEAR_CELLS
    places = grid.places_at(points_xy_m[near])
    away[near] = distance_to_blocked(places, blocked, min(math.ceil(between[near].max()) + 1, reach))
    return away * grid.resolution_m


def if_any_is_near(away_m: FloatArray, grid: OccupancyGrid) -> FloatArray:
    """(N,) distances from hazards; all nan where none is within reach: how far they are nobody measured."""
    near = away_m < CLEARANCE_REACH_CELLS * grid.resolution_m
    return away_m if near.any() else np.full(len(away_m), math.nan)


STRETCH_M = 1000.0
"""A way of this length without a landmark is a stretch to get over."""


def stretches_without(seen: IntArray, step_m: FloatArray) -> list[tuple[int, int]]:
    """Ways of more than ``STRETCH_M`` without a sighting: (first, last) step of each."""
    blind = np.concatenate([[False], seen == 0, [False]])
    edges = np.flatnonzero(np.diff(blind.astype(np.int8)))
    driven_m = np.concatenate([[0.0], np.cumsum(step_m)])
    pairs = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    return [(a, b - 1) for a, b in pairs if driven_m[b] - driven_m[a] > STRETCH_M]


def root_determinant(covs: FloatArray) -> FloatArray:
    """(T,) square root of the determinant of the position's covariance, in m^2."""
    return np.sqrt(np.maximum(covs[:, 0, 0] * covs[:, 1, 1] - covs[:, 0, 1] ** 2, 0.0))
