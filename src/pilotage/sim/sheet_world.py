"""The sheet as it is: boxes, tape, an edge; and the robot that is on it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.maps.true_cells import SheetFile
from pilotage.missions.sheet import DriveErrorsConfig, WheelDriveConfig


@dataclass(frozen=True, slots=True)
class SheetWorld:
    """Truth about the surroundings.

    Attributes
    ----------
    size_m
        Width and height of the sheet; its lower left corner is the origin.
    boxes_m
        (K, 4) x0, y0, x1, y1.
    lines_m
        (M, 4) pieces of the tapes' centre lines.
    """

    size_m: tuple[float, float]
    boxes_m: FloatArray
    lines_m: FloatArray
    tape_width_m: float
    floor_is_dark: bool

    @staticmethod
    def of(sheet: SheetFile, tape_width_m: float, floor_is_dark: bool) -> SheetWorld:
        """Build from a sheet's file."""
        boxes = [(min(a, c), min(b, d), max(a, c), max(b, d)) for a, b, c, d in sheet.obstacles]
        pieces = [(*start, *end) for line in sheet.lines for start, end in pairwise(line)]
        return SheetWorld(
            sheet.size_m,
            np.array(boxes, dtype=np.float64).reshape(-1, 4),
            np.array(pieces, dtype=np.float64).reshape(-1, 4),
            tape_width_m,
            floor_is_dark,
        )

    def holds(self, x_m: float, y_m: float) -> bool:
        """Whether a point is on the sheet."""
        return 0.0 <= x_m <= self.size_m[0] and 0.0 <= y_m <= self.size_m[1]

    def overhang_m(self, x_m: float, y_m: float, radius_m: float) -> float:
        """How far a disc reaches over the sheet's edge; 0 where it is on the sheet."""
        width, height = self.size_m
        inside = min(x_m, width - x_m, y_m, height - y_m)
        return max(radius_m - inside, 0.0)


def true_drive(motion: WheelDriveConfig, errors: DriveErrorsConfig, rng: np.random.Generator) -> FloatArray:
    """The robot's true parameters, drawn as ``DriveErrorsConfig`` says; see ``kernels.wheel_drive``."""
    larger_left, wider = rng.choice([-1.0, 1.0], 2)
    half = 0.5 * errors.radius_difference * larger_left
    separation = wider * rng.uniform(*errors.separation_error)
    slip_left, slip_right = rng.uniform(*errors.slip, size=2)
    return np.array(
        [
            motion.wheel_radius_m * (1.0 + half),
            motion.wheel_radius_m * (1.0 - half),
            motion.wheel_separation_m * (1.0 + separation),
            slip_left,
            slip_right,
            errors.slip_std_m_sqrt_m,
            motion.motor_lag_s,
        ]
    )


def field_angle(x_m: float, y_m: float, length_m: float, phases: FloatArray) -> tuple[float, float]:
    """A smooth disturbance over the floor: two components in [-1, 1] of a few plane waves."""
    k = 2.0 * math.pi / length_m
    east = math.sin(k * x_m + phases[0]) * math.cos(k * y_m + phases[1])
    north = math.sin(k * y_m + phases[2]) * math.cos(k * x_m + phases[3])
    return east, north
