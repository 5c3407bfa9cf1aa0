"""Directions wrap to [-pi, pi); widths and fields of view are never wrapped."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray

TWO_PI = 2.0 * math.pi


def wrap_to_pi(angle_rad: float) -> float:
    """Wrap one direction to [-pi, pi)."""
    wrapped = (angle_rad + math.pi) % TWO_PI - math.pi
    # The modulo of a tiny negative number rounds up to 2 pi itself.
    return -math.pi if wrapped >= math.pi else wrapped


def wrap_array_to_pi(angles_rad: FloatArray) -> FloatArray:
    """Wrap directions of any shape to [-pi, pi)."""
    wrapped = np.mod(angles_rad + math.pi, TWO_PI) - math.pi
    return np.where(wrapped >= math.pi, -math.pi, wrapped)
