"""Values that cross rooms: frozen, slotted, in SI units (see DESIGN conventions: x, y, theta)."""

from __future__ import annotations

import math
import numbers
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray

__all__ = [
    "STANDSTILL",
    "STOP",
    "BoolArray",
    "Command",
    "Event",
    "FloatArray",
    "Goal",
    "IntArray",
    "Pose2",
    "Twist",
    "WheelSpeeds",
]


@dataclass(frozen=True, slots=True)
class Pose2:
    """A planar pose: position in metres, heading in radians in [-pi, pi), counter-clockwise."""

    x_m: float
    y_m: float
    theta_rad: float

    def as_array(self) -> FloatArray:
        """Return (3,) x, y, theta."""
        return np.array([self.x_m, self.y_m, self.theta_rad])

    @staticmethod
    def from_array(values: FloatArray) -> Pose2:
        """Build from (3,) x, y, theta."""
        return Pose2(float(values[0]), float(values[1]), float(values[2]))

    def compose(self, inner: Pose2) -> Pose2:
        """The pose, in this one's parent frame, of what ``inner`` says in this one's own: self (+) inner.

        The only place where frames are joined (Smith, Self and Cheeseman 1990, eq. 17).
        """
        c, s = math.cos(self.theta_rad), math.sin(self.theta_rad)
        return Pose2(
            self.x_m + c * inner.x_m - s * inner.y_m,
            self.y_m + s * inner.x_m + c * inner.y_m,
            _wrapped(self.theta_rad + inner.theta_rad),
        )

    def placed(self, points_m: FloatArray) -> FloatArray:
        """Points (K, 2) of this pose's frame in its parent frame."""
        c, s = math.cos(self.theta_rad), math.sin(self.theta_rad)
        return np.asarray(points_m @ np.array([[c, s], [-s, c]]) + np.array([self.x_m, self.y_m]))

    def seen(self, points_m: FloatArray) -> FloatArray:
        """Points (K, 2) of the parent frame in this pose's own: undoes ``placed``."""
        c, s = math.cos(self.theta_rad), math.sin(self.theta_rad)
        return np.asarray((points_m - np.array([self.x_m, self.y_m])) @ np.array([[c, -s], [s, c]]))

    def inverse(self) -> Pose2:
        """The parent's pose in this one's frame: ``p.compose(p.inverse())`` is the origin."""
        c, s = math.cos(self.theta_rad), math.sin(self.theta_rad)
        return Pose2(-c * self.x_m - s * self.y_m, s * self.x_m - c * self.y_m, _wrapped(-self.theta_rad))


def _wrapped(angle_rad: float) -> float:
    """To [-pi, pi)."""
    wrapped = (angle_rad + math.pi) % (2.0 * math.pi) - math.pi
    return -math.pi if wrapped >= math.pi else wrapped


@dataclass(frozen=True, slots=True)
class Twist:
    """A planar velocity in the body frame: forward speed, turn rate, speed to the left."""

    v_m_s: float
    w_rad_s: float
    lateral_m_s: float = 0.0


STOP = Twist(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class WheelSpeeds:
    """Turn rates of the two wheels of a differential drive."""

    left_rad_s: float
    right_rad_s: float


STANDSTILL = WheelSpeeds(0.0, 0.0)

Command: TypeAlias = Twist | WheelSpeeds
"""What a stack may ask of a motion; every motion follows a twist, a wheel drive wheel speeds too."""


@dataclass(frozen=True, slots=True)
class Goal:
    """Where to go; a heading of None leaves the heading free."""

    x_m: float
    y_m: float
    theta_rad: float | None = None


@dataclass(frozen=True, slots=True)
class Event:
    """Something worth telling: when, what kind (a short slug), and a sentence with its numbers."""

    t_s: float
    kind: str
    text: str

    def __post_init__(self) -> None:
        """Refuse what no record can hold, where it is told: a folder would be written that nobody reads.

        Raises
        ------
        ValueError
            For a time that is no number or infinite, and words that are no text. NaN is a time that a
            record does not tell.
        """
        texts = isinstance(self.kind, str) and isinstance(self.text, str)
        if not texts or not isinstance(self.t_s, numbers.Real) or math.isinf(self.t_s):
            found = f"{self.t_s!r}, {self.kind!r}, {self.text!r}"
            raise ValueError(f"event: expected a finite time, a kind and a text, found {found}")
