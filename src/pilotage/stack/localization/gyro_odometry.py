"""Wheel odometry whose turns a gyroscope corrects, for every localizer that predicts by increments."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.chi_square import chi_square_quantile
from pilotage.kernels.filters import heading
from pilotage.sensors.gyroscope import GyroscopeConfig
from pilotage.sensors.imu import ImuConfig
from pilotage.sensors.readings import GyroscopeRates, OdometryIncrement, Readings, YawRate
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.odometry_prediction import OdometryPrediction
from pilotage.stack.localization.odometry_watch import increment_of

COLUMNS = {"gyro_bias_rad_s": "rad/s", "gyro_bias_std_rad_s": "rad/s"}
"""Of the trace, where a gyroscope is used: its bias as believed, and the standard deviation."""
GATE_PROBABILITY = 0.9999
"""Wheels and gyroscope that differ by more do not both say what the robot did."""
MOST_DISAGREEING_S = 1.0
"""Wheels slip for a moment; differing for longer, the gyroscope's bias is another than believed."""
SAMPLED = 0.01
"""Share of its variance by which a cloud of particles may miss its own mean, a few hundred of them."""
ONE_TURN_RAD = 2.0 * math.pi
"""A scale error is the same in all steps of a turn: so far its errors count as one."""


class GyroOdometry:
    """Odometry increments, their turns corrected by a gyroscope where the robot carries one.

    Heading and gyroscope bias are two states with a joint covariance (``kernels.filters.heading``): wheels
    predict the turn, the gyroscope corrects it. The bias is learnt from the wheels, most of all while they
    rest (zero-velocity update), and from the localizer: what it corrects the heading by tells of the bias as
    much as the two are correlated, b += P_hb / P_hh (h+ - h-) (the step of a Rauch-Tung-Striebel smoother;
    Bar-Shalom et al. 2001, sect. 8.6). So the localizer need not know of the bias: an increment tells its own
    variance, which is what the heading's grows by, the bias' share with it.

    Of several gyroscopes the one with the least noise is used. Without one, or with
    ``odometry.gyroscope: false``, increments are the wheels' own, untouched.

    Fails where wheels and gyroscope err alike, and where the robot leans: the rate is taken to be about the
    vertical. Wheels that slip for longer than a second are told from a new bias by nothing, and are
    believed.
    """

    def __init__(
        self, robot: RobotKnowledge, odometry: str, prediction: OdometryPrediction, journal: Journal
    ) -> None:
        self._odometry, self._wheel_variances, self._dt_s = odometry, prediction.variances, robot.dt_s
        found: dict[str, GyroscopeConfig | ImuConfig] = {}
        if prediction.with_gyroscope:
            found = {**robot.sensors_of(GyroscopeConfig), **robot.sensors_of(ImuConfig)}
        self._name = min(found, key=lambda name: _density(found[name])) if found else None
        if self._name is None:
            return
        sheet = found[self._name]
        self._sheet, self._rate_var = sheet, _density(sheet)
        self._bias_var = sheet.bias_rad_s**2
        self._state, self._P = np.zeros(2), np.diag([0.0, self._bias_var])
        self._last_s: float | None = None
        self._disagreed_s = 0.0
        self._gate = chi_square_quantile(GATE_PROBABILITY, 1)
        self._begin()
        self._channel = journal.channel(COLUMNS)
        self._tell()

    @property
    def bias_rad_s(self) -> tuple[float, float] | None:
        """The gyroscope's bias and its variance (rad^2/s^2); None without a gyroscope."""
        return None if self._name is None else (float(self._state[1]), float(self._P[1, 1]))

    def increment(self, readings: Readings, belief: Belief) -> OdometryIncrement | None:
        """What the robot moved since the last increment; None where the wheels said nothing.

        Parameters
        ----------
        readings
            Of this step.
        belief
            The localizer's, after the last step.
        """
        odometry = increment_of(readings.by_sensor.get(self._odometry))
        if self._name is None:
            return odometry
        dt_s = self._dt_s if self._last_s is None else readings.t_s - self._last_s
        self._last_s = readings.t_s
        self._learn(belief)
        self._P[1, 1] += self._sheet.bias_walk_rad_s_sqrt_s**2 * max(dt_s, 0.0)
        self._since_s += dt_s
        fresh = self._hear(readings, dt_s)
        if odometry is None:
            return None
        # A gyroscope that missed a moment says nothing about the turn since the last increment.
        covered = abs(self._heard_s - self._since_s) < 0.5 * self._dt_s
        if fresh and covered:
            odometry = self._corrected(odometry)
        else:
            self._by_wheels(odometry.angle_rad, self._wheel_variances(odometry)[1])
        if fresh or self._since_s > MOST_DISAGREEING_S:
            self._begin()
        self._tell()
        return odometry

    def _begin(self) -> None:
        """Begin a stretch that wheels and gyroscope will both have told of."""
        self._since_s = self._heard_s = self._heard_rad = 0.0
        self._wheels_rad = self._wheels_var = self._wheels_cov = 0.0

    def _hear(self, readings: Readings, dt_s: float) -> bool:
        """Add what the gyroscope said; returns whether it did."""
        reading = readings.by_sensor.get(self._name or "")
        if isinstance(reading, GyroscopeRates) and reading.rates_rad_s.size:
            rate, over_s = float(reading.rates_rad_s.mean()), dt_s
        elif isinstance(reading, YawRate):
            rate, over_s = reading.rate_rad_s, 1.0 / self._sheet.rate_hz
        else:
            return False
        if not math.isfinite(rate):
            return False
        self._heard_rad += rate * over_s
        self._heard_s += over_s
        return True

    def _learn(self, belief: Belief) -> None:
        """Take over the localizer's heading, and learn the bias from how it corrected it."""
        P, state = self._P, self._state
        before, after = float(P[0, 0]), float(belief.cov[2, 2])
        step = wrap_to_pi(belief.pose.theta_rad - float(state[0]))
        corrected = max(before - after, 0.0) + SAMPLED * before
        if belief.status is BeliefStatus.LOST or step * step > self._gate * corrected:
            # Of a heading that was found otherwise than by correcting this one it says nothing.
            P[0, 1] = P[1, 0] = self._wheels_cov = 0.0
        elif after < before:
            gain = float(P[0, 1]) / before
            state[1] += gain * step
            P[1, 1] -= gain * gain * (before - after)
            P[0, 1] = P[1, 0] = gain * after
            self._wheels_cov *= after / before
        state[0], P[0, 0] = belief.pose.theta_rad, after

    def _by_wheels(self, turn_rad: float, var: float) -> None:
        """Predict by the wheels; the gyroscope's word is still to come, or never will."""
        self._wheels_rad += turn_rad
        self._wheels_var += var
        self._wheels_cov += var
        self._state[0] = wrap_to_pi(self._state[0] + turn_rad)
        self._P[0, 0] += var

    def _corrected(self, odometry: OdometryIncrement) -> OdometryIncrement:
        """The increment with the turn that wheels and gyroscope make together, and its variance."""
        over_s, wheels, before = self._since_s, odometry.angle_rad, float(self._P[0, 0])
        bias, bias_var = float(self._state[1]), float(self._P[1, 1])
        wheels_var = self._wheels_var_of(odometry, self._heard_rad - bias * over_s - self._wheels_rad)
        apart = self._heard_rad - self._wheels_rad - wheels - bias * over_s
        scale = getattr(self._sheet, "scale_error", 0.0)
        gyro_var = self._rate_var * over_s + scale * scale * abs(self._heard_rad) * ONE_TURN_RAD
        least = 0.0
        if apart * apart > self._gate * (self._wheels_var + wheels_var + gyro_var + bias_var * over_s**2):
            # One of them is wrong by so much. Wheels slip, or missed a moment; a gyroscope rarely does.
            wheels_var = least = apart * apart
            self._disagreed_s += over_s
            if self._disagreed_s > MOST_DISAGREEING_S:
                self._begin_anew(apart / over_s)
                apart = 0.0
        else:
            self._disagreed_s = 0.0
        self._by_wheels(wheels, wheels_var)
        var = self._wheels_var + gyro_var + float(self._P[1, 1]) * over_s**2
        turned = heading.correct_by_gyro(self._state, self._P, apart, over_s, self._wheels_cov, var)
        told = max(least, float(self._P[0, 0]) - before, 0.0)
        self._P[0, 0] = before + told
        part_var = (*odometry.part_var[:2], 0.0)  # that of the turn is within
        return replace(odometry, angle_rad=wheels + turned, angle_var_rad2=told, part_var=part_var)

    def _wheels_var_of(self, odometry: OdometryIncrement, turn_rad: float) -> float:
        """Variance of the wheels' turn, by the turn that the gyroscope tells of.

        By the wheels' own it would be small whenever their error happens to take the turn away, and what they
        say then would weigh most.
        """
        if odometry.angle_rad == 0.0 and odometry.distance_m == 0.0:
            return 0.0
        return self._wheel_variances(replace(odometry, angle_rad=turn_rad))[1]

    def _begin_anew(self, off_rad_s: float) -> None:
        """Believe in another bias, by all that is known wrong by as much as it is off."""
        self._state[1] += off_rad_s
        self._P[1, 1] = max(self._bias_var, off_rad_s**2)
        self._P[0, 1] = self._P[1, 0] = 0.0
        self._disagreed_s = 0.0

    def _tell(self) -> None:
        self._channel.tell(float(self._state[1]), math.sqrt(max(float(self._P[1, 1]), 0.0)))


def _density(sheet: GyroscopeConfig | ImuConfig) -> float:
    """Variance per second (rad^2/s) of the integrated angle: readings are white at the sensor's rate."""
    return sheet.rate_std_rad_s**2 / sheet.rate_hz
