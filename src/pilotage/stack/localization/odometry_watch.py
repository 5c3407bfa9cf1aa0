"""Odometry that does not arrive, or cannot be: by how much farther off the robot may be then."""

from __future__ import annotations

import math

from pilotage.core.types import FloatArray
from pilotage.sensors.readings import OdometryIncrement
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.knowledge import RobotKnowledge

TURN_SHARE = 0.5
"""Standard deviation of an unknown turn rate over the top one; speeds are held at the top, turns are not."""
TOO_FAST = 1.5
"""A mean speed beyond so many times the top one was not driven."""
STANDS_M, TURN_AS_PATH_M = 0.001, 0.5
"""Who moved less since the last scan stands; a turn of one radian counts as so much path."""
LINEAR_RAD = 0.5
"""Beyond this standard deviation of the heading no sighting is linear, and the robot not localized."""
MOST_HEADING_VAR = math.pi**2 / 3.0
"""Of a heading of which nothing is known."""


class OdometryWatch:
    """Widens a belief by what the robot could have driven while its odometry was silent.

    It may have stood, or gone on at its top speed, which stays what it is: the place then has the variance
    (speed t)^2 after a time t, whatever the direction. The time begins anew whenever other sensors have found
    the robot as well as one silent step alone could hide it: what it drove until then is known. An increment
    that the motion cannot have made is as uncertain as it is long. Readings that come in time and can be
    change nothing.
    """

    def __init__(self, robot: RobotKnowledge, sensor: WheelOdometryConfig) -> None:
        self._period_s = max(1.0 / sensor.rate_hz, robot.dt_s)
        self._top_m_s = robot.motion.top_speed_m_s
        self._turn_rad_s = TURN_SHARE * robot.motion.top_turn_rate_rad_s
        self._dt_s = robot.dt_s
        self._last_s: float | None = None  # from the first step on: when the last reading came
        self._from_s = self._widened_s = self._now_s = 0.0

    def variances(
        self, t_s: float, odometry: OdometryIncrement | None, belief: Belief
    ) -> tuple[float, float]:
        """What a step adds to the variances of each coordinate (m^2) and of the heading (rad^2).

        Parameters
        ----------
        belief
            After the last step.
        """
        if self._last_s is None:
            self._last_s = self._from_s = self._now_s = t_s - self._dt_s
        before_s, self._now_s = self._now_s, t_s
        if odometry is None:
            if t_s - self._last_s < self._period_s - 0.5 * self._dt_s:
                return 0.0, 0.0
            if self._widened_s > 0.0 and is_as_sure(belief, self._top_m_s, self._turn_rad_s, self._dt_s):
                self._from_s, self._widened_s = before_s, 0.0
            since_s = t_s - self._from_s
            square = since_s**2 - self._widened_s**2
            self._widened_s = since_s
            return self._top_m_s**2 * square, self._turn_rad_s**2 * square
        since_s = max(t_s - self._last_s, self._period_s)
        self._last_s, self._from_s, self._widened_s = t_s, t_s, 0.0
        far = math.hypot(odometry.distance_m, odometry.lateral_m) > TOO_FAST * self._top_m_s * since_s
        spun = abs(odometry.angle_rad) > TOO_FAST * self._turn_rad_s / TURN_SHARE * since_s
        if not (far or spun):
            return 0.0, 0.0
        # Who claims to have driven so far cannot be believed in the other either.
        place = odometry.distance_m**2 + odometry.lateral_m**2
        return max(place, (self._top_m_s * since_s) ** 2), odometry.angle_rad**2

    def widen(self, cov: FloatArray, t_s: float, odometry: OdometryIncrement | None, belief: Belief) -> bool:
        """Add a step's variances to the covariance of a pose, which comes first in ``cov`` (N, N); returns
        whether there were any."""
        place, heading = self.variances(t_s, odometry, belief)
        if place == 0.0 and heading == 0.0:
            return False
        add_variances(cov, place, heading)
        return True


def is_as_sure(belief: Belief, speed_m_s: float, turn_rate_rad_s: float, dt_s: float) -> bool:
    """Whether a belief is as sure as one step at speeds that are not known would leave it, or surer."""
    (xx, _, _), (_, yy, _), (_, _, heading) = belief.cov.tolist()
    return (
        belief.status is BeliefStatus.LOCALIZED
        and max(xx, yy) <= (speed_m_s * dt_s) ** 2
        and heading <= (turn_rate_rad_s * dt_s) ** 2
    )


def add_variances(cov: FloatArray, place: float, heading: float) -> None:
    """Add to the variances of each coordinate (m^2) and the heading (rad^2), first in ``cov`` (N, N)."""
    cov[0, 0] += place
    cov[1, 1] += place
    cov[2, 2] += min(heading, max(MOST_HEADING_VAR - float(cov[2, 2]), 0.0))


def increment_of(reading: object) -> OdometryIncrement | None:
    """A reading of the odometry; None where there is none."""
    return reading if isinstance(reading, OdometryIncrement) else None
