"""What every Kalman filter on beacons does: odometry predicts, ranges and bearings correct."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar

import numpy as np
from pydantic import Field

from pilotage.core.chi_square import chi_square_quantile, gated_mean
from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, IntArray, Pose2
from pilotage.kernels.filters import sighting
from pilotage.maps.world_map import WorldMap
from pilotage.models.odometry import OdometryModel
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.readings import BeaconReadings, Readings
from pilotage.sensors.sensor import Positive
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.beacon_fix import fix_from_beacons
from pilotage.stack.localization.gyro_odometry import GyroOdometry
from pilotage.stack.localization.localizer import require_initial_pose
from pilotage.stack.localization.odometry_prediction import OdometryBelief, OdometryPrediction, Predict
from pilotage.stack.localization.odometry_watch import (
    LINEAR_RAD,
    MOST_HEADING_VAR,
    OdometryWatch,
)
from pilotage.stack.localization.self_check import NOISE_SHARE, SelfCheck

MEASUREMENT_DOF = 2
"""Range and bearing."""
SIGHTING_COLUMNS = {
    "beacons_seen": "1",
    "beacons_accepted": "1",
    "nis": "1",
    "nis_dof": "1",
    "nis_expected": "1",
    "localized": "1",
}
"""Beacons seen and accepted; NIS summed over the accepted, its degrees of freedom and its mean; whether the
robot holds itself for localized."""
WIDENING = 2.0
"""A filter in doubt multiplies the pose's standard deviations by this at every sighting until one passes."""


class LandmarkFilterConfig(Config):
    """The gate is a probability: the share of true measurements that it lets through.

    Variances left out are taken from the sensors' data sheets; the scales serve experiments with a
    filter that is wrong about its noise.
    """

    gate: float = Field(default=0.999, gt=0.0, lt=1.0)
    range_var_m2: Positive | None = None
    bearing_var_rad2: Positive | None = None
    measurement_var_scale: Positive = 1.0
    odometry_model: OdometryModel = OdometryModel.EXACT_ARC
    odometry: OdometryBelief = OdometryBelief()
    odometry_var_scale: Positive = 1.0
    doubt_after: int | None = Field(default=5, ge=1)
    """Sightings one after the other of which the gate let nothing through, until the filter doubts itself
    rather than the sensor: it takes its pose from the beacons alone, or where these do not agree on one
    widens its covariance. None: never."""


Update = Callable[..., tuple[int, FloatArray, IntArray]]


def known_landmarks(chart: WorldMap, name: str) -> sighting.Known:
    """The landmarks of the robot's map; InputError without any."""
    if len(chart.landmarks) == 0:
        raise InputError(
            f"{name}: expected a map with landmarks, found none; add some (world.landmarks, --landmarks) "
            "or localize by a laser (particle-filter)"
        )
    return chart.landmarks.by_id()


def reading_variances(
    sensor: BeaconConfig, range_var_m2: float | None, bearing_var_rad2: float | None, name: str
) -> tuple[float, float]:
    """Variances of a range and a bearing, as told or as the data sheet has them; InputError for none."""
    range_var = sensor.range_var_m2 if range_var_m2 is None else range_var_m2
    bearing_var = sensor.bearing_var_rad2 if bearing_var_rad2 is None else bearing_var_rad2
    if range_var == 0.0 or bearing_var == 0.0:
        raise InputError(
            f"{name}: a beacon sensor without noise leaves the filter no measurement variance; "
            "set stack.localizer.range_var_m2 and stack.localizer.bearing_var_rad2 above 0"
        )
    return range_var, bearing_var


class LandmarkFilter:
    """A filter with known correspondences; which filter, the kernels of its two steps say.

    Attributes
    ----------
    NAME
        As registered, for messages.
    """

    NAME: ClassVar[str]

    BY_COMMANDS: ClassVar[bool] = True

    def __init__(
        self,
        config: LandmarkFilterConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        initial: Belief,
        journal: Journal,
    ) -> None:
        name = self.NAME
        require_initial_pose(initial, name)
        predict, self._update_kernel = self._kernels()
        self._odometry, odometry = robot.one_sensor(WheelOdometryConfig, name)
        self._beacons, beacons = robot.one_sensor(BeaconConfig, name)
        self._known = known_landmarks(chart, name)
        self._prediction = OdometryPrediction(
            odometry, config.odometry, config.odometry_var_scale, config.odometry_model, predict
        )
        self._motion = GyroOdometry(robot, self._odometry, self._prediction, journal)
        self._mount = beacons.mount.as_array()
        variances = reading_variances(beacons, config.range_var_m2, config.bearing_var_rad2, name)
        self._R = config.measurement_var_scale * np.diag(variances)
        self._gate_probability = config.gate
        self._gate = chi_square_quantile(config.gate, MEASUREMENT_DOF)
        self._expected_nis = gated_mean(self._gate, MEASUREMENT_DOF)
        self._doubt_after, self._rejected = config.doubt_after, 0
        self._watch, self._check, self._t_s = (
            OdometryWatch(robot, odometry),
            SelfCheck(config.gate, noise_share=NOISE_SHARE),
            0.0,
        )
        self._pose = initial.pose.as_array()
        self._cov = initial.cov.copy()
        self.belief = initial
        self._telemetry = journal.channel(SIGHTING_COLUMNS)

    def _kernels(self) -> tuple[Predict, Update]:
        """With the arguments of ``ekf.predict`` and ``ekf.update_range_bearings``."""
        raise NotImplementedError

    def step(self, readings: Readings) -> Belief:
        """Predict by the odometry increment, then update by every beacon seen."""
        self._t_s = readings.t_s
        odometry = self._motion.increment(readings, self.belief)
        if odometry is not None:
            self._prediction.move(self._pose, self._cov, odometry)
        self._watch.widen(self._cov, readings.t_s, odometry, self.belief)
        seen = readings.by_sensor.get(self._beacons)
        if isinstance(seen, BeaconReadings):
            self._update(seen)
        else:
            self._tell(0, 0, 0.0)
        # A filter may estimate more than the pose, which comes first.
        status = BeliefStatus.LOST if self._lost else BeliefStatus.LOCALIZED
        self.belief = Belief(Pose2.from_array(self._pose), self._cov[:3, :3].copy(), status)
        return self.belief

    @property
    def _lost(self) -> bool:
        """Whether the filter has reason not to be believed, or knows its heading too little to go on."""
        return self._check.lost(self._t_s) or self._blind

    @property
    def _blind(self) -> bool:
        return bool(self._cov[2, 2] > LINEAR_RAD**2)

    def _update(self, seen: BeaconReadings) -> None:
        count = seen.ids.shape[0]
        if self._blind:
            self._begin_anew(seen, np.isin(seen.ids, self._known.ids))
            self._tell(count, 0, 0.0)
            return
        sightings = sighting.Seen(seen.ids, seen.ranges_m, seen.bearings_rad)
        used, nis, outcome = self._update_kernel(
            self._pose, self._cov, sightings, self._known, self._mount, self._R, self._gate
        )
        known, total = sighting.summed_up(nis, outcome)
        self._check.tell(self._t_s, known, used, total, used * self._expected_nis)
        self._tell(count, used, total)
        if used:
            self._rejected = 0
            return
        if known:
            self._rejected += 1
            if self._doubt_after is not None and self._rejected >= self._doubt_after:
                self._doubt(seen, outcome != sighting.OUTCOME_UNKNOWN)

    def _doubt(self, seen: BeaconReadings, known: BoolArray) -> None:
        """Begin anew where the beacons agree on a pose, else believe the old one less."""
        self._check.alarm(self._t_s)
        if self._begin_anew(seen, known):
            return
        stds = np.ones(self._pose.shape[0])
        stds[:3] = WIDENING
        stds[2] = min(WIDENING, math.sqrt(MOST_HEADING_VAR / max(float(self._cov[2, 2]), 1e-12)))
        self._cov *= np.outer(stds, stds)  # correlations stay as they are

    def _begin_anew(self, seen: BeaconReadings, known: BoolArray) -> bool:
        """Take the pose that the beacons agree on, if they do."""
        points = self._known.points[np.searchsorted(self._known.ids, seen.ids[known])]
        bearings = seen.bearings_rad[known] - self._bearing_offset_rad
        fix = fix_from_beacons(points, seen.ranges_m[known], bearings, self._mount, self._R)
        if fix is not None and fix.chi2 <= chi_square_quantile(self._gate_probability, fix.dof):
            self._pose[:3] = fix.pose
            self._cov[:3, :], self._cov[:, :3] = 0.0, 0.0
            self._cov[:3, :3] = fix.cov
            self._rejected = 0
            return True
        return False

    @property
    def _bearing_offset_rad(self) -> float:
        """By how much bearings are believed to read too large."""
        return 0.0

    def _tell(self, seen: int, accepted: int, nis: float) -> None:
        """One step's numbers; without a measurement there is no NIS."""
        expected = accepted * self._expected_nis
        if accepted == 0:
            nis = expected = math.nan
        localized = 0.0 if self._lost else 1.0
        self._telemetry.tell(seen, accepted, nis, MEASUREMENT_DOF * accepted, expected, localized)
