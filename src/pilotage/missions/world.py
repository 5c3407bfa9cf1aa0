"""The world of a mission: its map, what is not on it, and where the robot begins."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag

from pilotage.core.config import Config, MapConfig, rising
from pilotage.maps.map_file import LandmarkEntry
from pilotage.missions.choice import ComponentChoice
from pilotage.missions.map_choice import MapChoice
from pilotage.missions.places import GoalConfig, Kidnap, Point, PoseConfig, RandomPlace
from pilotage.sensors.sensor import Positive

Lengths = Annotated[tuple[Positive, Positive], AfterValidator(rising)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Shares = Annotated[tuple[Share, Share], AfterValidator(rising)]


class BoxObstacle(MapConfig):
    """A box along the line from one point to another."""

    kind: Literal["box"]
    from_m: Point
    to_m: Point
    thickness_m: Positive = 0.3


class CircleObstacle(MapConfig):
    """A round obstacle."""

    kind: Literal["circle"]
    centre_m: Point
    radius_m: Positive


class AcrossPathObstacle(Config):
    """A box put across the planned path; place and size drawn from the run's seed."""

    kind: Literal["across-path"]
    length_m: Lengths = (1.5, 3.0)
    thickness_m: Positive = 0.3
    along: Shares = (0.2, 0.8)


class TrapObstacle(Config):
    """A U-shaped trap open towards the robot, across the planned path; place and size from the seed."""

    kind: Literal["u-trap"]
    width_m: Lengths = (3.0, 3.6)
    depth_m: Lengths = (2.0, 2.5)
    thickness_m: Positive = 0.2
    along: Shares = (0.15, 0.85)
    head_on: bool = False
    """Only where the plan leads straight in through the mouth: whoever follows it cannot help entering."""


Obstacle = Annotated[
    BoxObstacle | CircleObstacle | AcrossPathObstacle | TrapObstacle, Field(discriminator="kind")
]


class MarkingsConfig(MapConfig):
    """What a sheet's file leaves out."""

    tape_width_m: Positive = 0.015
    edge_is_dark: bool = True
    """Whether line sensors read dark beyond the sheet's edge, as on the film's grey carpet."""


def _which(value: Any) -> str:
    """Tell the two apart beforehand, so that an error speaks of what was meant."""
    return "file" if isinstance(value, str) else "table"


Landmarks = Annotated[
    Annotated[str, Tag("file")] | Annotated[tuple[LandmarkEntry, ...], Tag("table")],
    Discriminator(_which),
]


class WorldConfig(Config):
    """The map, start and goal, and what should not be there.

    With ``random_start`` the run begins elsewhere than at ``start``; with no ``start``, on the floor that is
    meant. Without both it begins where the sheet says, or in its middle. With ``random_goal`` robots are to
    go elsewhere than to their ``goal``, which says how near, and whether with a heading. Landmarks in a table
    take the place of those that the map has.
    """

    map: MapChoice
    landmarks: Landmarks | None = None
    """The table itself, or a CSV file with the columns id, x_m, y_m."""
    markings: MarkingsConfig = MarkingsConfig()
    start: PoseConfig | None = None
    goal: GoalConfig | None = None
    obstacles: tuple[Obstacle, ...] = ()
    people: tuple[ComponentChoice, ...] = ()
    """Plans of those who walk there; no robot is told of them."""
    random_start: RandomPlace | None = None
    random_goal: RandomPlace | None = None
    kidnaps: tuple[Kidnap, ...] = ()
