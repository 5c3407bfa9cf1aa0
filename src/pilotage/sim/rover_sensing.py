"""What a rover's odometer and landmark sensor would say along a true path."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.random import RandomStreams
from pilotage.core.types import FloatArray
from pilotage.kernels.scans import landmarks_in_reach
from pilotage.maps.landmarks import Landmarks
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.landmark_log import LandmarkLog
from pilotage.sensors.wheel_odometry import WheelOdometryConfig


def true_steps(truth: FloatArray) -> FloatArray:
    """(T, 3) distance, direction less heading, turn of each step between (T + 1, 3) poses."""
    dx, dy = np.diff(truth[:, 0]), np.diff(truth[:, 1])
    distance = np.hypot(dx, dy)
    aside = wrap_array_to_pi(np.arctan2(dy, dx) - truth[:-1, 2])
    aside[distance == 0.0] = 0.0
    return np.column_stack([distance, aside, wrap_array_to_pi(np.diff(truth[:, 2]))])


def step_variances(steps: FloatArray, odometer: WheelOdometryConfig) -> FloatArray:
    """(T, 2) variances of distance and turn; they grow with the length of the step."""
    distance, turn = np.abs(steps[:, 0]), np.abs(steps[:, 2])
    return np.column_stack(
        [
            odometer.distance_var_m2_per_m * distance + odometer.distance_var_m2_per_rad * turn,
            odometer.angle_var_rad2_per_m * distance + odometer.angle_var_rad2_per_rad * turn,
        ]
    )


def landmark_log(
    truth: FloatArray,
    odometer: tuple[str, WheelOdometryConfig],
    seer: tuple[str, BeaconConfig] | None,
    landmarks: Landmarks,
    streams: RandomStreams,
) -> LandmarkLog:
    """Log a drive along (T + 1, 3) true poses; each sensor has a noise stream of its own.

    On open ground nothing hides a landmark within reach and field of view.
    """
    name, config = odometer
    steps = true_steps(truth)
    variances = step_variances(steps, config)
    noise = streams.stream(f"sensor/{name}").standard_normal((2, len(steps)))
    logged = steps.copy()
    logged[:, 0] = config.distance_scale * steps[:, 0] + np.sqrt(variances[:, 0]) * noise[0]
    logged[:, 2] = config.angle_scale * steps[:, 2] + np.sqrt(variances[:, 1]) * noise[1]
    if seer is None or not len(landmarks):
        nothing = np.zeros(0)
        none = np.zeros(0, dtype=np.int64)
        return LandmarkLog(
            logged, variances, np.zeros(len(steps) + 1, dtype=np.int64), none, nothing, nothing
        )
    name, sensor = seer
    step, index = _within(truth[1:], landmarks.points_xy_m, sensor.max_range_m)
    seen = landmarks.points_xy_m[index] - truth[1:][step, :2]
    ranges = np.hypot(seen[:, 0], seen[:, 1])
    bearings = wrap_array_to_pi(np.arctan2(seen[:, 1], seen[:, 0]) - truth[1:][step, 2])
    ahead = np.abs(bearings) <= 0.5 * sensor.field_of_view_rad
    rng = streams.stream(f"sensor/{name}")
    errors = rng.standard_normal((2, len(step)))
    ranges = np.abs(ranges + math.sqrt(sensor.range_var_m2) * errors[0])
    bearings = wrap_array_to_pi(
        bearings + sensor.bearing_offset_rad + math.sqrt(sensor.bearing_var_rad2) * errors[1]
    )
    step, index, ranges, bearings = step[ahead], index[ahead], ranges[ahead], bearings[ahead]
    first = np.searchsorted(step, np.arange(len(steps) + 1)).astype(np.int64)
    return LandmarkLog(logged, variances, first, landmarks.ids[index], ranges, bearings)


def _within(
    truth: FloatArray, points: FloatArray, reach_m: float
) -> tuple[np.ndarray[tuple[int], np.dtype[np.int64]], np.ndarray[tuple[int], np.dtype[np.int64]]]:
    """(S,) and (S,) step and landmark of every sighting."""
    places, marks = np.ascontiguousarray(truth), np.ascontiguousarray(points)
    size = 4 * len(places) + 16
    while True:
        step, index = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int64)
        count = int(landmarks_in_reach.sightings_within(places, marks, reach_m, step, index))
        if count < size:
            return step[:count], index[:count]
        size *= 4
