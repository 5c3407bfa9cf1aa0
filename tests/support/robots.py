"""A small robot in a small room, for tests of components."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from pilotage.core.random import RandomStreams
from pilotage.core.types import Goal, Pose2
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.sensor import Mount, SensorConfig
from pilotage.sensors.ultrasonic import UltrasonicConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.navigator import Parts

T = TypeVar("T")

ROOM = SegmentMap.of(
    np.array(
        [[0, 0, 10, 0], [10, 0, 10, 8], [10, 8, 0, 8], [0, 8, 0, 0], [5, 0, 5, 3], [5, 5, 5, 8]], dtype=float
    )
)
BEACONS = Landmarks(np.array([4, 2, 9, 7]), np.array([[0.05, 4.0], [9.95, 2.0], [9.95, 6.0], [3.0, 7.95]]))


def sensors() -> dict[str, SensorConfig]:
    """The night watch's sensors."""
    side = math.radians(30.0)
    return {
        "odometry": WheelOdometryConfig(),
        "lidar": LidarConfig(),
        "beacons": BeaconConfig(),
        "front": UltrasonicConfig(mount=Mount(x_m=0.2)),
        "left": UltrasonicConfig(mount=Mount(x_m=0.18, y_m=0.11, theta_rad=side)),
        "right": UltrasonicConfig(mount=Mount(x_m=0.18, y_m=-0.11, theta_rad=-side)),
    }


@dataclass(frozen=True)
class Told:
    """What a robot is told before it starts, and the journal that its components write."""

    robot: RobotKnowledge
    chart: WorldMap
    task: TaskKnowledge
    journal: Journal = field(default_factory=Journal)

    @property
    def initial(self) -> Belief:
        """Where it believes to begin."""
        return self.task.initial

    @property
    def said(self) -> dict[str, float]:
        """The telemetry of the last step."""
        return dict(zip(self.journal.units, self.journal.row, strict=True))

    def localizer(self, factory: Callable[..., T], config: Any) -> T:
        """A localizer with this knowledge."""
        return factory(config, self.robot, self.chart, self.initial, self.journal)

    def navigator(self, factory: Callable[..., T], config: Any, parts: Parts) -> T:
        """A navigator with this knowledge."""
        return factory(config, self.robot, self.chart, self.task, parts, self.journal)


def told_of(
    world: SegmentMap = ROOM,
    start: Pose2 = Pose2(2.0, 2.0, 0.0),  # noqa: B008 - frozen
    goal: Goal | None = Goal(8.0, 6.0),  # noqa: B008 - frozen
    variances: tuple[float, float, float] = (0.01, 0.01, 0.01),
    seed: int = 0,
    initial: Belief | None = None,
) -> Told:
    """What the robot is told in the room; ``initial`` replaces the start and its variances."""
    belief = Belief(start, np.diag(variances)) if initial is None else initial
    return Told(
        RobotKnowledge(Footprint.disc(0.3), DifferentialDriveConfig(), sensors(), 0.1, RandomStreams(seed)),
        WorldMap("room", world.bounds_m, world, landmarks=BEACONS),
        TaskKnowledge(belief, () if goal is None else (goal,), 0.3),
    )
