"""Maps of any format: what was understood of one, and walls from a grid."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pilotage.core import given
from pilotage.core.config import validate
from pilotage.core.errors import InputError
from pilotage.core.given import FilePath
from pilotage.core.interruptions import interruptible
from pilotage.experiments.build.charts import load_chart
from pilotage.maps.occupancy_grid import OCCUPIED_FROM
from pilotage.maps.vectorize import wall_segments, write_wall_map
from pilotage.maps.world_map import WorldMap
from pilotage.missions.map_choice import GridMap

MOST_PICTURES = 1000
"""Of one name in a folder."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """A map as it was understood.

    Attributes
    ----------
    path
        The picture.
    layers
        By name, what the map has: bounds, walls, circles, cells, landmarks, heights, tapes.
    """

    path: Path
    layers: Mapping[str, Any]


def draw(
    map: FilePath,  # noqa: A002 - the word for it
    out: FilePath | None = None,
    *,
    resolution_m: float | None = None,
) -> Drawn:
    """Draw a map as it is understood: walls, cells, heights, tapes, landmarks and bounds.

    Parameters
    ----------
    map
        A shipped map's name or a file of any format that ``plan`` and missions take.
    out
        A PNG file; None: the map's name in the working folder, with a number behind it where that name is
        taken, as it often is by the image of a ROS map.
    resolution_m
        Metres a cell of a file that does not say, such as an image.

    Raises
    ------
    InputError
        Where it is no map, or the picture cannot be named so.

    Examples
    --------
    >>> import pilotage as pl
    >>> drawn = pl.draw("museum", "museum.png")
    >>> drawn.layers["walls"], drawn.layers["landmarks"]
    (32, 35)
    """
    source = given.path("map", map)
    chart = _chart(source, resolution_m)
    path = _unused(source.stem) if out is None else given.path("--out", out)
    if path.suffix.lower() != ".png":
        raise InputError(f"--out: expected a PNG file, found '{path}'")
    if path.is_dir():
        raise InputError(f"--out: expected a file that can be written, found '{path}' there; name another")
    if not path.parent.is_dir():
        raise InputError(f"--out: expected a folder that is there, found none: '{path.parent}'")
    from pilotage.report.map_picture import draw_map

    draw_map(chart, path)
    return Drawn(path, layers_of(chart))


def _unused(stem: str) -> Path:
    """A picture's name in the working folder that nothing there has."""
    names = (f"{stem}.png", *(f"{stem}-{number}.png" for number in range(2, MOST_PICTURES + 1)))
    free = next((path for path in map(Path, names) if not os.path.lexists(path)), None)
    if free is None:
        raise InputError(f"--out: expected a name, found {names[0]} to {names[-1]} all taken; name another")
    return free


@interruptible()
def vectorize(
    map: FilePath,  # noqa: A002 - the word for it
    out: FilePath | None = None,
    *,
    tolerance_m: float = 0.0,
    resolution_m: float | None = None,
) -> Path:
    """Make a map of walls from a map of cells, so that what needs walls works on it.

    Parameters
    ----------
    map
        A ROS map, a MovingAI map or an image.
    out
        A YAML file; None: the map's name with ``-walls.yaml`` in the working folder.
    tolerance_m
        How far a wall may lie from the cells' outline: 0 keeps the staircases of slanted walls, a cell's side
        makes them straight.
    resolution_m
        Metres a cell of a file that does not say, such as an image.

    Raises
    ------
    InputError
        Where the map has no cells, or too many walls come of them.
    """
    source, tolerance_m = given.path("map", map), given.number("--tolerance", tolerance_m, 0.0)
    chart = _chart(source, resolution_m)
    if chart.grid is None or chart.geometry is not None:
        raise InputError(f"vectorize: expected a map of cells, found '{map}', which has walls already")
    path = Path(f"{source.stem}-walls.yaml") if out is None else given.path("--out", out)
    if path.suffix.lower() not in {".yaml", ".yml"}:
        raise InputError(f"--out: expected a YAML file, found '{path}'")
    if path.is_dir() or not path.parent.is_dir():
        raise InputError(f"--out: expected a file in a folder that is there, found '{path}'")
    if path.exists() and path.resolve() == source.resolve():
        raise InputError(f"--out: expected another file than the map itself, found '{path}'")
    segments = wall_segments(chart.grid, tolerance_m)
    name = "".join(c if c.isalnum() or c in "-_" else "-" for c in path.stem)
    write_wall_map(path, f"'{name}'", segments, chart.bounds_m, source.name)
    return path


def _chart(source: Path, resolution_m: float | None) -> WorldMap:
    if resolution_m is None:
        return load_chart(str(source))
    told = {
        "name": "grid",
        "file": str(source),
        "resolution_m": given.number("--resolution", resolution_m, above=0.0),
    }
    return load_chart(validate(GridMap, told, str(source)))


def layers_of(chart: WorldMap) -> dict[str, Any]:
    """What a map has, by name."""
    layers: dict[str, Any] = {"map": chart.name, "bounds_m": list(chart.bounds_m)}
    if chart.geometry is not None:
        layers |= {"walls": len(chart.geometry.segments_m), "circles": len(chart.geometry.circles_m)}
    if chart.grid is not None:
        cells = chart.grid.cells
        layers |= {
            "rows": chart.grid.rows,
            "columns": chart.grid.columns,
            "resolution_m": chart.grid.resolution_m,
            "occupied_cells": int((cells >= OCCUPIED_FROM).sum()),
            "unknown_cells": int((cells < 0).sum()),
        }
    if chart.elevation is not None:
        layers["slope_limit_deg"] = chart.slope_limit_deg
    if chart.markings is not None:
        layers["tapes"] = len(chart.markings.tapes_m)
    return layers | {"landmarks": len(chart.landmarks)}
