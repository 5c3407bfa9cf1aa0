"""Maps of ROS's map_server: a YAML file with thresholds and an image beside it.

The rules are those of the Navigation 2 map server: lightness s in [0, 1] means occupancy p = 1 - s, or
p = s with ``negate``. ``trinary``: occupied above ``occupied_thresh``, free below ``free_thresh``, else
unknown. ``scale``: the same, but between the thresholds from 0 to 100 in proportion. What is not opaque is
unknown in both. ``raw``: the pixel's value itself from 0 to 100, others unknown; of 16 bits a pixel, what
8 would say. Keys that it does not know are none of its business.

But for one thing: where an image has the greys alone that map_saver writes, 205 is what it was for map_saver,
unknown. With the threshold that Navigation 2 writes beside it, 0.25, its own map server calls that free.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from typing import Any, Literal, TypeVar

import numpy as np
import yaml
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from pilotage.core.config import Config, validate
from pilotage.core.errors import InputError, nearest
from pilotage.core.files import read_yaml
from pilotage.core.neighbours import hint_beside
from pilotage.core.types import Pose2
from pilotage.maps.grid_image import DEEPEST, IMAGES, ByteArray, GreyArray, as_bytes, read_grey, write_grey
from pilotage.maps.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyArray, OccupancyGrid

SAVED_UNKNOWN, SAVED = 205, frozenset({0, 205, 254, 255})
"""Grey of what is unknown, and all greys, of a map that map_saver wrote; some programs paint with 255."""

LIKE = 0.75
"""So like a key that a file need not have another one is it, misspelt; `name` is half like `mode`."""

Entry = TypeVar("Entry", bound=np.generic)


def _free_where_unsaid(said: dict[str, Any]) -> float:
    """Navigation 2's default, but where a file's one threshold is below it: then that is for both."""
    occupied: float = said.get("occupied_thresh", 1.0)
    return min(0.25, occupied)


class RosMapFile(Config):
    """The YAML file. ``origin`` is the pose x, y, yaw of the lower-left pixel's outer corner."""

    image: str = Field(min_length=1)
    mode: Literal["trinary", "scale", "raw"] = "trinary"
    resolution: float = Field(gt=0.0)
    origin: tuple[float, float, float]
    negate: bool = False
    occupied_thresh: float = Field(0.65, ge=0.0, le=1.0)
    free_thresh: float = Field(default_factory=_free_where_unsaid, ge=0.0, le=1.0)

    @field_validator("origin", mode="before")
    @classmethod
    def _yaw_may_be_missing(cls, value: Any) -> Any:
        return [*value, 0.0] if isinstance(value, list | tuple) and len(value) == 2 else value

    @field_validator("mode", mode="before")
    @classmethod
    def _in_any_case(cls, value: Any) -> Any:
        return value.lower() if isinstance(value, str) else value

    @field_validator("negate", mode="before")
    @classmethod
    def _any_number_but_zero(cls, value: Any) -> Any:
        return value != 0 if isinstance(value, int) else value

    @model_validator(mode="after")
    def _thresholds_in_order(self) -> RosMapFile:
        if not self.free_thresh <= self.occupied_thresh:
            free, occupied = self.free_thresh, self.occupied_thresh
            raise ValueError(f"expected free_thresh at most occupied_thresh {occupied:g}, found {free:g}")
        return self


@dataclass(frozen=True, slots=True, eq=False)
class RosMap:
    """A map as its files have it, so that it can be written back without loss.

    Attributes
    ----------
    file
        What the YAML file says.
    pixels, alpha
        (rows, columns) grey values as stored; alpha is None where the image has none.
    """

    file: RosMapFile
    pixels: GreyArray
    alpha: ByteArray | None = None

    @staticmethod
    def of(grid: OccupancyGrid, image: str) -> RosMap:
        """Describe a grid so that nothing is lost: trinary where that is enough, else raw.

        Parameters
        ----------
        image
            Name of the image file, ending in .pgm or .png.
        """
        cells = grid.cells
        origin = (grid.origin.x_m, grid.origin.y_m, grid.origin.theta_rad)
        trinary = bool(((cells == FREE) | (cells == OCCUPIED) | (cells == UNKNOWN)).all())
        # 205 is what map_saver writes for unknown: just above its threshold for free.
        values = np.arange(256, dtype=np.uint8)
        if trinary:
            values[[FREE, OCCUPIED, UNKNOWN]] = 254, 0, SAVED_UNKNOWN
        file = RosMapFile(
            image=image,
            mode="trinary" if trinary else "raw",
            resolution=grid.resolution_m,
            origin=origin,
            free_thresh=0.196,
        )
        return RosMap(file, _looked_up(values, cells.view(np.uint8)))

    @property
    def grid(self) -> OccupancyGrid:
        """The map as a grid."""
        x, y, yaw = self.file.origin
        return OccupancyGrid(self._cells(), self.file.resolution, Pose2(x, y, yaw))

    def _cells(self) -> OccupancyArray:
        file = self.file
        if file.mode == "raw":
            raw = np.arange(256)
            return _looked_up(np.where(raw <= OCCUPIED, raw, UNKNOWN).astype(np.int8), as_bytes(self.pixels))
        if self.pixels.dtype == np.uint16:
            return _looked_up(self._occupancy(np.arange(DEEPEST + 1) / DEEPEST), self.pixels)
        table = self._occupancy(np.arange(256) / 255.0)
        if file.mode == "trinary" and not file.negate and SAVED.issuperset(np.unique(self.pixels).tolist()):
            table[SAVED_UNKNOWN] = UNKNOWN
        cells = _looked_up(table, self.pixels)
        if self.alpha is not None:
            cells[self.alpha < 255] = UNKNOWN
        return cells

    def _occupancy(self, shade: Any) -> OccupancyArray:
        """Per cent from lightness, in the modes trinary and scale."""
        file = self.file
        p = shade if file.negate else 1.0 - shade
        between: Any = UNKNOWN
        if file.mode == "scale":
            # Thresholds may lie so close that nothing is between them; what is beyond is replaced below.
            span = max(file.occupied_thresh - file.free_thresh, np.finfo(float).tiny)
            with np.errstate(over="ignore"):
                between = np.rint(np.clip((p - file.free_thresh) / span, 0.0, 1.0) * 100.0)
        cells = np.where(p > file.occupied_thresh, OCCUPIED, np.where(p < file.free_thresh, FREE, between))
        return np.asarray(cells.astype(np.int8))


def _looked_up(table: NDArray[Entry], pixels: GreyArray) -> NDArray[Entry]:
    """Entries (one a grey) of pixels (H, W), row by row: an index of all would take 8 bytes a pixel."""
    out = np.empty(pixels.shape, table.dtype)
    for row, values in zip(out, pixels, strict=True):
        row[:] = table[values]
    return out


def read_ros_map(path: Path) -> RosMap:
    """Read a YAML file and its image, by its path from there, or beside it where that leads nowhere.

    Raises
    ------
    InputError
        Where a file is missing, a key is wrong, or the image is not grey.
    """
    return parse_ros_map(read_yaml(path, "a map file"), path)


def parse_ros_map(values: Any, path: Path) -> RosMap:
    """Build a map from the parsed YAML file at ``path``; InputError as ``read_ros_map``."""
    file = validate(RosMapFile, _known(values), str(path))
    return RosMap(file, *read_grey(image_of(path, file.image)))


def _known(values: Any) -> Any:
    """What a map server reads of a file: others write into it what other programs read (layers, frames).

    A key that is like one which is not there is most likely that one, misspelt, and stays to be told: where
    the file does not do without it any, and else where it is very like it.
    """
    if not isinstance(values, dict):
        return values
    fields = {name: field for name, field in RosMapFile.model_fields.items() if name not in values}
    needed = [name for name, field in fields.items() if field.is_required()]

    def is_one_misspelt(key: str) -> bool:
        return bool(nearest(key, needed) or difflib.get_close_matches(key.lower(), fields, 1, LIKE))

    return {
        key: value
        for key, value in values.items()
        if key in RosMapFile.model_fields or is_one_misspelt(str(key))
    }


def image_of(path: Path, named: str) -> Path:
    """The image: where the file says, else under its name beside the file, as it is after both were moved.

    Raises
    ------
    InputError
        Where it is in neither place.
    """
    image = path.parent / named
    beside = path.parent / PureWindowsPath(named).name  # which parts names at either slash
    if image.is_file():
        return image
    if not beside.is_file():
        hint = hint_beside(beside, IMAGES)
        raise InputError(
            f"{path}: image: expected a file '{image}', or one of its name beside it, found none{hint}"
        )
    return beside


def write_ros_map(path: Path, ros_map: RosMap) -> None:
    """Write the YAML file and, beside it, the image. What is there under these names is replaced."""
    file = ros_map.file.model_copy(update={"image": Path(ros_map.file.image).name})
    write_grey(path.parent / file.image, ros_map.pixels, ros_map.alpha)
    values = file.model_dump()
    values["negate"] = int(file.negate)
    values["origin"] = list(file.origin)
    path.write_text(yaml.safe_dump(values, sort_keys=False, default_flow_style=None, width=1000))
