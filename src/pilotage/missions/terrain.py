"""Missions on terrain: a rover on a grid of ground and hazards (the rover report)."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from pilotage.core.config import Config
from pilotage.maps.crater_terrain import CraterTerrainConfig
from pilotage.maps.map_file import LandmarkEntry
from pilotage.missions.mission import ComponentChoice, InitialConfig, Mission, PoseConfig
from pilotage.sensors.sensor import NonNegative, Positive

Origin = tuple[float, float, float]


class CraterGround(CraterTerrainConfig):
    """Made by the generator of crater terrain."""

    name: Literal["crater"]


class ImagesGround(Config):
    """The three images of the rover report; obstacles are white.

    ``origin_m`` is the outer corner of the lower-left pixel. Landmarks are the coloured points of their
    image, which needs no obstacles of its own; all images have the obstacles' size.
    """

    name: Literal["images"]
    obstacles: str = Field(min_length=1)
    environment: str | None = None
    landmarks: str | None = None
    resolution_m: Positive = 10.0
    origin_m: tuple[float, float] = (0.0, -10.0)


class ElevationGround(Config):
    """An elevation model: GeoTIFF, a raw array with its JSON side file, or a NumPy array."""

    name: Literal["elevation"]
    file: str = Field(min_length=1)
    slope_limit_deg: float = Field(15.0, gt=0.0, lt=90.0)
    resolution_m: Positive | None = None
    origin: Origin | None = None


class GridGround(Config):
    """Any grid map: an image, ROS map_server's YAML, MovingAI's ``.map``, a NumPy array."""

    name: Literal["grid"]
    file: str = Field(min_length=1)
    resolution_m: Positive | None = None
    origin: Origin | None = None


GroundChoice = Annotated[
    CraterGround | ImagesGround | ElevationGround | GridGround, Field(discriminator="name")
]


class PlaceConfig(Config):
    """A place to go to, and for a drive to a pose the heading there."""

    x_m: float
    y_m: float
    theta_rad: float | None = Field(default=None, ge=-2 * math.pi, le=2 * math.pi)
    tolerance_m: Positive = 0.001
    """A drive to a pose ends at the first sample this near."""


class TerrainWorld(Config):
    """Ground, start and goal; landmarks in a table take the place of those that the ground has."""

    kind: Literal["terrain"]
    ground: GroundChoice
    start: PoseConfig
    goal: PlaceConfig
    landmarks: str | tuple[LandmarkEntry, ...] | None = None
    """The table itself, or a CSV file with the columns id, x_m, y_m."""


class RoverConfig(Config):
    """The rover: how fast it drives, its wheelbase, its odometer and landmark sensor."""

    speed_m_s: Positive = 0.04
    wheelbase_m: Positive = 3.0
    sensors: dict[str, ComponentChoice] = Field(default_factory=dict)


class CostMapConfig(Config):
    """The grid that a planner searches, made of the ground.

    Cells whose centre is nearer than ``inflation_m`` to a hazard's are blocked as well. With
    ``slope_that_doubles_deg`` a metre on such a slope costs two, on others in proportion to the slope's
    square (ground with heights only).
    """

    inflation_m: NonNegative = 0.0
    slope_that_doubles_deg: float | None = Field(None, gt=0.0, lt=90.0)


class SplineConfig(Config):
    """The curve along a planned path (section 5 of the rover report)."""

    samples: int = Field(default=10_000, ge=2, le=10_000_000)
    clear: bool = True
    """Whether knots are added until the curve keeps clear of hazards; the report's curve is not checked."""


class TerrainStack(Config):
    """What would run on the rover: a planner or a pose controller finds the way, an estimator follows it."""

    planner: ComponentChoice | None = None
    cost_map: CostMapConfig = CostMapConfig()
    spline: SplineConfig | None = None
    pose_controller: ComponentChoice | None = None
    estimator: ComponentChoice | None = None
    initial: InitialConfig = InitialConfig(
        x_var_m2=36.0, y_var_m2=36.0, theta_var_rad2=math.radians(1.0) ** 2
    )
    ellipse_probability: float = Field(default=0.95, gt=0.0, lt=1.0)
    """Of the ellipses drawn and counted."""

    @model_validator(mode="after")
    def _one_way(self) -> TerrainStack:
        if (self.planner is None) == (self.pose_controller is None):
            raise ValueError("expected either a planner or a pose_controller, found both or neither")
        if self.estimator is not None and self.planner is not None and self.spline is None:
            raise ValueError("expected a spline: an estimator needs a path with headings, cells have none")
        return self


class TerrainMission(Mission):
    """A mission on terrain."""

    world: TerrainWorld
    robot: RoverConfig = RoverConfig()
    stack: TerrainStack
