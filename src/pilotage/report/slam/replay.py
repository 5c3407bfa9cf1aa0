"""The scene of a mapped recording: the map as it was seen bit by bit, the scanner's path, scans and loops."""

from __future__ import annotations

import itertools
import math

import numpy as np
import scipy

from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.scans.seen_cells import mark_seen
from pilotage.records.slam_folder import ClosureRow, SlamFolder
from pilotage.report.figures.grid import OCCUPIED_COLOUR, UNKNOWN_CELL, UNKNOWN_COLOUR, cell_classes
from pilotage.report.replay.scene import (
    PathTrack,
    PoseTrack,
    Raster,
    ReplayScene,
    ScanTrack,
    SceneEvent,
    Series,
)
from pilotage.report.style import BLUE, GREEN, ORANGE, SKY

MOST_FRAMES = 5000
MOST_SCAN_VALUES = 250_000
MOST_CELLS = 500
"""Cells of the map along its longer side."""
MOST_LOOKS = 20_000_000
"""Pairs of a cell and a keyframe that are looked at; of more keyframes some are left out, evenly."""
SCANNER_M = 0.2
PALETTE = ("#ffffff", UNKNOWN_COLOUR, OCCUPIED_COLOUR)


def slam_scene(data: SlamFolder) -> ReplayScene | None:
    """Return what there is to replay; None for a recording of one moment or one whose stamps do not rise."""
    t_s = data.t_s - data.t_s[0]
    if t_s.size < 2 or not bool((np.diff(t_s) >= 0.0).all()) or t_s[-1] <= 0.0:
        return None
    own = data.keyframes.scans >= 0
    frames = np.arange(0, t_s.size, math.ceil(t_s.size / MOST_FRAMES))
    frames = np.unique(np.concatenate([frames, data.keyframes.scans[own], [t_s.size - 1]]))
    # The player's frames rise; of scans of one stamp the last counts.
    frames = frames[np.append(np.diff(t_s[frames]) > 0.0, True)]
    raster = _growing(data)
    xx, xy, yy = (data.covariances[frames, a, b] for a, b in ((0, 0), (0, 1), (1, 1)))
    closed = sorted((c for c in data.closures if c.accepted), key=lambda c: float(c.later_t_s))
    return ReplayScene(
        t_s=t_s[frames],
        bounds_m=_bounds(raster, data),
        rasters=(raster,),
        paths=_loops(data, closed),
        poses=(
            _track("scanner, 95 % ellipse", data.poses[frames], BLUE, np.stack([xx, xy, yy], axis=1)),
            _track("by matching alone", data.before[frames], ORANGE, None),
        ),
        scans=_scans(data, own),
        series=_series(data.covariances[frames]),
        events=_events(data, closed),
        note="A cell of the map appears, as the closed graph has it, when a keyframe first sees it.",
    )


def _track(name: str, poses: FloatArray, colour: str, cov_m2: FloatArray | None) -> PoseTrack:
    look = "outline" if cov_m2 is None else "robot"
    x, y, theta = poses.T
    return PoseTrack(name, x, y, theta, colour, look, SCANNER_M, trail=True, cov_m2=cov_m2)


def _growing(data: SlamFolder) -> Raster:
    """The map, each cell from when it was first seen."""
    classes, (width, height) = cell_classes(data.grid, MOST_CELLS)
    classes = classes[::-1]
    rows, columns = classes.shape
    x0, y0 = data.grid.origin.x_m, data.grid.origin.y_m
    side = float(width) / columns
    cells = np.flatnonzero(classes != UNKNOWN_CELL)
    middles = np.column_stack([cells % columns, cells // columns]) * side + (x0 + 0.5 * side, y0 + 0.5 * side)
    seen_s = _first_seen(data, middles, side)
    order = np.lexsort((cells, seen_s))
    return Raster(
        "map",
        (x0, y0, x0 + float(width), y0 + float(height)),
        np.full((rows, columns), UNKNOWN_CELL, dtype=np.int64),
        PALETTE,
        change_t_s=seen_s[order],
        change_cell=cells[order].astype(np.int64),
        change_value=classes.ravel()[cells[order]].astype(np.int64),
    )


def _first_seen(data: SlamFolder, middles: FloatArray, side_m: float) -> FloatArray:
    """(K,) when a keyframe first had the middle of a cell in view; 0 for what an earlier map held."""
    times = _times(data)
    seen_s = np.full(len(middles), np.inf)
    step = max(1, math.ceil(len(middles) * len(times) / MOST_LOOKS))
    # From the last one on, so that in the end the first one stands.
    for k in range((len(times) - 1) // step * step, -1, -step):
        beams = int(data.keyframes.beams[k])
        ranges = np.nan_to_num(data.keyframes.ranges_m[k, :beams].astype(np.float64), nan=0.0, posinf=0.0)
        if beams < 2 or not bool((ranges > 0.0).any()):
            continue
        x, y, theta = data.keyframe_poses[k].tolist()
        first = theta + float(data.keyframes.first_angle_rad[k])
        turn, reach = float(data.keyframes.angle_step_rad[k]), float(ranges.max()) + side_m
        if turn < 0.0:
            first, turn, ranges = first + (beams - 1) * turn, -turn, ranges[::-1].copy()
        mark_seen(seen_s, middles, x, y, first, turn, ranges, reach, side_m, float(times[k]))
    # Floor that only beams without a return told of.
    left = ~np.isfinite(seen_s)
    if bool(left.any()):
        seen_s[left] = times[scipy.spatial.KDTree(data.keyframe_poses[:, :2]).query(middles[left])[1]]
    return seen_s


def _times(data: SlamFolder) -> FloatArray:
    """(K,) of the keyframes, from the recording's start on."""
    return np.where(data.keyframes.scans >= 0, data.t_s[data.keyframes.scans] - data.t_s[0], 0.0)


def _scans(data: SlamFolder, own: BoolArray) -> tuple[ScanTrack, ...]:
    """Scans of the keyframes, where all have the same beams."""
    chosen = np.flatnonzero(own)
    if not chosen.size:
        return ()
    beams = data.keyframes.beams[chosen]
    angles = np.stack([data.keyframes.first_angle_rad[chosen], data.keyframes.angle_step_rad[chosen]])
    if beams.min() != beams.max() or bool((np.ptp(angles, axis=1) > 1e-6).any()):
        return ()
    count = int(beams[0])
    beam = np.arange(0, count, math.ceil(chosen.size * count / MOST_SCAN_VALUES))
    ranges = data.keyframes.ranges_m[np.ix_(chosen, beam)].astype(np.float64)
    ranges[~np.isfinite(ranges) | (ranges <= 0.0)] = np.nan
    directions = angles[0, 0] + beam * angles[1, 0]
    return (ScanTrack("scan", _times(data)[chosen], ranges, directions, data.keyframe_poses[chosen], SKY),)


def _loops(data: SlamFolder, closed: list[ClosureRow]) -> tuple[PathTrack, ...]:
    """Each closed loop as a line between its two stretches, shown until the next one."""
    if not closed:
        return ()
    times = np.array([c.later_t_s for c in closed]) - data.t_s[0]
    lines = tuple(
        np.array([data.reference(end)[:2] for end in (c.earlier_submap, c.later_submap)]) for c in closed
    )
    return (PathTrack("loop closed last", times, lines, GREEN),)


def _events(data: SlamFolder, closed: list[ClosureRow]) -> tuple[SceneEvent, ...]:
    """One event for all loops that a stretch closed."""
    out = []
    for t_s, group in itertools.groupby(closed, key=lambda c: float(c.later_t_s)):
        numbers = ", ".join(str(c.number) for c in group)
        out.append(SceneEvent(t_s - float(data.t_s[0]), "loops closed", f"no. {numbers}", GREEN))
    return tuple(out)


def _series(covariances: FloatArray) -> tuple[Series, ...]:
    largest = np.sqrt(np.maximum(np.linalg.eigvalsh(covariances[:, :2, :2])[:, -1], 0.0))
    heading = np.degrees(np.sqrt(np.maximum(covariances[:, 2, 2], 0.0)))
    return (
        Series("std. dev. of position", "m", largest, BLUE),
        Series("std. dev. of heading", "deg", heading, BLUE),
    )


def _bounds(raster: Raster, data: SlamFolder) -> tuple[float, float, float, float]:
    """The box around the known cells and the path."""
    x0, y0, _, _ = raster.bounds_m
    columns = raster.cells.shape[1]
    side = (raster.bounds_m[2] - x0) / columns
    column, row = raster.change_cell % columns, raster.change_cell // columns
    x = np.concatenate([x0 + side * column, x0 + side * (column + 1), data.poses[:, 0]])
    y = np.concatenate([y0 + side * row, y0 + side * (row + 1), data.poses[:, 1]])
    return float(x.min()), float(y.min()), float(x.max()), float(y.max())
