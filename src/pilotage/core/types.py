"""Values that cross rooms: frozen, slotted, in SI units (see DESIGN conventions: x, y, theta)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]


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
