"""Follow the robot through a film: the second pass, frame by frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pilotage.maps.cell_map import CellMap, CellState
from pilotage.maps.cell_map_text import format_cell_map
from pilotage.tracking.film import Advance, Image, frames, reduced
from pilotage.tracking.path import Path, build_path, visited_cells
from pilotage.tracking.robot_finder import RobotFinder, Sighting
from pilotage.tracking.scene import Scene

Watcher = Callable[[Image, Sighting | None], None]
"""Called with each reduced frame and where the robot was found in it."""


@dataclass(frozen=True, slots=True)
class Track:
    """What a film says of a robot's run.

    Attributes
    ----------
    scene
        What was learned first.
    frames
        Frames that were looked at.
    path
        Where the robot was.
    visited
        Cells that its centre was in, shape (grid, grid), row 0 the smallest y.
    """

    scene: Scene
    frames: int
    path: Path
    visited: NDArray[np.bool_]

    @property
    def cells(self) -> CellMap:
        """Boxes, tapes and visited cells in one map."""
        return self.scene.marks.cells.marked(self.visited, CellState.VISITED)

    def as_dict(self) -> dict[str, Any]:
        """The track as one mapping, ready for JSON."""
        scene, path, film = self.scene, self.path, self.scene.film
        grid, size_m = scene.options.grid, scene.options.size_m
        rows, columns = np.nonzero(self.visited)
        camera = scene.camera_m
        return {
            "frames": self.frames,
            "tracked": len(path.frames),
            "fps": film.fps,
            "broke_at_frame": film.broke_at_frame,
            "corners_px": np.round(scene.sheet.corners_px, 2).tolist(),
            "corners_std_px": round(scene.sheet.corner_std_px, 3),
            "grid": {
                "cells": grid,
                "size_m": size_m,
                "cell_m": size_m / grid,
                "rows": format_cell_map(self.cells).splitlines(),
            },
            "visited_cells": [[int(c), int(r)] for r, c in zip(rows, columns, strict=True)],
            "visited_count": len(rows),
            "robot": _robot(scene),
            "camera_m": None if camera is None else np.round(camera, 3).tolist(),
            "jitter_px": round(path.jitter_px, 3),
            "edges": [
                {"kind": "line" if tape else "obstacle", "from_m": edge[:2], "to_m": edge[2:]}
                for edge, tape in zip(
                    np.round(scene.marks.edges_m, 4).tolist(), scene.marks.is_tape.tolist(), strict=True
                )
            ],
            "path": [
                {
                    "frame": int(frame),
                    "t_s": round(int(frame) / film.fps, 4),
                    "x_px": round(float(px[0]), 2),
                    "y_px": round(float(px[1]), 2),
                    "x_m": round(float(m[0]), 5),
                    "y_m": round(float(m[1]), 5),
                    "std_m": round(float(std), 5),
                }
                for frame, px, m, std in zip(
                    path.frames, path.points_px, path.points_m, path.std_m, strict=True
                )
            ],
        }


def follow(
    film: FilePath, scene: Scene, watcher: Watcher | None = None, advance: Advance | None = None
) -> Track:
    """Find the robot in every frame of a film.

    Parameters
    ----------
    film
        The film that the scene was learned from.
    scene
        What was learned.
    watcher
        Sees every frame with what was found in it, such as a writer of an annotated film.
    advance
        Called with the frames done and the frames there are.
    """
    look = scene.look
    finder = None if look is None else RobotFinder(scene.background, scene.sheet, scene.film.reduction, look)
    sightings: list[tuple[int, Sighting]] = []
    count = 0
    for number, frame in enumerate(frames(film)):
        small = reduced(frame, scene.film.reduction)
        sighting = None if finder is None else finder.find(small)
        if sighting is not None:
            sightings.append((number, sighting))
        if watcher is not None:
            watcher(small, sighting)
        count = number + 1
        if advance is not None:
            advance(count, scene.film.frames)
    path = build_path(sightings, scene.sheet, scene.camera_m, scene.options.height_m)
    return Track(scene, count, path, visited_cells(path, scene.options.size_m, scene.options.grid))


def _robot(scene: Scene) -> dict[str, Any] | None:
    look = scene.look
    if look is None:
        return None
    colour = None if look.colour is None else [*look.colour.low, *look.colour.high]
    return {"hsv": colour, "radius_m": round(look.radius_m, 4), "height_m": scene.options.height_m}
