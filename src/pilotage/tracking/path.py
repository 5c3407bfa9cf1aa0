"""The path of the robot: where it was in each frame, how well that is known, and the cells it visited."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pilotage.tracking.robot_finder import Sighting
from pilotage.tracking.sheet import Sheet, project

Floats = NDArray[np.float64]

_LONGEST_GAP = 10
"""Frames without the robot that a straight line may bridge when visited cells are counted."""


@dataclass(frozen=True, slots=True)
class Path:
    """Where the robot was.

    Attributes
    ----------
    frames
        Numbers of the frames that show it, from 0, shape (N,).
    points_px
        Centre of its disc in the film, shape (N, 2).
    points_m
        The point of the floor under it, shape (N, 2).
    std_m
        Standard deviation of each coordinate on the floor, shape (N,): jitter of the centre, how well the
        corners are known, how much of the disc was hidden, and how unlike a disc the body looks. Not in it: a
        wrong size of the sheet, and a height of the disc that was not told.
    jitter_px
        Standard deviation of the centre from frame to frame.
    """

    frames: NDArray[np.int64]
    points_px: Floats
    points_m: Floats
    std_m: Floats
    jitter_px: float


def build_path(
    sightings: Sequence[tuple[int, Sighting]],
    sheet: Sheet,
    camera_m: Floats | None = None,
    height_m: float = 0.0,
) -> Path:
    """Put the sightings together.

    Parameters
    ----------
    sightings
        Frame numbers and what was seen in them.
    sheet
        Geometry of the sheet.
    camera_m
        Where the camera is, x, y, z; needed to take the height back.
    height_m
        Height of the disc over the floor: what stands higher is seen further from the camera.
    """
    numbers = np.array([frame for frame, _ in sightings], dtype=np.int64)
    seen_m = np.array([one.centre_m for _, one in sightings]).reshape(-1, 2)
    points_px = project(sheet.to_image, seen_m)
    hidden_m = np.array([one.spread_m for _, one in sightings])
    # A tall body seen aslant is no disc: the same in all frames, so it does not show as jitter.
    unlike_m = float(np.median([one.bare * one.radius_m for _, one in sightings])) if sightings else 0.0
    points_m = seen_m
    if camera_m is not None and height_m > 0.0:
        points_m = seen_m + (camera_m[:2] - seen_m) * height_m / camera_m[2]
    jitter_px = _jitter(numbers, points_px)
    metres_per_px = np.array([np.linalg.norm(sheet.metres_per_px(point)) / 2**0.5 for point in points_px])
    from_pixels = np.hypot(jitter_px, sheet.corner_std_px) * metres_per_px
    return Path(numbers, points_px, points_m, np.sqrt(from_pixels**2 + hidden_m**2 + unlike_m**2), jitter_px)


def visited_cells(path: Path, size_m: float, grid: int) -> NDArray[np.bool_]:
    """Cells that the robot's centre was in, shape (grid, grid), row 0 the smallest y."""
    visited = np.zeros((grid, grid), dtype=np.bool_)
    cell_m = size_m / grid
    pieces = [path.points_m]
    for i in np.flatnonzero(np.diff(path.frames) <= _LONGEST_GAP):
        start, end = path.points_m[i], path.points_m[i + 1]
        steps = int(np.hypot(*(end - start)) / (0.1 * cell_m))
        if steps > 1:
            pieces.append(start + np.linspace(0.0, 1.0, steps + 1)[:, None] * (end - start))
    cells = np.floor(np.concatenate(pieces) / cell_m).astype(int)
    inside = np.all((cells >= 0) & (cells < grid), axis=1)
    visited[cells[inside, 1], cells[inside, 0]] = True
    return visited


def _jitter(frames: NDArray[np.int64], points: Floats) -> float:
    """Noise from frame to frame: a smooth path has no second difference, noise has sqrt(6) of it."""
    if len(points) < 3:
        return 0.0
    bend = (points[2:] - 2.0 * points[1:-1] + points[:-2])[np.diff(frames, 2) == 0] / 6**0.5
    if not len(bend):
        return 0.0
    robust = 1.4826 * np.median(np.abs(bend), axis=0)
    return float(np.sqrt(np.mean(robust**2)))
