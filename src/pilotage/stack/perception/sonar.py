"""Ultrasonic readings sorted into front, left and right, beside what the map makes one expect."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.scans import rays
from pilotage.maps.near_walls import NearWalls
from pilotage.sensors.readings import Readings, UltrasonicReading
from pilotage.sensors.ultrasonic import UltrasonicConfig

FRONT_RAD = math.radians(10.0)
"""A sensor mounted within this of straight ahead looks to the front."""


@dataclass(frozen=True, slots=True)
class SonarView:
    """Nearest returns in m; infinite where nothing was in reach.

    Attributes
    ----------
    front_m, left_m, right_m
        Nearest return to each side.
    front_unexpected_m
        Nearest return in front that the robot's map does not explain.
    left_beside_m, right_beside_m
        Lateral distance from the robot's centre of a wall parallel to the heading that would give this
        return.
    """

    front_m: float
    left_m: float
    right_m: float
    front_unexpected_m: float
    left_beside_m: float
    right_beside_m: float


class SonarRing:
    """Turns ultrasonic readings into a view of what is near.

    Parameters
    ----------
    tolerance_m
        A return nearer than the map's by more than this is unexpected.
    widening_rad
        The expected return is taken over a cone wider by this on each side, so that a wall's end at the
        edge of the cone is not taken for news.
    """

    def __init__(self, sensors: dict[str, UltrasonicConfig], tolerance_m: float, widening_rad: float) -> None:
        self._sensors = sensors
        self._tolerance_m = tolerance_m
        self._widening_rad = widening_rad

    def look(
        self,
        readings: Readings,
        pose: Pose2,
        walls: NearWalls,
        circles_m: FloatArray,
        watch_below_m: float,
    ) -> SonarView:
        """Sort one step's readings; the map is asked only about returns below ``watch_below_m``."""
        near = {"front": math.inf, "left": math.inf, "right": math.inf}
        beside = {"left": math.inf, "right": math.inf}
        unexpected = math.inf
        for name, config in self._sensors.items():
            reading = readings.by_sensor.get(name)
            if not isinstance(reading, UltrasonicReading) or reading.saturated:
                continue
            look = config.mount.theta_rad
            side = "front" if abs(look) <= FRONT_RAD else ("left" if look > 0.0 else "right")
            near[side] = min(near[side], reading.range_m)
            if side == "front":
                if reading.range_m < watch_below_m and reading.range_m < unexpected:
                    expected = self._expected(config, pose, walls, circles_m, watch_below_m)
                    if reading.range_m < expected - self._tolerance_m:
                        unexpected = reading.range_m
                continue
            # A wall parallel to the heading is met first by the cone's outer edge.
            outer = abs(look) + 0.5 * config.cone_rad
            lateral = reading.range_m * math.sin(min(outer, 0.5 * math.pi)) + abs(config.mount.y_m)
            beside[side] = min(beside[side], lateral)
        return SonarView(
            near["front"], near["left"], near["right"], unexpected, beside["left"], beside["right"]
        )

    def _expected(
        self,
        config: UltrasonicConfig,
        pose: Pose2,
        walls: NearWalls,
        circles_m: FloatArray,
        watch_below_m: float,
    ) -> float:
        """The return that the map makes one expect; exact where it can make a watched one unexpected."""
        at = pose.compose(config.mount.pose)
        return float(
            rays.cone_range(
                at.x_m,
                at.y_m,
                pose.theta_rad + config.mount.theta_rad,
                min(0.5 * config.cone_rad + self._widening_rad, 0.49 * math.pi),
                walls.near(at.x_m, at.y_m, watch_below_m + self._tolerance_m),
                circles_m,
            )
        )
