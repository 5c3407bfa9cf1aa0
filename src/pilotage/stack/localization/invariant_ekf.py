"""The EKF on landmarks whose error is invariant: honest over kilometres without a landmark and after."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.chi_square import chi_square_quantile, gated_mean
from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray, Pose2
from pilotage.kernels.filters import rover_filter
from pilotage.maps.world_map import WorldMap
from pilotage.models.odometry import OdometryModel, chord
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.readings import BeaconReadings, Readings
from pilotage.sensors.sensor import Positive
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.beacon_fix import fix_from_beacons
from pilotage.stack.localization.gyro_odometry import GyroOdometry
from pilotage.stack.localization.landmark_filter import SIGHTING_COLUMNS
from pilotage.stack.localization.localizer import LOCALIZERS, require_initial_pose
from pilotage.stack.localization.odometry_prediction import OdometryBelief, OdometryPrediction
from pilotage.stack.localization.odometry_watch import (
    LINEAR_RAD,
    OdometryWatch,
    add_variances,
)
from pilotage.stack.localization.self_check import NOISE_SHARE, SelfCheck

NAME = "invariant-ekf-landmarks"
NOTHING = np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0)
LEAST_VAR = 1e-12
"""Of each coordinate (m^2) and the heading (rad^2) at the start, of a range and a bearing."""


class InvariantEkfConfig(Config):
    """The share of true sightings that the gate lets through; noise left out is the data sheet's."""

    gate: float = Field(default=0.9999, gt=0.0, lt=1.0)
    odometry: OdometryBelief = OdometryBelief()
    measurement_var_scale: Positive = 1.0
    odometry_var_scale: Positive = 1.0
    """Factors on the variances, for experiments with a filter that is wrong about its noise."""


@LOCALIZERS.add(NAME, InvariantEkfConfig)
class InvariantEkfLocalizer:
    """Odometry moves the belief exactly, sightings correct it by an iterated update (rover report 4.3).

    Between landmarks the error is the right-invariant one on SE(2) (Barrau and Bonnabel 2017), in which
    odometry is exact; while one is in sight, range, bearing and direction about it, in which sightings are
    (``kernels.filters.polar``). Sightings refused five times in a row make it less sure, so that it comes
    back.

    The sensor sits in the base's origin. Fails where it drives over a landmark: it has no bearing there.
    """

    def __init__(
        self,
        config: InvariantEkfConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        initial: Belief,
        journal: Journal,
    ) -> None:
        require_initial_pose(initial, NAME)
        self._odometry, odometry = robot.one_sensor(WheelOdometryConfig, NAME)
        self._seer, seer = robot.one_sensor(BeaconConfig, NAME)
        if (seer.mount.x_m, seer.mount.y_m, seer.mount.theta_rad) != (0.0, 0.0, 0.0):
            raise InputError(f"{NAME}: expected the beacon sensor in the base's origin, found it elsewhere")
        if seer.range_var_m2 == 0.0 or seer.bearing_var_rad2 == 0.0:
            raise InputError(f"{NAME}: expected a beacon sensor with noise, found one without")
        self._prediction = OdometryPrediction(
            odometry, config.odometry, config.odometry_var_scale, OdometryModel.EXACT_ARC
        )
        self._motion = GyroOdometry(robot, self._odometry, self._prediction, journal)
        self._ids, self._points = chart.landmarks.by_id()
        self._known = frozenset(self._ids.tolist())
        told = config.measurement_var_scale * np.array([seer.range_var_m2, seer.bearing_var_rad2])
        self._R = np.diag(np.maximum(told, LEAST_VAR))
        self._gate_probability = config.gate
        self._gate = chi_square_quantile(config.gate, 2)
        self._expected_nis = gated_mean(self._gate, 2)
        self._state, self._cov = initial.pose.as_array(), initial.cov.copy()
        # Sightings are weighed against the inverse: a start that is told exactly is so to a micrometre.
        self._cov[np.diag_indices(3)] = np.maximum(self._cov.diagonal(), LEAST_VAR)
        self._anchor = np.full(1, -1, dtype=np.int64)
        self._mean: FloatArray = np.empty(3)
        self._spread: FloatArray = np.empty((3, 3))
        self._refused = np.zeros(1, dtype=np.int64)
        self._watch, self._check = (
            OdometryWatch(robot, odometry),
            SelfCheck(config.gate, noise_share=NOISE_SHARE),
        )
        self.belief = initial
        self._channel = journal.channel(SIGHTING_COLUMNS)

    def step(self, readings: Readings) -> Belief:
        """Predict by the odometry increment, then update by every landmark seen."""
        odometry = self._motion.increment(readings, self.belief)
        if odometry is not None:
            chord_m, aside_rad = chord(odometry.distance_m, odometry.angle_rad, odometry.lateral_m)
            distance_var, angle_var = self._prediction.variances(odometry)
            distance_var += self._prediction.lateral_variance(odometry)
            rover_filter.predict(
                self._state,
                self._cov,
                self._anchor,
                chord_m,
                aside_rad,
                odometry.angle_rad,
                distance_var,
                angle_var,
            )
        place, heading = self._watch.variances(readings.t_s, odometry, self.belief)
        if place > 0.0 or heading > 0.0:
            # The map frame's error is told at the pose's own place, where these add up as in x, y and theta.
            rover_filter.leave_anchor(self._state, self._cov, self._anchor, self._points)
            add_variances(self._cov, place, heading)
        seen = readings.by_sensor.get(self._seer)
        ids, ranges, bearings = NOTHING
        if isinstance(seen, BeaconReadings):
            ids, ranges, bearings = seen.ids, seen.ranges_m, seen.bearings_rad
            if self._anchor[0] < 0 and self._cov[2, 2] > LINEAR_RAD**2:
                self._begin_anew(ids, ranges, bearings)
                ids, ranges, bearings = NOTHING
        accepted, nis = rover_filter.update(
            self._state,
            self._cov,
            self._anchor,
            ids,
            ranges,
            bearings,
            self._ids,
            self._points,
            self._R,
            self._gate,
            self._refused,
        )
        known = sum(one in self._known for one in ids.tolist())
        self._check.tell(readings.t_s, known, accepted, nis, accepted * self._expected_nis)
        rover_filter.moments(self._state, self._cov, self._anchor, self._points, self._mean, self._spread)
        lost = self._check.lost(readings.t_s) or self._spread[2, 2] > LINEAR_RAD**2
        status = BeliefStatus.LOST if lost else BeliefStatus.LOCALIZED
        self.belief = Belief(Pose2.from_array(self._mean), self._spread.copy(), status)
        self._channel.tell(
            float(len(ids)),
            float(accepted),
            nis if accepted else math.nan,
            2.0 * accepted,
            accepted * self._expected_nis if accepted else math.nan,
            0.0 if lost else 1.0,
        )
        return self.belief

    def _begin_anew(self, ids: IntArray, ranges_m: FloatArray, bearings_rad: FloatArray) -> None:
        """Take the pose that the sightings agree on, if they do: no iteration mends an unknown heading."""
        known = np.isin(ids, self._ids)
        points = self._points[np.searchsorted(self._ids, ids[known])]
        fix = fix_from_beacons(points, ranges_m[known], bearings_rad[known], np.zeros(3), self._R)
        if fix is not None and fix.chi2 <= chi_square_quantile(self._gate_probability, fix.dof):
            self._state, self._cov, self._anchor[0] = fix.pose, fix.cov, -1
