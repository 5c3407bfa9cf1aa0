"""A robot tracked on film."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core import given
from pilotage.core.given import FilePath
from pilotage.core.interruptions import interruptible
from pilotage.core.types import FloatArray
from pilotage.core.whole_file import made_folder


@dataclass(frozen=True, slots=True, eq=False)
class Tracked:
    """A robot's path on a square map, from a film.

    Attributes
    ----------
    answer
        Everything, by its JSON key: corners, grid, visited cells, path.
    path
        (N, 3) time in s, x and y in m.
    written
        Files that were written.
    """

    answer: Mapping[str, Any] = field(repr=False)
    path: FloatArray
    written: tuple[Path, ...] = ()

    @property
    def visited_cells(self) -> int:
        """How many cells the robot's centre was in."""
        return int(self.answer["visited_count"])


@interruptible()
def track(
    video: FilePath,
    *,
    corners: str | None = None,
    hsv: str | None = None,
    grid: int = 25,
    size_m: float = 1.8,
    radius_m: float | None = None,
    height_m: float = 0.0,
    out: FilePath | None = None,
) -> Tracked:
    """Track a robot on a square map through a film; needs the extra ``vision``.

    Parameters
    ----------
    video
        A film by a fixed camera that sees the map.
    corners
        The map's corners in pixels, ``X,Y,X,Y,X,Y,X,Y`` from its origin counter-clockwise; None: found.
    hsv
        The robot's colour, ``H0,S0,V0,H1,S1,V1``; None: learned.
    grid, size_m
        Cells along a side, and the side's length.
    radius_m, height_m
        Of the robot's coloured disc: its radius (None: learned) and how high it is over the floor.
    out
        Folder for JSON, CSV, the map's picture and text maps; None: nothing is written.

    Raises
    ------
    InputError
        Where the file is no film, or no map is in it.
    """
    from pilotage.tracking.output import write_track
    from pilotage.tracking.robot_colour import parse_hsv
    from pilotage.tracking.scene import TrackOptions, learn_scene
    from pilotage.tracking.sheet import parse_corners
    from pilotage.tracking.track import follow

    film, folder = given.path("video", video), None if out is None else given.folder("out", out)
    options = TrackOptions(
        None if corners is None else parse_corners(given.word("corners", corners)),
        None if hsv is None else parse_hsv(given.word("hsv", hsv)),
        given.whole("grid", grid, 1),
        given.number("size_m", size_m, above=0.0),
        None if radius_m is None else given.number("radius_m", radius_m, above=0.0),
        given.number("height_m", height_m, 0.0),
    )
    found = follow(film, learn_scene(film, options))
    written: tuple[Path, ...] = ()
    if folder is not None:
        with made_folder(folder):
            written = tuple(write_track(folder, found))
    answer = found.as_dict()
    rows = [(entry["t_s"], entry["x_m"], entry["y_m"]) for entry in answer["path"]]
    return Tracked(answer, np.array(rows, dtype=np.float64).reshape(-1, 3), written)
