"""Missions on a floor: walls, landmarks, and what should not be there."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag

from pilotage.core.config import Config
from pilotage.maps.map_file import MapFile
from pilotage.missions.mission import ComponentChoice, InitialConfig, Mission, Point, PoseConfig
from pilotage.sensors.sensor import NonNegative, Positive

MapSource = Annotated[
    Annotated[str, Tag("name")] | Annotated[MapFile, Tag("inline")],
    # Told apart beforehand, so that an error speaks of what was meant.
    Discriminator(lambda value: "name" if isinstance(value, str) else "inline"),
]


class GoalConfig(Config):
    """A goal; without a heading any heading will do."""

    x_m: float
    y_m: float
    theta_rad: float | None = Field(default=None, ge=-2 * math.pi, le=2 * math.pi)
    tolerance_m: Positive = 0.3


class BoxObstacle(Config):
    """A box along the line from one point to another."""

    kind: Literal["box"]
    from_m: Point
    to_m: Point
    thickness_m: Positive = 0.3


class CircleObstacle(Config):
    """A round obstacle."""

    kind: Literal["circle"]
    centre_m: Point
    radius_m: Positive


class AcrossPathObstacle(Config):
    """A box put across the planned path; place and size drawn from the run's seed."""

    kind: Literal["across-path"]
    length_m: tuple[Positive, Positive] = (1.5, 3.0)
    thickness_m: Positive = 0.3
    along: tuple[NonNegative, NonNegative] = (0.2, 0.8)


class TrapObstacle(Config):
    """A U-shaped trap open towards the robot, across the planned path; place and size from the seed."""

    kind: Literal["u-trap"]
    width_m: tuple[Positive, Positive] = (3.0, 3.6)
    depth_m: tuple[Positive, Positive] = (2.0, 2.5)
    thickness_m: Positive = 0.2
    along: tuple[NonNegative, NonNegative] = (0.15, 0.85)


Obstacle = Annotated[
    BoxObstacle | CircleObstacle | AcrossPathObstacle | TrapObstacle, Field(discriminator="kind")
]


class RandomPlace(Config):
    """A pose drawn from the run's seed among those that a body can drive to from ``world.start``."""

    clearance_m: Positive = 0.6


class Kidnap(Config):
    """The robot is carried elsewhere and not told; without ``to``, to a random place."""

    at_s: NonNegative
    to: PoseConfig | None = None
    clearance_m: Positive = 0.6


class WorldConfig(Config):
    """The map (a shipped name, a file, or the map itself), start, goal, and what should not be there.

    With ``random_start`` the run begins elsewhere than at ``start``.
    """

    kind: Literal["floor"] = "floor"
    map: MapSource
    start: PoseConfig
    goal: GoalConfig | None = None
    obstacles: tuple[Obstacle, ...] = ()
    random_start: RandomPlace | None = None
    kidnaps: tuple[Kidnap, ...] = ()


class BodyConfig(Config):
    """The robot's body: a disc."""

    radius_m: Positive = 0.30


class MotionConfig(Config):
    """Differential drive: how it moves and its limits."""

    name: Literal["differential-drive"] = "differential-drive"
    max_speed_m_s: Positive = 1.0
    max_turn_rate_rad_s: Positive = 2.0
    max_acceleration_m_s2: Positive = 2.0
    max_turn_acceleration_rad_s2: Positive = 8.0


class RobotConfig(Config):
    """Body, motion and sensors (each a registered ``name`` with its parameters)."""

    body: BodyConfig = BodyConfig()
    motion: MotionConfig = MotionConfig()
    sensors: dict[str, ComponentChoice]


class StackConfig(Config):
    """One component for each role; None where the mission does without."""

    initial: InitialConfig = InitialConfig()
    navigator: ComponentChoice
    localizer: ComponentChoice
    planner: ComponentChoice | None = None
    smoother: ComponentChoice | None = None
    local_planner: ComponentChoice | None = None
    controller: ComponentChoice | None = None
    reactive: ComponentChoice | None = None
    mapper: ComponentChoice | None = None
    escape: ComponentChoice | None = None


class FloorMission(Mission):
    """A mission on a floor with walls and landmarks."""

    world: WorldConfig
    robot: RobotConfig
    stack: StackConfig
