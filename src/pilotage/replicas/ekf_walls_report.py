"""The night-watch report's wall filter as its text describes it, faults and all, to stand beside ours."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.chi_square import gated_mean
from pilotage.core.config import Config
from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.filters import ekf
from pilotage.kernels.lines import clustering
from pilotage.kernels.lines import infinite as infinite_lines
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.compass import CompassConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import CompassHeading, LidarScan, OdometryIncrement, Readings
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.localizer import LOCALIZERS, require_initial_pose, require_walls

CUTOFF_M = math.sqrt(0.2)
"""Its clusters' cutoff is one of squared distances."""
CLUSTER_POINTS = 10
MAX_RANGE_M = 19.9
INLIER_M = 0.1
SIDE_MARGIN_M = 0.5
SCAN_OFFSET_RAD = -0.0147
"""Its scan is turned by 2.37525 rad, not half the field of view: no wall stands along y exactly."""
UNIFORMS = 2048
COLUMNS = {"lines_seen": "1", "lines_accepted": "1", "nis": "1", "nis_dof": "1", "nis_expected": "1"}
"""Lines matched and accepted; NIS of the accepted together, its degrees of freedom and its mean."""


class EkfWallsReportConfig(Config):
    """The report's pairs of threshold and variance: 0.0039 and 0.01, 0.1 and 0.5, 1 and 1, 2 and 5.

    The threshold is the chi-square value itself, not a probability: taking 0.0039, the lower 5 %
    quantile, for the upper one was the report's first mistake. The odometry's variances are per step, those
    of its program (0.05 s). ``heading`` is what the scan is turned by: its program takes the simulator's true
    one, which a robot here has where a compass without errors tells it. ``initial_var`` stands for the
    variances of the start in m^2 and rad^2; its program begins at the true pose and yet with 0.01 each.
    The ``jacobian`` as printed, A / sqrt(A^2 + B^2), has the wrong sign on one side of every wall; signed, it
    is the distance's slope.
    """

    threshold_chi2: Positive = 0.0039
    distance_var_m2: Positive = 0.01
    odometry_distance_var_m2: NonNegative = 1.0312e-4
    odometry_angle_var_rad2: NonNegative = 1.955e-4
    heading: Literal["believed", "compass"] = "believed"
    initial_var: Positive | None = None
    jacobian: Literal["printed", "signed"] = "printed"


@LOCALIZERS.add("ekf-walls-report", EkfWallsReportConfig)
class EkfWallsReportLocalizer:
    """Extended Kalman filter on distances to infinite walls (night-watch report 3.2, equations 5 to 9).

    All distances of a scan pass one gate together, or none does. Fails, as the report says: the heading is
    never measured, corners pass for walls, distances meet the wrong wall of a line that goes on, and the
    threshold of one degree of freedom lets through next to nothing. Worst is the Jacobian's sign: with more
    walls on its wrong side than on the other, every correction makes the error larger. Use ``ekf-walls``.
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
        self._compass = ""
        if config.heading == "compass":
            self._compass, _ = robot.one_sensor(CompassConfig, "ekf-walls-report")
        require_walls(chart, "ekf-walls-report")
        self._step = lidar.beam_step_rad
        self._directions = clustering.beam_directions(
            float(lidar.beam_angles_rad()[0]), lidar.beam_step_rad, lidar.beams
        )
        self._max_range = min(MAX_RANGE_M, float(np.nextafter(lidar.max_range_m, 0.0)))
        self._lines = _general_equations(chart.reflectors.segments_m)
        self._Q = np.diag([config.odometry_distance_var_m2, config.odometry_angle_var_rad2])
        self._R = config.distance_var_m2
        self._threshold = config.threshold_chi2
        self._signed = config.jacobian == "signed"
        self._rng = robot.streams.stream("ekf-walls-report")
        self._pose = initial.pose.as_array()
        self._cov = initial.cov.copy() if config.initial_var is None else config.initial_var * np.eye(3)
        self.belief = initial
        self.errors_m: FloatArray = np.zeros((0, len(self._lines)))
        self._telemetry = journal.channel(COLUMNS)
        journal.result("error_matrix_m", lambda: self.errors_m)

    def step(self, readings: Readings) -> Belief:
        """Predict by the report's odometry model, then update by the distances to walls if they pass."""
        odometry = readings.by_sensor.get(self._odometry)
        if isinstance(odometry, OdometryIncrement):
            ekf.predict(self._pose, self._cov, odometry.distance_m, odometry.angle_rad, self._Q, False)
        scan = readings.by_sensor.get(self._lidar)
        if isinstance(scan, LidarScan):
            told = readings.by_sensor.get(self._compass)
            heading = told.heading_rad if isinstance(told, CompassHeading) else float(self._pose[2])
            self._update(scan.ranges_m, heading)
        else:
            self._tell(0, 0, 0.0)
        self.belief = Belief(Pose2.from_array(self._pose), self._cov.copy())
        return self.belief

    def _update(self, ranges_m: FloatArray, heading_rad: float) -> None:
        points = clustering.scan_points(ranges_m, self._directions)
        clusters = clustering.scan_clusters(
            ranges_m, points, self._step, self._max_range, CUTOFF_M, CLUSTER_POINTS
        )
        c, s = math.cos(heading_rad + SCAN_OFFSET_RAD), math.sin(heading_rad + SCAN_OFFSET_RAD)
        turned = np.ascontiguousarray(points @ np.array([[c, s], [-s, c]]))
        feet = infinite_lines.cluster_lines(
            turned, clusters, INLIER_M, CLUSTER_POINTS, self._rng.random(UNIFORMS)
        )
        x, y = float(self._pose[0]), float(self._pose[1])
        errors = infinite_lines.error_matrix(x, y, feet, self._lines, SIDE_MARGIN_M)
        self._keep(errors)
        best = np.abs(errors).argmin(axis=1) if errors.size else np.zeros(0, np.int64)
        rows = np.flatnonzero(np.abs(errors[np.arange(len(best)), best]) < infinite_lines.NO_ERROR)
        innovation = errors[rows, best[rows]]
        H = np.zeros((len(rows), 3))
        H[:, :2] = self._lines[best[rows], :2]
        if self._signed:
            H[:, :2] *= np.sign(self._lines[best[rows]] @ (x, y, 1.0))[:, None]
        S = H @ self._cov @ H.T + self._R * np.eye(len(rows))
        nis = float(innovation @ np.linalg.solve(S, innovation)) if len(rows) else math.inf
        passed = nis < self._threshold
        if passed:
            self._correct(innovation, H)
        self._tell(len(rows), len(rows) if passed else 0, nis)

    def _keep(self, errors: FloatArray) -> None:
        """The matrix of the moment in which most lines met a wall, for a picture."""
        met, best = ((np.abs(m) < infinite_lines.NO_ERROR).any(axis=1).sum() for m in (errors, self.errors_m))
        if met > best:
            self.errors_m = errors

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
        expected = math.nan
        if accepted == 0:
            nis = math.nan
        else:
            expected = gated_mean(self._threshold, accepted)
        self._telemetry.tell(seen, accepted, nis, accepted, expected)


def _general_equations(segments_m: FloatArray) -> FloatArray:
    """(W, 3) normalized A, B, C of A x + B y + C = 0 through each segment (report equation 5)."""
    x0, y0, x1, y1 = segments_m.T
    lines = np.column_stack([y1 - y0, x0 - x1, x1 * y0 - x0 * y1])
    length = np.hypot(lines[:, 0], lines[:, 1])
    return np.ascontiguousarray(lines[length > 0.0] / length[length > 0.0, None])
