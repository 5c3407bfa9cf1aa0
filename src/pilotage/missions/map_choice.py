"""What ``world.map`` may be: a name or file of any format, or the map itself."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from pilotage.core.config import Config
from pilotage.core.errors import InputError, unknown_name
from pilotage.maps.crater_terrain import CraterTerrainConfig
from pilotage.maps.map_file import MapFile
from pilotage.maps.true_cells import SheetFile
from pilotage.sensors.sensor import Positive

Origin = tuple[float, float, float]


class CraterMap(CraterTerrainConfig):
    """Made by the generator of crater terrain."""

    name: Literal["crater"]


class ImagesMap(Config):
    """The three images of the rover report; obstacles are white.

    Obstacles are hazards on open ground, which stop neither body nor beam, unless ``open_ground`` is false.
    ``origin_m`` is the outer corner of the lower-left pixel. Landmarks are the coloured points of their
    image, which needs no obstacles of its own; all images have the obstacles' size.
    """

    name: Literal["images"]
    obstacles: str = Field(min_length=1)
    environment: str | None = None
    landmarks: str | None = None
    resolution_m: Positive = 10.0
    origin_m: tuple[float, float] = (0.0, -10.0)
    open_ground: bool = True


class ElevationMap(Config):
    """An elevation model: ESRI ASCII grid, GeoTIFF, a raw array with its JSON side file, or a NumPy array."""

    name: Literal["elevation"]
    file: str = Field(min_length=1)
    slope_limit_deg: float = Field(15.0, gt=0.0, lt=90.0)
    resolution_m: Positive | None = None
    origin: Origin | None = None


class GridMap(Config):
    """Any grid map: an image, ROS map_server's YAML, MovingAI's ``.map``, a NumPy array.

    Its occupied cells are walls; with ``open_ground`` they are hazards, which stop neither body nor beam.
    """

    name: Literal["grid"]
    file: str = Field(min_length=1)
    resolution_m: Positive | None = None
    origin: Origin | None = None
    open_ground: bool = False


BY_NAME: dict[str, type[Config]] = {
    "crater": CraterMap,
    "images": ImagesMap,
    "elevation": ElevationMap,
    "grid": GridMap,
}


def _which(value: Any) -> str:
    """Tell the alternatives apart beforehand, so that an error speaks of what was meant."""
    if isinstance(value, str | MapFile | SheetFile | CraterMap | ImagesMap | ElevationMap | GridMap):
        names: dict[type, str] = {str: "file", MapFile: "walls", SheetFile: "sheet"}
        return names.get(type(value)) or str(getattr(value, "name", "file"))
    if isinstance(value, Mapping):
        name = value.get("name")
        if isinstance(name, str):
            if name not in BY_NAME:
                raise unknown_name("world.map.name", name, BY_NAME)
            return name
        if "file" in value:
            raise InputError(
                f"world.map.name: missing; expected grid or elevation beside file, or the file alone "
                f"(world.map: {value['file']})"
            )
        if "image" in value:
            raise InputError(
                "world.map: expected a ROS map by its own file (world.map: FILE.yaml), found its keys here; "
                "or take name: grid and file, resolution_m, origin"
            )
        return "sheet" if "size_m" in value and "walls_m" not in value else "walls"
    return "file"


MapChoice = Annotated[
    Annotated[str, Tag("file")]
    | Annotated[MapFile, Tag("walls")]
    | Annotated[SheetFile, Tag("sheet")]
    | Annotated[CraterMap, Tag("crater")]
    | Annotated[ImagesMap, Tag("images")]
    | Annotated[ElevationMap, Tag("elevation")]
    | Annotated[GridMap, Tag("grid")],
    Discriminator(_which),
]
