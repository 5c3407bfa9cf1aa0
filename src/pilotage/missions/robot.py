"""The robot of a mission: its outline, how it moves, what it carries."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, field_validator

from pilotage.core.config import Config, MapConfig
from pilotage.missions.choice import ComponentChoice, by_default
from pilotage.missions.places import GoalConfig, Point, PoseConfig
from pilotage.missions.stack import StackConfig
from pilotage.sensors.sensor import Positive


class DiscFootprint(MapConfig):
    """A disc around the axle's middle."""

    name: Literal["disc"] = "disc"
    radius_m: Positive = 0.30


class PolygonFootprint(MapConfig):
    """Corners in the base frame: x forward, y left, the axle's middle at (0, 0)."""

    name: Literal["polygon"] = "polygon"
    points_m: tuple[Point, ...]


def _outline(value: Any) -> str:
    """Tell the two apart by their name, or by what is given."""
    given = value if isinstance(value, Mapping) else getattr(value, "__dict__", {})
    if given.get("name") is not None:
        return str(given["name"])
    return "polygon" if "points_m" in given else "disc"


FootprintChoice = Annotated[
    Annotated[DiscFootprint, Tag("disc")] | Annotated[PolygonFootprint, Tag("polygon")],
    Discriminator(_outline),
]


class RobotConfig(Config):
    """One robot. Motion and sensors are registered names with their parameters.

    In ``robots`` each entry is laid over ``robot``, and may say its own start, goal and stack.
    """

    name: str = "robot"
    footprint: FootprintChoice = DiscFootprint()
    motion: Annotated[ComponentChoice, by_default("differential-drive")] = ComponentChoice(
        name="differential-drive"
    )
    true_motion: dict[str, Any] = Field(default_factory=dict)
    """Parameters of the motion that are not as the data sheet says; the robot does not know of them."""
    sensors: dict[str, ComponentChoice] = Field(default_factory=dict)
    """By names of the mission's own; null takes one off that was there before."""
    faults: tuple[ComponentChoice, ...] = ()
    """What becomes of the sensors' readings on their way to the stack, one after the other; the robot is
    not told."""
    start: PoseConfig | None = None
    goal: GoalConfig | None = None
    stack: StackConfig | None = None

    @field_validator("sensors", mode="before")
    @classmethod
    def _taken_off(cls, sensors: Any) -> Any:
        """Leave out what is null."""
        if not isinstance(sensors, Mapping):
            return sensors
        return {name: sensor for name, sensor in sensors.items() if sensor is not None}
