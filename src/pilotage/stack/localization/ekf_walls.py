"""The EKF on walls: odometry predicts, straight lines in the laser scan correct; no beacons."""

from __future__ import annotations

import math
from typing import ClassVar

from pydantic import Field

from pilotage.core.chi_square import gated_mean
from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.maps.world_map import WorldMap
from pilotage.models.odometry import OdometryModel
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Readings
from pilotage.sensors.sensor import Positive
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.gyro_odometry import GyroOdometry
from pilotage.stack.localization.localizer import LOCALIZERS, require_initial_pose, require_walls
from pilotage.stack.localization.odometry_prediction import OdometryBelief, OdometryPrediction
from pilotage.stack.localization.odometry_watch import LINEAR_RAD, STANDS_M, TURN_AS_PATH_M, OdometryWatch
from pilotage.stack.localization.recovery import Recovery, RecoveryConfig
from pilotage.stack.localization.self_check import SelfCheck
from pilotage.stack.localization.wall_correction import correct
from pilotage.stack.localization.wall_matching import LINE_DOF, WallMatcher, WallMatchingConfig
from pilotage.stack.localization.wall_update import WallUpdate
from pilotage.stack.perception.lines import DetectedLines, LineExtractionConfig, LineExtractor

COLUMNS = {
    "lines_seen": "1",
    "lines_accepted": "1",
    "nis": "1",
    "nis_dof": "1",
    "nis_expected": "1",
    "localized": "1",
    "hypotheses": "1",
}
"""Lines seen and matched; NIS of the accepted together, its degrees of freedom and its mean; whether the
robot knows where it is, and how many poses it may have."""

MOST_REFUSED = 0.25
"""Share of the lines beside walls; those of a right belief are refused in one of a thousand cases."""
LEAST_BY_NOISE = 0.5
"""Of the lines that its noise lets through: all of a scan are refused that do not agree."""
MOST_ALIKE = 5
"""So many scans count where the robot stands: what walls and lines are wrong by is the same in all."""


class EkfWallsConfig(Config):
    """The gate is a probability: the share of true measurements that it lets through.

    The range variance left out is taken from the scanner's data sheet; the scales serve experiments with
    a filter that is wrong about its noise.
    """

    gate: float = Field(default=0.999, gt=0.0, lt=1.0)
    range_var_m2: Positive | None = None
    measurement_var_scale: Positive = 1.0
    odometry_model: OdometryModel = OdometryModel.EXACT_ARC
    odometry: OdometryBelief = OdometryBelief()
    odometry_var_scale: Positive = 1.0
    lines: LineExtractionConfig = LineExtractionConfig()
    matching: WallMatchingConfig = WallMatchingConfig()
    recovery: RecoveryConfig | None = RecoveryConfig()
    """How a wrong belief is noticed and the pose found again; None: never."""


@LOCALIZERS.add("ekf-walls", EkfWallsConfig)
class EkfWallsLocalizer:
    """Extended Kalman filter on the walls of the map (after night-watch report 3.2, its faults mended).

    Lines of a scan are measured in normal form, distance and angle, so that the heading is observable
    (Arras & Siegwart 1997); they are matched to the walls jointly, and update in Joseph form.

    A belief that the scans contradict is given up: the status is lost then, with the covariance of knowing
    nothing, until the search through the map has one pose left. So it starts without a pose, too.

    Fails where walls run in one direction only (the pose along them is dead reckoning then), and in a map
    that repeats itself farther than the robot sees. Of a grid it knows the faces of cells, as they are: where
    walls run along rows of cells, however ragged, it is right to millimetres (0442); slanted walls are
    staircases there, and a recording in a map of its building is off it by centimetres: it says that it is
    lost, and ``particle-filter`` is not. Where the robot stands it takes in a few scans and only judges
    itself by the others.
    """

    BY_COMMANDS: ClassVar[bool] = True

    def __init__(
        self,
        config: EkfWallsConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        initial: Belief,
        journal: Journal,
    ) -> None:
        self._odometry, odometry = robot.one_sensor(WheelOdometryConfig, "ekf-walls")
        self._lidar, lidar = robot.one_sensor(LidarConfig, "ekf-walls")
        range_var = lidar.range_var_m2 if config.range_var_m2 is None else config.range_var_m2
        if range_var == 0.0:
            raise InputError(
                "ekf-walls: a scanner without noise leaves the filter no measurement variance; "
                "set stack.localizer.range_var_m2 above 0"
            )
        require_walls(chart, "ekf-walls")
        self._prediction = OdometryPrediction(
            odometry, config.odometry, config.odometry_var_scale, config.odometry_model
        )
        self._motion = GyroOdometry(robot, self._odometry, self._prediction, journal)
        self._extractor = LineExtractor(config.lines, lidar, range_var, robot.streams.stream("ekf-walls"))
        # Only the covariances are scaled: which points make a line is no matter of belief.
        self._var_scale = config.measurement_var_scale
        self._moved_m, self._alike, self._most_matched = 0.0, 0, 0
        self._mount = lidar.mount.as_array()
        self._matcher = WallMatcher(
            config.matching, config.gate, chart.reflectors, self._mount, config.lines.gap_m
        )
        if config.recovery is None:
            require_initial_pose(initial, "ekf-walls without recovery")
            self._recovery = None
        else:
            self._recovery = Recovery(
                config.recovery,
                robot,
                chart,
                lidar,
                config.lines.max_range_m or lidar.sure_range_m,
                self._matcher,
                self._mount,
                self._prediction,
            )
        gates = self._matcher.joint_gates
        self._expected_nis = [0.0, *(gated_mean(gates[k], LINE_DOF * k) for k in range(1, len(gates)))]
        self._watch, self._check, self._t_s = (
            OdometryWatch(robot, odometry),
            SelfCheck(config.gate, MOST_REFUSED, noise_share=LEAST_BY_NOISE),
            0.0,
        )
        self._pose = initial.pose.as_array()
        self._cov = initial.cov.copy()
        self.belief = initial
        self._unknown = Belief.anywhere(chart.bounds_m)
        self._lost = initial.status is BeliefStatus.LOST
        self._journal = journal
        self._telemetry = journal.channel(COLUMNS)

    def step(self, readings: Readings) -> Belief:
        """Predict by the odometry increment, then update by the lines of the scan."""
        self._t_s = readings.t_s
        odometry = self._motion.increment(readings, self.belief)
        if odometry is not None:
            self._move(odometry)
        if self._watch.widen(self._cov, readings.t_s, odometry, self.belief):
            self._alike = 0
        seen, used, nis = 0, 0, 0.0
        scan = readings.by_sensor.get(self._lidar)
        if isinstance(scan, LidarScan):
            lines = self._extractor.extract(scan.ranges_m)
            if self._var_scale != 1.0:
                lines.covs[:] *= self._var_scale
            self._lost |= self._recovery is not None and self._blind
            if self._lost:
                self._find(lines, scan.ranges_m)
            else:
                used, nis = self._update(lines, scan.ranges_m)
            seen = len(lines)
        if self._lost:
            self.belief = self._unknown
        else:
            status = BeliefStatus.LOST if self._unsure else BeliefStatus.LOCALIZED
            self.belief = Belief(Pose2.from_array(self._pose), self._cov.copy(), status)
        self._tell(seen, used, nis)
        return self.belief

    @property
    def _blind(self) -> bool:
        """Whether the heading is known too little for lines to be matched."""
        return bool(self._cov[2, 2] > LINEAR_RAD**2)

    @property
    def _unsure(self) -> bool:
        """Whether the belief, which is not given up yet, is not to be relied on."""
        return self._blind or self._check.lost(self._t_s)

    def _move(self, odometry: OdometryIncrement) -> None:
        driven_m = math.hypot(odometry.distance_m, odometry.lateral_m)
        self._moved_m += driven_m + TURN_AS_PATH_M * abs(odometry.angle_rad)
        if not self._lost:
            self._prediction.move(self._pose, self._cov, odometry)
        elif self._recovery is not None:
            self._recovery.move(odometry)

    def _update(self, lines: DetectedLines, ranges_m: FloatArray) -> tuple[int, float]:
        """Correct the pose; returns how many lines were used, and their joint NIS."""
        pose, cov = self._pose.copy(), self._cov.copy()
        matches, total = correct(self._pose, self._cov, self._mount, lines, self._matcher)
        self._journal.update = WallUpdate(pose, cov, self._pose.copy(), lines, matches, self._matcher)
        # Lines beside no wall at all are of what is on no map; those that may be several walls say nothing.
        count = matches.count
        if self._tells_nothing_new(count):
            self._pose, self._cov = pose.copy(), cov.copy()
        self._check.tell(self._t_s, matches.placed, count, total, self._expected_nis[count])
        if self._recovery is not None:
            self._lost = self._recovery.gives_up(self._pose, self._cov, ranges_m, matches)
        return count, total

    def _tells_nothing_new(self, matched: int) -> bool:
        """Whether a scan is one too many from where the robot stands (0286)."""
        stands, self._moved_m = self._moved_m < STANDS_M, 0.0
        if not stands or self._alike == 0:
            self._alike, self._most_matched = 0, 0
        # Walls that others hid until now are new also to whom that stands.
        if matched > self._most_matched:
            self._alike, self._most_matched = 0, matched
        self._alike += matched > 0
        return self._alike > MOST_ALIKE

    def _find(self, lines: DetectedLines, ranges_m: FloatArray) -> None:
        assert self._recovery is not None, "never lost without it"
        found = self._recovery.find(lines, ranges_m)
        if found is not None:
            self._pose, self._cov, self._lost, self._alike = found.pose, found.cov, False, 0

    def tell_mates(self, mates: FloatArray) -> None:
        """Where mates (K, 4) say that they are, as of ``ScanFit.mates_in_sight``."""
        if self._recovery is not None:
            self._recovery.tell_mates(mates)

    def look_bearing_rad(self) -> float | None:
        """Direction, in the robot's frame, worth driving in to find out where it is; None where any is."""
        if not self._lost or self._recovery is None:
            return None
        return self._recovery.look_bearing_rad

    def _tell(self, seen: int, accepted: int, nis: float) -> None:
        """One step's numbers; without a measurement there is no NIS."""
        expected = self._expected_nis[accepted]
        if accepted == 0:
            nis = expected = math.nan
        self._telemetry.tell(
            seen,
            accepted,
            nis,
            LINE_DOF * accepted,
            expected,
            1.0 if self.belief.status is BeliefStatus.LOCALIZED else 0.0,
            0.0 if self._recovery is None else self._recovery.hypotheses,
        )
