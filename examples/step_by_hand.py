"""Drive a robot by hand and hold an own filter's chain of steps against the truth: no stack, no files."""

import math

import numpy as np

import pilotage as pl
from pilotage.sensors.readings import BeaconReadings, OdometryIncrement

sim = pl.make("museum-1", seed=7)
readings = sim.reset()
points = sim.map.landmarks
table = np.column_stack([points.ids, points.points_xy_m])
ekf = pl.filters.EkfLandmarks(landmarks=table, pose=sim.truth)
for step in range(100):
    readings = sim.step(pl.Twist(0.5, 0.1 * math.sin(0.1 * step)))
    moved, seen = readings.by_sensor["odometry"], readings.by_sensor.get("beacons")
    if isinstance(moved, OdometryIncrement):
        ekf = ekf.predict(moved.distance_m, moved.angle_rad)
    if isinstance(seen, BeaconReadings):
        ekf = ekf.update(seen.ids, seen.ranges_m, seen.bearings_rad)
truth, belief = sim.truth, ekf.mean
error_mm = 1e3 * math.hypot(truth.x_m - belief.x_m, truth.y_m - belief.y_m)
print(f"after {sim.t_s:.1f} s at ({truth.x_m:.2f}, {truth.y_m:.2f}): {error_mm:.1f} mm off")
print(
    "the filter believes", " x ".join(f"{1e3 * std:.1f} mm" for std in ekf.std[:2]), "of standard deviation"
)
