"""A finished run on terrain in memory, its trace and its numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import Event, FloatArray
from pilotage.evaluation.consistency import nees
from pilotage.evaluation.relief import relief
from pilotage.evaluation.rover_metrics import ellipse_axes, estimation_metrics, root_determinant
from pilotage.experiments.terrain.estimation import Estimation, seen_per_step
from pilotage.experiments.terrain.ground import Ground
from pilotage.experiments.terrain.motion import Motion, goal_errors, hazard_contacts, way_m
from pilotage.experiments.terrain.route import CLEARANCE_REACH_CELLS, Route
from pilotage.kernels.grids.blocked_distance import distance_to_blocked
from pilotage.maps.occupancy_grid import OccupancyGrid, squared_distances
from pilotage.missions.terrain import TerrainMission

NEAR_CELLS = 3.0
"""Points no farther than this beyond the nearest are measured exactly."""


@dataclass(frozen=True, slots=True, eq=False)
class TerrainRecord:
    """A finished run; see ``pilotage.experiments.mission_kind.Record``.

    Attributes
    ----------
    route, motion, estimation
        Those that the mission asks for: a planned path, a true way, an estimate of it.
    loop_s
        Wall time of driving and estimating.
    """

    mission: TerrainMission
    ground: Ground
    route: Route | None
    motion: Motion | None
    estimation: Estimation | None
    trace: Mapping[str, FloatArray]
    events: list[Event]
    loop_s: float


def motion_trace(motion: Motion, ground: Ground) -> dict[str, FloatArray]:
    """One row a sample of a true way."""
    x, y = motion.poses[:, 0], motion.poses[:, 1]
    away = hazard_distance_m(motion.poses[:, :2], ground.hazards)
    trace = {
        "t_s": motion.t_s,
        "distance_m": way_m(motion),
        "true_x_m": x,
        "true_y_m": y,
        "true_theta_rad": motion.poses[:, 2],
        "v_m_s": motion.v_m_s,
        "w_rad_s": motion.w_rad_s,
        "steering_rad": motion.steering_rad,
        "hazard_distance_m": away,
    }
    if ground.elevation is not None:
        trace["elevation_m"] = ground.elevation.heights_at(motion.poses[:, :2])
        trace["slope_rad"] = ground.elevation.slopes_at(ground.hazards.cells_at(motion.poses[:, :2]))
    return trace


def hazard_distance_m(points_xy_m: FloatArray, grid: OccupancyGrid) -> FloatArray:
    """(N,) distance of points on the grid from the nearest hazard's edge; exact where it is least.

    Farther off by the distance of the cells' middles, less half a cell's diagonal: tens of thousands of exact
    distances would take seconds. More than ``CLEARANCE_REACH_CELLS`` cells are not measured.
    """
    blocked, reach = grid.blocked(), CLEARANCE_REACH_CELLS
    cells = grid.cells_at(points_xy_m)
    rows = np.clip(cells[:, 0], 0, grid.rows - 1)
    columns = np.clip(cells[:, 1], 0, grid.columns - 1)
    # No hazard farther than the reach counts: only the ground around the way is looked at.
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


def estimation_trace(estimation: Estimation, motion: Motion, probability: float) -> dict[str, FloatArray]:
    """The estimate's columns, the initial belief in the first row."""
    found, initial = estimation.estimate, estimation.initial
    poses = np.vstack([initial.pose.as_array(), found.poses])
    covs = np.concatenate([initial.cov[None], found.covs])
    truth = np.column_stack([motion.poses[:, :2], wrap_array_to_pi(motion.poses[:, 2])])
    axes = ellipse_axes(covs, probability)
    seen = np.concatenate([[0], seen_per_step(estimation.log)])
    return {
        "est_x_m": poses[:, 0],
        "est_y_m": poses[:, 1],
        "est_theta_rad": poses[:, 2],
        "cov_xx_m2": covs[:, 0, 0],
        "cov_xy_m2": covs[:, 0, 1],
        "cov_yy_m2": covs[:, 1, 1],
        "cov_xt_m_rad": covs[:, 0, 2],
        "cov_yt_m_rad": covs[:, 1, 2],
        "cov_tt_rad2": covs[:, 2, 2],
        "ellipse_major_m": axes[:, 0],
        "ellipse_minor_m": axes[:, 1],
        "ellipse_direction_rad": axes[:, 2],
        "root_determinant_m2": root_determinant(covs),
        "landmarks_seen": seen.astype(np.float64),
        "nees": nees(truth, poses, covs),
    }


def motion_metrics(record: TerrainRecord) -> dict[str, object]:
    """The numbers of a true way and, where there is one, of its estimate."""
    mission, motion = record.mission, record.motion
    assert motion is not None
    contacts = hazard_contacts(motion, record.ground)
    steps = len(motion.t_s) - 1
    away = record.trace["hazard_distance_m"]
    metrics: dict[str, object] = {
        "mission": mission.mission,
        "seed": mission.run.seed,
        "success": motion.done and contacts == 0,
        "reason": motion.reason if contacts == 0 else f"{contacts} of {steps + 1} samples lie on a hazard",
        "duration_s": float(motion.t_s[-1]),
        "steps": steps,
        "steps_per_s": steps / record.loop_s,
        "path_length_m": float(record.trace["distance_m"][-1]),
        "hazard_contacts": contacts,
        "min_clearance_m": float(np.nanmin(away)) if np.isfinite(away).any() else math.nan,
        "end": {"x_m": motion.poses[-1, 0], "y_m": motion.poses[-1, 1], "theta_rad": motion.poses[-1, 2]},
        **goal_errors(mission, motion),
    }
    if record.ground.elevation is not None and steps > 0:
        profile = relief(record.ground.elevation, motion.poses[:, :2])
        metrics |= {"climb_m": profile.climb_m, "descent_m": profile.descent_m}
    if record.estimation is None:
        return metrics
    found = record.estimation.estimate
    truth = np.column_stack([motion.poses[1:, :2], wrap_array_to_pi(motion.poses[1:, 2])])
    return metrics | estimation_metrics(
        truth,
        found.poses,
        found.covs,
        mission.stack.ellipse_probability,
        seen_per_step(record.estimation.log),
        found.nis,
        found.outcome,
        found.gate,
    )
