"""A small robot in a small room, for tests of components."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.random import RandomStreams
from pilotage.core.types import Goal, Pose2
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.segment_map import SegmentMap
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.sensor import Mount, SensorConfig
from pilotage.sensors.ultrasonic import UltrasonicConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief
from pilotage.stack.knowledge import Knowledge

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


def knowledge_of(
    world: SegmentMap = ROOM,
    start: Pose2 = Pose2(2.0, 2.0, 0.0),  # noqa: B008 - frozen
    goal: Goal | None = Goal(8.0, 6.0),  # noqa: B008 - frozen
    variances: tuple[float, float, float] = (0.01, 0.01, 0.01),
    seed: int = 0,
    initial: Belief | None = None,
) -> Knowledge:
    """What the robot knows in the room; ``initial`` replaces the start and its variances."""
    return Knowledge(
        world_map=world,
        landmarks=BEACONS,
        sensors=sensors(),
        body_radius_m=0.3,
        max_speed_m_s=1.0,
        max_turn_rate_rad_s=2.0,
        dt_s=0.1,
        initial=Belief(start, np.diag(variances)) if initial is None else initial,
        goal=goal,
        goal_tolerance_m=0.3,
        streams=RandomStreams(seed),
    )
