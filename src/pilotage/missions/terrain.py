"""Missions on terrain: a rover on a grid of ground and hazards (the rover report)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pilotage.core.config import Config
from pilotage.maps.crater_terrain import CraterTerrainConfig
from pilotage.missions.mission import ComponentChoice, Mission, PoseConfig
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


class PointConfig(Config):
    """A place to go to."""

    x_m: float
    y_m: float


class TerrainWorld(Config):
    """Ground, start and goal."""

    kind: Literal["terrain"]
    ground: GroundChoice
    start: PoseConfig
    goal: PointConfig


class RoverConfig(Config):
    """The rover: how fast it drives, and its wheelbase."""

    speed_m_s: Positive = 0.04
    wheelbase_m: Positive = 3.0


class CostMapConfig(Config):
    """The grid that a planner searches, made of the ground.

    Cells whose centre is nearer than ``inflation_m`` to a hazard's are blocked as well. With
    ``slope_that_doubles_deg`` a metre on such a slope costs two, on others in proportion to the slope's
    square (ground with heights only).
    """

    inflation_m: NonNegative = 0.0
    slope_that_doubles_deg: float | None = Field(None, gt=0.0, lt=90.0)


class TerrainStack(Config):
    """What would run on the rover."""

    planner: ComponentChoice
    cost_map: CostMapConfig = CostMapConfig()


class TerrainMission(Mission):
    """A mission on terrain."""

    world: TerrainWorld
    robot: RoverConfig = RoverConfig()
    stack: TerrainStack
