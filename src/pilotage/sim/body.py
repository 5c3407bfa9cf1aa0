"""A disc-shaped differential-drive body that follows commands within its limits and really collides."""

from __future__ import annotations

from pilotage.core.types import Pose2, Twist
from pilotage.kernels.bodies import disc
from pilotage.kernels.geometry import plane
from pilotage.maps.segment_map import SegmentMap
from pilotage.missions.floor import BodyConfig, MotionConfig

CONTACT_M = 1e-6
"""Below this clearance the body counts as touching."""


class DifferentialDriveBody:
    """Pose and speed of the robot in truth.

    Commands are limited in speed and acceleration; within a step the speed is constant, so the body
    drives an exact arc. A contact stops it and is counted once until it is clear again.
    """

    def __init__(self, body: BodyConfig, motion: MotionConfig, start: Pose2, geometry_m: SegmentMap) -> None:
        self._radius_m = body.radius_m
        self._limits = motion
        self._segments = geometry_m.segments_m
        self._circles = geometry_m.circles_m
        self._x, self._y, self._theta = start.x_m, start.y_m, start.theta_rad
        self.twist = Twist(0.0, 0.0)
        distance = plane.distance_to_nearest(self._x, self._y, self._segments, self._circles)
        self.clearance_m = float(distance) - self._radius_m
        self.collisions = 0
        self._touching = False

    @property
    def pose(self) -> Pose2:
        """The true pose."""
        return Pose2(self._x, self._y, self._theta)

    def carry_to(self, pose: Pose2) -> None:
        """Set the body down elsewhere, standing still; its wheels do not turn meanwhile."""
        self._x, self._y, self._theta = pose.x_m, pose.y_m, pose.theta_rad
        self.twist = Twist(0.0, 0.0)
        distance = plane.distance_to_nearest(self._x, self._y, self._segments, self._circles)
        self.clearance_m = float(distance) - self._radius_m
        self._touching = False

    def step(self, command: Twist, dt_s: float) -> tuple[float, float]:
        """Drive for ``dt_s``; return the distance driven along the arc and the angle turned."""
        limits = self._limits
        v = _approach(
            self.twist.v_m_s, command.v_m_s, limits.max_speed_m_s, limits.max_acceleration_m_s2 * dt_s
        )
        w = _approach(
            self.twist.w_rad_s,
            command.w_rad_s,
            limits.max_turn_rate_rad_s,
            limits.max_turn_acceleration_rad_s2 * dt_s,
        )
        self._x, self._y, self._theta, fraction, self.clearance_m = disc.advance_disc(
            self._x,
            self._y,
            self._theta,
            v * dt_s,
            w * dt_s,
            self._radius_m,
            self.clearance_m,
            self._segments,
            self._circles,
        )
        if fraction < 1.0:
            self.collisions += 0 if self._touching else 1
            self._touching = True
            self.twist = Twist(0.0, 0.0)
            return v * dt_s * fraction, w * dt_s * fraction
        self._touching = self._touching and self.clearance_m < CONTACT_M
        self.twist = Twist(v, w)
        return v * dt_s, w * dt_s


def _approach(current: float, wanted: float, limit: float, change: float) -> float:
    """Move ``current`` towards ``wanted`` by at most ``change``, within +-limit."""
    target = min(max(wanted, -limit), limit)
    return min(max(target, current - change), current + change)
