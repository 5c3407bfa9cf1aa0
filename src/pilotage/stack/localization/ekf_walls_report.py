"""The night-watch report's wall filter as its text describes it, faults and all, to stand beside ours."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.chi_square import gated_mean
from pilotage.core.config import Config
from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.filters import ekf
from pilotage.kernels.lines import clustering
from pilotage.kernels.lines import infinite as infinite_lines
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Readings
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.localizer import LOCALIZERS, require_initial_pose

CUTOFF_M = 0.5
CLUSTER_POINTS = 10
MAX_RANGE_M = 19.9
INLIER_M = 0.05
ITERATIONS = 60
UNIFORMS = 512
COLUMNS = {"lines_seen": "1", "lines_accepted": "1", "nis": "1", "nis_dof": "1", "nis_expected": "1"}
"""Lines seen and accepted; NIS summed over the accepted, its degrees of freedom and its mean."""


class EkfWallsReportConfig(Config):
    """The report's pairs of threshold and variance: 0.0039 and 0.01, 0.1 and 0.5, 1 and 1, 2 and 5.

    The threshold is the chi-square value itself, not a probability: taking 0.0039, the lower 5 %
    quantile, for the upper one was the report's first mistake.
    """

    threshold_chi2: Positive = 0.0039
    distance_var_m2: Positive = 0.01
    odometry_distance_var_m2: NonNegative = 1.286e-5
    odometry_angle_var_rad2: NonNegative = 0.01334
    """Per step; the report's number is in deg^2 and was used as rad^2."""


@LOCALIZERS.add("ekf-walls-report", EkfWallsReportConfig)
class EkfWallsReportLocalizer:
    """Extended Kalman filter on distances to infinite walls (night-watch report 3.2, equations 5 to 9).

    Fails, as the report says: the heading is never measured, corners pass for walls, distances meet the
    wrong wall of a line that goes on, the Jacobian's sign is right on one side of a wall only, and the
    threshold lets through next to nothing or next to everything. Use ``ekf-walls``.
    """

    def __init__(
        self,
        config: EkfWallsReportConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        initial: Belief,
        journal: Journal,
    ) -> None:
        require_initial_pose(initial, "ekf-walls-report")
        self._odometry, _ = robot.one_sensor(WheelOdometryConfig, "ekf-walls-report")
        self._lidar, lidar = robot.one_sensor(LidarConfig, "ekf-walls-report")
        self._step = lidar.beam_step_rad
        self._directions = clustering.beam_directions(
            float(lidar.beam_angles_rad()[0]), lidar.beam_step_rad, lidar.beams
        )
        self._max_range = min(MAX_RANGE_M, float(np.nextafter(lidar.max_range_m, 0.0)))
        self._lines = _general_equations(chart.walls.segments_m)
        self._Q = np.diag([config.odometry_distance_var_m2, config.odometry_angle_var_rad2])
        self._R = config.distance_var_m2
        self._threshold = config.threshold_chi2
        self._expected_nis = gated_mean(config.threshold_chi2, 1)
        self._rng = robot.streams.stream("ekf-walls-report")
        self._pose = initial.pose.as_array()
        self._cov = initial.cov.copy()
        self.belief = initial
        self._telemetry = journal.channel(COLUMNS)

    def step(self, readings: Readings) -> Belief:
        """Predict by the report's odometry model, then update by every distance that passes."""
        odometry = readings.by_sensor.get(self._odometry)
        if isinstance(odometry, OdometryIncrement):
            ekf.predict(self._pose, self._cov, odometry.distance_m, odometry.angle_rad, self._Q, False)
        scan = readings.by_sensor.get(self._lidar)
        if isinstance(scan, LidarScan):
            self._update(scan.ranges_m)
        else:
            self._tell(0, 0, 0.0)
        self.belief = Belief(Pose2.from_array(self._pose), self._cov.copy())
        return self.belief

    def _update(self, ranges_m: FloatArray) -> None:
        points = clustering.scan_points(ranges_m, self._directions)
        clusters = clustering.scan_clusters(
            ranges_m, points, self._step, self._max_range, CUTOFF_M, CLUSTER_POINTS
        )
        feet = infinite_lines.cluster_lines(
            points, clusters, INLIER_M, ITERATIONS, self._rng.random(UNIFORMS)
        )
        matched = np.empty(feet.shape[0], dtype=np.int64)
        x, y, theta = (float(value) for value in self._pose)
        innovation = infinite_lines.match_distances(x, y, theta, feet, self._lines, matched)
        H = np.zeros((feet.shape[0], 3))
        H[:, :2] = self._lines[matched, :2]
        S = np.einsum("ni,ij,nj->n", H, self._cov, H) + self._R
        nis = innovation**2 / S
        passed = np.flatnonzero((matched >= 0) & (nis <= self._threshold))
        if passed.size:
            self._correct(innovation[passed], H[passed])
        self._tell(feet.shape[0], passed.size, float(nis[passed].sum()))

    def _correct(self, innovation: FloatArray, H: FloatArray) -> None:
        """All distances at once, in Joseph form."""
        R = self._R * np.eye(innovation.shape[0])
        K = np.linalg.solve(H @ self._cov @ H.T + R, H @ self._cov).T
        A = np.eye(3) - K @ H
        self._pose += K @ innovation
        self._pose[2] = wrap_to_pi(float(self._pose[2]))
        cov = A @ self._cov @ A.T + K @ R @ K.T
        self._cov = 0.5 * (cov + cov.T)

    def _tell(self, seen: int, accepted: int, nis: float) -> None:
        """One step's numbers; without a measurement there is no NIS."""
        expected = accepted * self._expected_nis
        if accepted == 0:
            nis = expected = math.nan
        self._telemetry.tell(seen, accepted, nis, accepted, expected)


def _general_equations(segments_m: FloatArray) -> FloatArray:
    """(W, 3) normalized A, B, C of A x + B y + C = 0 through each segment (report equation 5)."""
    x0, y0, x1, y1 = segments_m.T
    lines = np.column_stack([y1 - y0, x0 - x1, x1 * y0 - x0 * y1])
    length = np.hypot(lines[:, 0], lines[:, 1])
    return np.ascontiguousarray(lines[length > 0.0] / length[length > 0.0, None])
