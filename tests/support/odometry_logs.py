"""Fabricated odometry logs: a robot that drives as told, and odometry with known errors."""

from __future__ import annotations

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import FloatArray
from pilotage.logs.odometry_steps import OdometryForm, OdometrySteps, arc_ends


def drive(arc_m: FloatArray, turn_rad: FloatArray, heading_rad: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """True poses (N, 3) before and after each step: arcs from the origin, laid end to end."""
    turned = np.concatenate([[0.0], np.cumsum(turn_rad)])
    steps = arc_ends(np.column_stack([np.zeros((len(arc_m), 2)), heading_rad + turned[:-1]]), arc_m, turn_rad)
    poses = np.zeros((len(arc_m) + 1, 3))
    poses[1:, :2] = np.cumsum(steps[:, :2], axis=0)
    poses[:, 2] = wrap_array_to_pi(heading_rad + turned)
    return poses[:-1], poses[1:]


def log(
    arc_m: FloatArray,
    turn_rad: FloatArray,
    distance_error_m: FloatArray,
    angle_error_rad: FloatArray,
    *,
    name: str = "log",
    heading_rad: float = 0.0,
) -> OdometrySteps:
    """A log whose odometry errs by so much in each step."""
    start, truth = drive(arc_m, turn_rad, heading_rad)
    claimed = arc_ends(start, arc_m + distance_error_m, turn_rad + angle_error_rad)
    return OdometrySteps(
        name, OdometryForm.INCREMENTS, 0.1 * np.arange(1, arc_m.shape[0] + 1), start, truth, claimed
    )


def offset_log(shift_m: FloatArray, heading_rad: float, seed: int, std_m: float = 3.5e-3) -> OdometrySteps:
    """A straight drive of 500 steps of 0.1 m; its claims are shifted by (2,) in the map, with noise in x."""
    n = 500
    start, truth = drive(np.full(n, 0.1), np.zeros(n), heading_rad)
    claimed = truth.copy()
    claimed[:, :2] += shift_m
    claimed[:, 0] += np.random.default_rng(seed).normal(0.0, std_m, n)
    return OdometrySteps(
        f"heading {heading_rad:.2f}",
        OdometryForm.RESET,
        0.1 * np.arange(n, dtype=np.float64),
        start,
        truth,
        claimed,
    )
