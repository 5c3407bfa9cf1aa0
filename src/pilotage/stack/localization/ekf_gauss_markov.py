"""The EKF for real drives and sensors: their Gauss-Markov errors are part of its state."""

from __future__ import annotations

import math
from collections import deque
from itertools import chain

import numpy as np

from pilotage.core.chi_square import chi_square_quantile, gated_mean
from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.filters import ekf, gauss_markov
from pilotage.kernels.filters.sighting import OUTCOME_ACCEPTED, OUTCOME_GATED, Seen, landmark_index
from pilotage.maps.world_map import WorldMap
from pilotage.models.odometry import OdometryModel
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.readings import BeaconReadings, OdometryIncrement, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.gauss_markov_config import (
    EkfGaussMarkovConfig,
    GaussMarkovError,
    LandmarkError,
)
from pilotage.stack.localization.landmark_filter import (
    MEASUREMENT_DOF,
    SIGHTING_COLUMNS,
    known_landmarks,
    reading_variances,
)
from pilotage.stack.localization.localizer import LOCALIZERS, require_initial_pose
from pilotage.stack.localization.odometry_prediction import OdometryPrediction
from pilotage.stack.localization.odometry_watch import MOST_HEADING_VAR, OdometryWatch, is_as_sure
from pilotage.stack.localization.recent_sightings import RecentSightings
from pilotage.stack.localization.self_check import NOISE_SHARE, SelfCheck

NAME = "ekf-gauss-markov"

TYPICAL_RANGE_M = 3.0
TELEMETRY = {
    "speed_error": gauss_markov.SPEED,
    "turn_error": gauss_markov.TURN,
    "speed_offset_m_s": gauss_markov.SPEED_OFFSET,
    "turn_offset_rad_s": gauss_markov.TURN_OFFSET,
    "course_rad": gauss_markov.COURSE,
    "bearing_offset_rad": gauss_markov.BEARING,
    "range_error": gauss_markov.SCALE,
    "range_offset_m": gauss_markov.OFFSET,
    "mount_ahead_m": gauss_markov.AHEAD,
    "mount_left_m": gauss_markov.LEFT,
    "age_error_s": gauss_markov.AGE,
    "axis_rad": gauss_markov.AXIS,
}
"""Names of the errors in a trace; each has a standard deviation beside it."""
PLACES = slice(gauss_markov.SPEED, gauss_markov.LANDMARKS)
"""Of these in the state, in that order."""
UNITS = {"_m_s": "m/s", "_rad_s": "rad/s", "_rad": "rad", "_m": "m", "_s": "s"}
COLUMNS = {
    **SIGHTING_COLUMNS,
    "recoveries": "1",
    **{
        column: next((unit for ending, unit in UNITS.items() if name.endswith(ending)), "1")
        for name in TELEMETRY
        for column in (name, f"{name}_std")
    },
}
"""Beacons seen and accepted, their NIS, recoveries so far, and the errors as believed."""
DOUBTED = (gauss_markov.SPEED, gauss_markov.TURN, gauss_markov.AGE)
"""What another drive than the expected one has otherwise."""


@LOCALIZERS.add(NAME, EkfGaussMarkovConfig)
class EkfGaussMarkovLocalizer:
    """Extended Kalman filter with the Gauss-Markov errors of drive and sensor in its state.

    State augmentation (Bar-Shalom et al. 2001, sect. 11.9): what stays the same from one reading to the
    next does not average out, and a filter that takes it for white noise becomes overconfident. Known
    correspondences, each landmark through a chi-square gate; after several rejections the pose is
    trusted less until readings pass again.

    Fails where landmarks are out of sight for minutes (it is dead reckoning then), or where most readings
    carry a wrong identity.
    """

    def __init__(
        self,
        config: EkfGaussMarkovConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        initial: Belief,
        journal: Journal,
    ) -> None:
        require_initial_pose(initial, NAME)
        self._config = config
        self._odometry, odometry = robot.one_sensor(WheelOdometryConfig, NAME)
        self._beacons, beacons = robot.one_sensor(BeaconConfig, NAME)
        self._known = known_landmarks(chart, NAME)
        self._noise = OdometryPrediction(odometry, config.odometry, 1.0, OdometryModel.EXACT_ARC)
        self._mount = np.array([*beacons.mount.as_array(), config.reading_age_s])
        range_var, bearing_var = reading_variances(
            beacons, config.range_var_m2, config.bearing_var_rad2, NAME
        )
        self._white = np.array([range_var, config.range_var_fraction, bearing_var, config.across_var_m2])
        along, across = config.landmark_range_error, config.landmark_bearing_error
        self._scales = np.array([along.std, along.std_m, across.std, across.std_m])
        self._gate = chi_square_quantile(config.gate, MEASUREMENT_DOF)
        self._expected_nis = gated_mean(self._gate, MEASUREMENT_DOF)
        errors: list[GaussMarkovError] = [
            config.speed_error,
            config.turn_error,
            config.speed_offset_m_s,
            config.turn_offset_rad_s,
            config.course_rad,
            config.bearing_rad,
            config.range_error,
            config.range_offset_m,
            config.mount_ahead_m,
            config.mount_left_m,
            config.age_error_s,
            config.axis_rad,
        ]
        count = len(self._known.ids)
        # A landmark's errors are kept in units of their standard deviations.
        self._stationary = np.array([0.0] * 3 + [error.std**2 for error in errors] + [1.0] * (2 * count))
        constant = [[1.0 / error.time_constant_s, 0.0, 0.0] for error in errors]
        self._fading = np.array(
            [[0.0] * 3] * 3 + constant + [_fading(along)] * count + [_fading(across)] * count
        )
        self._state = np.concatenate([initial.pose.as_array(), np.zeros(len(errors) + 2 * count)])
        self._cov = np.diag(self._stationary)
        self._cov[:3, :3] = initial.cov
        floor = [config.recovery_position_std_m] * 2 + [config.recovery_heading_std_rad]
        self._floor: FloatArray = np.array(floor) ** 2
        self._pending: deque[tuple[float, float, float, float, float]] = deque()
        self._unlogged_s = 0.0
        self._recent = RecentSightings()
        self._t_s: float | None = None
        self._dt_s = robot.dt_s
        self._motion = np.zeros(2)
        self._rejections = self.recoveries = 0
        self._recovered_s, self._doubt = -math.inf, 1.0
        top = robot.motion.top_speed_m_s, robot.motion.top_turn_rate_rad_s
        unlogged = config.unlogged_speed_m_s, config.unlogged_turn_rate_rad_s
        self._unlogged = tuple(most if own is None else own for own, most in zip(unlogged, top, strict=True))
        self._watch, self._check = (
            OdometryWatch(robot, odometry),
            SelfCheck(config.gate, noise_share=NOISE_SHARE),
        )
        self.belief = initial
        self._telemetry = journal.channel(COLUMNS)

    def step(self, readings: Readings) -> Belief:
        """Move by what the odometry said ``delay_s`` ago, then update by every landmark seen."""
        last = readings.t_s - self._dt_s if self._t_s is None else self._t_s
        self._t_s = readings.t_s
        odometry = readings.by_sensor.get(self._odometry)
        if isinstance(odometry, OdometryIncrement):
            # What is missing is told below; here speaks what came and cannot be.
            self._watch.widen(self._cov, readings.t_s, odometry, self.belief)
        if isinstance(odometry, OdometryIncrement) and readings.t_s > last:
            moved = odometry.distance_m, odometry.angle_rad, odometry.lateral_m
            self._pending.append((last, readings.t_s, *moved))
        self._move(last, readings.t_s)
        seen = readings.by_sensor.get(self._beacons)
        if isinstance(seen, BeaconReadings):
            self._update(seen)
        else:
            self._tell(0, 0, 0.0)
        status = BeliefStatus.LOST if self._lost else BeliefStatus.LOCALIZED
        self.belief = Belief(Pose2.from_array(self._state), self._cov[:3, :3].copy(), status)
        return self.belief

    @property
    def _lost(self) -> bool:
        """Whether the filter has reason not to be believed, or knows its heading too little to go on."""
        blind = bool(self._cov[2, 2] > self._config.fix_heading_std_rad**2)
        return blind or self._check.lost(self._t_s or 0.0)

    def _move(self, begin_s: float, end_s: float) -> None:
        """Predict from ``begin_s`` to ``end_s`` by the increments that act in between."""
        delay = self._config.commands.delay_s
        at = begin_s
        while at < end_s:
            while self._pending and self._pending[0][1] + delay <= at + 1e-9:
                self._pending.popleft()
            if not self._pending or self._pending[0][0] + delay >= end_s:
                self._wonder(end_s - at)
                return
            start, stop, distance, angle, lateral = self._pending[0]
            if start + delay > at + 1e-9:
                self._wonder(start + delay - at)
                at = start + delay
                continue
            self._unlogged_s = 0.0
            until = min(stop + delay, end_s)
            share = (until - at) / (stop - start)
            self._predict(share * distance, share * angle, until - at, share * lateral)
            at = until

    def _wonder(self, dt_s: float) -> None:
        """Nothing is known to act: the robot may stand, or go on at a speed that stays unknown.

        Its place then has the variance (speed t)^2, which grows by speed^2 (2 t + dt) dt. What it did until
        its landmarks found it last is known: the time begins anew there.
        """
        if self._unlogged_s > 0.0 and is_as_sure(
            self.belief, self._unlogged[0], self._unlogged[1], self._dt_s
        ):
            self._unlogged_s = 0.0
        self._predict(0.0, 0.0, dt_s)
        self._recent.forget()
        growth = (2.0 * self._unlogged_s + dt_s) * dt_s
        self._unlogged_s += dt_s
        place = self._unlogged[0] ** 2 * growth
        heading = self._unlogged[1] ** 2 * growth
        heading = min(heading, max(MOST_HEADING_VAR - self._cov[2, 2], 0.0))
        gauss_markov.inflate(self._cov, 1.0, np.array([place, place, heading]))

    def _predict(self, distance: float, angle: float, dt_s: float, lateral: float = 0.0) -> None:
        if dt_s <= 0.0:
            return
        config, commands = self._config, self._config.commands
        claimed_rate = min(abs(angle) / dt_s, commands.loss_up_to_rad_s)
        gain = max(commands.speed_gain - commands.speed_loss_per_rad_s * claimed_rate, 0.0)
        moved = gain * distance
        turned = commands.turn_gain * angle + commands.bend_rad_per_m * moved
        distance_var, angle_var = self._noise.variances_of(moved, turned)
        gauss_markov.predict(
            self._state,
            self._cov,
            moved,
            turned,
            dt_s,
            distance_var + config.distance_var_m2_per_s * dt_s,
            angle_var + config.angle_var_rad2_per_s * dt_s,
            self._fading,
            self._stationary,
        )
        state = self._state
        if lateral != 0.0:  # its errors are not among the states
            variance = self._noise.lateral_variance(OdometryIncrement(0.0, 0.0, lateral))
            ekf.predict_sideways(state, self._cov, lateral, turned, variance, True)
        self._recent.move(moved, lateral, turned, self._t_s or 0.0)
        self._motion[0] = moved / dt_s * (1.0 + state[gauss_markov.SPEED]) + state[gauss_markov.SPEED_OFFSET]
        self._motion[1] = turned / dt_s * (1.0 + state[gauss_markov.TURN]) + state[gauss_markov.TURN_OFFSET]

    def _update(self, seen: BeaconReadings) -> None:
        config, count = self._config, seen.ids.shape[0]
        self._remember(seen)
        if self._cov[2, 2] > config.fix_heading_std_rad**2:
            self._begin_anew(least_landmarks=2)
            self._tell(count, 0, 0.0)
            return
        used, nis, outcome = gauss_markov.update_range_bearings(
            self._state,
            self._cov,
            Seen(seen.ids, seen.ranges_m / config.range_scale, seen.bearings_rad),
            self._known,
            self._mount,
            self._motion,
            self._scales,
            config.depth_power,
            self._white,
            self._gate,
        )
        total = float(nis[outcome == OUTCOME_ACCEPTED].sum())
        self._check.tell(self._t_s or 0.0, int((outcome >= 0).sum()), used, total, used * self._expected_nis)
        for result in outcome:
            if result == OUTCOME_ACCEPTED:
                self._rejections = max(0, self._rejections - 1)
            elif result == OUTCOME_GATED:
                self._rejections += 1
        if self._rejections >= config.recovery_rejections:
            gauss_markov.inflate(self._cov, config.recovery_factor, self._floor)
            self._rejections = 0
            self.recoveries += 1
            self._doubt_the_drive()
            # Three landmarks that agree on a place have a word against the filter; two may be mistaken.
            self._begin_anew(least_landmarks=3)
        self._tell(count, used, total)

    def _doubt_the_drive(self) -> None:
        """Recovery after recovery: the drive is another than expected, so its errors may be larger.

        The stationary variance grows by f^2, the time constant alike: what drives a Gauss-Markov process,
        2 variance / time constant, stays the same.
        """
        config, now = self._config, self._t_s or 0.0
        again, self._recovered_s = now - self._recovered_s <= config.doubt_within_s, now
        factor = min(config.doubt_factor, config.doubt_limit / self._doubt)
        if not again or factor <= 1.0:
            return
        self._doubt *= factor
        for place in DOUBTED:
            wider = factor**2 * self._stationary[place]
            self._cov[place, place] += wider - self._stationary[place]
            self._stationary[place] = wider
            self._fading[place] /= factor**2

    def _remember(self, seen: BeaconReadings) -> None:
        config = self._config
        for landmark, range_m, bearing in zip(seen.ids, seen.ranges_m, seen.bearings_rad, strict=True):
            row = landmark_index(self._known.ids, landmark)
            if row >= 0:
                reading = gauss_markov.range_of_depth(
                    range_m / config.range_scale, bearing, config.depth_power
                )
                self._recent.add(self._t_s or 0.0, row, reading, bearing, self._mount)

    def _begin_anew(self, least_landmarks: int) -> None:
        """Take the pose that the last seconds' landmarks agree on; the errors stay as believed."""
        fix = self._recent.fix(self._known.points, self._reading_cov(), least_landmarks)
        if fix is None or fix.chi2 > chi_square_quantile(self._config.gate, fix.dof):
            return
        self._state[:3] = fix.pose
        self._cov[:3, :], self._cov[:, :3] = 0.0, 0.0
        self._cov[:3, :3] = fix.cov
        self._rejections = 0
        self._recent.forget()

    def _reading_cov(self) -> FloatArray:
        """(2, 2) of range and bearing at `TYPICAL_RANGE_M`, white and slow together."""
        r2 = TYPICAL_RANGE_M**2
        white, scales, slow = self._white, self._scales**2, self._stationary
        along = white[0] + scales[1] + slow[gauss_markov.OFFSET]
        along += (white[1] + scales[0] + slow[gauss_markov.SCALE]) * r2
        across = white[2] + scales[2] + slow[gauss_markov.BEARING] + (white[3] + scales[3]) / r2
        return np.diag([along, across])

    def _tell(self, seen: int, accepted: int, nis: float) -> None:
        errors = self._state[PLACES].tolist()
        stds = np.sqrt(np.maximum(self._cov.diagonal()[PLACES], 0.0)).tolist()
        self._telemetry.tell(
            seen,
            accepted,
            nis if accepted else math.nan,
            MEASUREMENT_DOF * accepted,
            accepted * self._expected_nis if accepted else math.nan,
            0.0 if self._lost else 1.0,
            self.recoveries,
            *chain.from_iterable(zip(errors, stds, strict=True)),
        )


def _fading(error: LandmarkError) -> list[float]:
    return [1.0 / error.time_constant_s, 1.0 / error.length_m, 1.0 / error.angle_rad]
