"""Values that cross rooms: frozen, slotted, in SI units (see DESIGN conventions: x, y, theta)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray

__all__ = [
    "STANDSTILL",
    "STOP",
    "BoolArray",
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


@dataclass(frozen=True, slots=True)
class Twist:
    """A planar velocity in the body frame: forward speed and turn rate."""

    v_m_s: float
    w_rad_s: float


STOP = Twist(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class WheelSpeeds:
    """Turn rates of the two wheels of a differential drive."""

    left_rad_s: float
    right_rad_s: float


STANDSTILL = WheelSpeeds(0.0, 0.0)


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
