"""What each of the small robot's slower sensors would read on the true sheet."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np

from pilotage.core.types import Pose2
from pilotage.kernels.geometry import boxes
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.line_sensor import LineSensorConfig
from pilotage.sensors.magnetometer import MagnetometerConfig
from pilotage.sensors.readings import InfraredReading, LineReading, MagneticField, Reading
from pilotage.sensors.sensor import Mount, SensorConfig
from pilotage.sim.normals import Normals
from pilotage.sim.sheet_world import SheetWorld, field_angle


class SheetSensor(Protocol):
    """One sensor on the sheet."""

    def read(self, pose: Pose2) -> Reading:
        """Give a reading from where the body is."""
        ...


def _place(pose: Pose2, mount: Mount) -> tuple[float, float]:
    c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
    return pose.x_m + c * mount.x_m - s * mount.y_m, pose.y_m + s * mount.x_m + c * mount.y_m


class SimulatedInfrared:
    """One beam into the boxes; noise in proportion to the range."""

    def __init__(self, config: InfraredConfig, world: SheetWorld, rng: np.random.Generator) -> None:
        self._config = config
        self._boxes = world.boxes_m
        self._normals = Normals(rng)

    def read(self, pose: Pose2) -> Reading:
        """Measure; one draw a reading, whatever is seen."""
        c = self._config
        x, y = _place(pose, c.mount)
        exact = boxes.beam_range(x, y, pose.theta_rad + c.mount.theta_rad, self._boxes, c.max_range_m)
        found = exact * (1.0 + c.range_std_fraction * self._normals.next())
        if exact >= c.max_range_m or found >= c.max_range_m:
            return InfraredReading(c.max_range_m, saturated=True)
        return InfraredReading(max(found, c.min_range_m), saturated=False)


class SimulatedLineSensor:
    """Dark over tape and, where the floor is dark, beyond the edge."""

    def __init__(self, config: LineSensorConfig, world: SheetWorld, rng: np.random.Generator) -> None:
        self._config = config
        self._world = world
        self._normals = Normals(rng)

    def read(self, pose: Pose2) -> Reading:
        """Look down."""
        world = self._world
        x, y = _place(pose, self._config.mount)
        blur = self._config.edge_std_m * self._normals.next()
        if boxes.distance_to_lines(x, y, world.lines_m) <= 0.5 * world.tape_width_m + blur:
            return LineReading(True)
        width, height = world.size_m
        inside = min(x, width - x, y, height - y)
        return LineReading(world.floor_is_dark and inside < blur)


class SimulatedMagnetometer:
    """The field turned into the body's frame, distorted by the robot and by the building."""

    def __init__(self, config: MagnetometerConfig, world: SheetWorld, rng: np.random.Generator) -> None:
        del world
        self._config = config
        self._phases = rng.uniform(0.0, 2.0 * math.pi, 4)
        self._normals = Normals(rng)

    def read(self, pose: Pose2) -> Reading:
        """Map x is taken for magnetic north: a heading of zero reads the field along x."""
        c = self._config
        east, north = field_angle(pose.x_m, pose.y_m, c.disturbance_length_m, self._phases)
        fx, fy = c.field_ut + c.disturbance_ut * east, c.disturbance_ut * north
        heading = pose.theta_rad + c.mount.theta_rad
        cos, sin = math.cos(heading), math.sin(heading)
        x, y = cos * fx + sin * fy, -sin * fx + cos * fy
        return MagneticField(
            c.soft_iron_ratio * x + c.hard_iron_ut[0] + c.field_std_ut * self._normals.next(),
            y + c.hard_iron_ut[1] + c.field_std_ut * self._normals.next(),
        )


SHEET_SENSORS: dict[type[SensorConfig], Callable[..., SheetSensor]] = {
    InfraredConfig: SimulatedInfrared,
    LineSensorConfig: SimulatedLineSensor,
    MagnetometerConfig: SimulatedMagnetometer,
}
"""Which class simulates which sensor on a sheet; encoders and gyroscope are sampled with the drive."""
