"""The scene of a run on terrain: ground and hazards, the path, its estimate, what was in sight."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pilotage.core.types import FloatArray, IntArray
from pilotage.records.run_data import RunData
from pilotage.records.terrain import TerrainPictures
from pilotage.report.replay.common import position_error, scene_events
from pilotage.report.replay.scene import (
    Marks,
    PathTrack,
    PoseTrack,
    Raster,
    ReplayScene,
    Series,
    SightTrack,
)
from pilotage.report.replay.upright import box_around, upright
from pilotage.report.style import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION

MOST_FRAMES = 6000
"""Drives of a hundred thousand seconds change little from one step to the next."""
GREYS, SHARES = 24, 4
"""Levels of light on the ground, and of the share of hazards in a block of cells."""
DARKEST, BRIGHTEST = 95, 235
HAZARD_STRENGTH = 0.55
MARGIN = 0.02
ROVER_RADIUS_M = 1.5
FOLLOW_SHARE, FOLLOW_LEAST_M = 0.06, 20.0
"""Width of the view that follows the rover, as a share of the map's."""


def terrain_scene(run: RunData) -> ReplayScene | None:
    """Return what there is to replay; None where the rover goes nowhere."""
    trace = run.trace
    driven = trace.has("true_x_m", "true_y_m")
    if trace.steps < 2 or not (driven or trace.has("path_x_m", "path_y_m")):
        return None
    t_s = trace.t_s
    if not bool(np.isfinite(t_s).all()) or bool((np.diff(t_s) <= 0.0).any()):
        return None
    stride = math.ceil(trace.steps / MOST_FRAMES)
    frames = np.unique(np.append(np.arange(0, trace.steps, stride), trace.steps - 1))
    pictures = run.terrain
    bounds = _bounds(run, pictures)
    width_m = max(bounds[2] - bounds[0], bounds[3] - bounds[1])
    note = "" if driven else "Nothing was driven: the rover is shown along the planned path at its speed."
    return ReplayScene(
        t_s=t_s[frames],
        bounds_m=bounds,
        rasters=() if pictures is None else (ground_raster(pictures),),
        marks=() if pictures is None else _marks(pictures),
        paths=() if pictures is None else _route(pictures),
        poses=_poses(run, frames),
        sights=() if pictures is None else _sights(pictures, frames, trace.steps),
        series=_series(run, frames),
        events=scene_events(run),
        note=f"{note} One step in {stride} is shown.".strip() if stride > 1 else note,
        follow_m=max(FOLLOW_SHARE * width_m, FOLLOW_LEAST_M),
    )


def ground_raster(pictures: TerrainPictures) -> Raster:
    """The ground with its hazards tinted, along the axes; of turned ground, the box around it."""
    levels, shares = _levels(pictures), _quantised(pictures.hazards, SHARES)
    cells = (levels * SHARES + shares).astype(np.int64)[::-1] + 1
    palette = ("transparent", *(_colour(k // SHARES, k % SHARES) for k in range(GREYS * SHARES)))
    bounds, cells = upright(cells, pictures.origin, pictures.size_m)
    return Raster("ground, hazards tinted", bounds, cells, palette, smooth=True)


def _levels(pictures: TerrainPictures) -> IntArray:
    if pictures.ground is None:
        return np.full(pictures.hazards.shape, GREYS - 1, dtype=np.int64)
    return _quantised(pictures.ground, GREYS)


def _quantised(picture: NDArray[np.uint8], levels: int) -> IntArray:
    return np.minimum(picture.astype(np.int64) * levels // 255, levels - 1)


def _colour(level: int, share: int) -> str:
    """A grey, the more tinted the more of the block is a hazard."""
    grey = DARKEST + (BRIGHTEST - DARKEST) * level / (GREYS - 1)
    part = HAZARD_STRENGTH * share / (SHARES - 1)
    tint = [int(ORANGE[i : i + 2], 16) for i in (1, 3, 5)]
    red, green, blue = (round(grey * (1.0 - part) + c * part) for c in tint)
    return f"#{red:02x}{green:02x}{blue:02x}"


def _bounds(run: RunData, pictures: TerrainPictures | None) -> tuple[float, float, float, float]:
    if pictures is not None:
        return box_around(pictures.origin, pictures.size_m)
    names = ("true", "path") if run.trace.has("true_x_m") else ("path",)
    x = np.concatenate([run.trace[f"{name}_x_m"] for name in names])
    y = np.concatenate([run.trace[f"{name}_y_m"] for name in names])
    x0, x1, y0, y1 = (float(f(v)) for v in (x, y) for f in (np.nanmin, np.nanmax))
    pad = MARGIN * max(x1 - x0, y1 - y0, 1.0)
    return x0 - pad, y0 - pad, x1 + pad, y1 + pad


def _marks(pictures: TerrainPictures) -> tuple[Marks, ...]:
    marks = [
        Marks("start", pictures.start.reshape(1, 2), ("start",), "ink", "ring"),
        Marks("goal", pictures.goal.reshape(1, 2), ("goal",), VERMILLION, "cross"),
    ]
    if len(pictures.landmarks):
        marks.insert(0, Marks("landmarks", pictures.landmarks, (), GREEN, "dot"))
    return tuple(marks)


def _route(pictures: TerrainPictures) -> tuple[PathTrack, ...]:
    if len(pictures.route) < 2:
        return ()
    return (PathTrack("plan", np.zeros(1), (_bends(pictures.route),), PURPLE),)


def _bends(path: FloatArray) -> FloatArray:
    """The points at which a path changes its direction, and both ends."""
    step = np.diff(path, axis=0)
    cross = step[:-1, 0] * step[1:, 1] - step[:-1, 1] * step[1:, 0]
    kept = np.concatenate([[True], np.abs(cross) > 1e-9 * np.abs(step).max() ** 2, [True]])
    return np.asarray(path[kept])


def _poses(run: RunData, frames: IntArray) -> tuple[PoseTrack, ...]:
    trace = run.trace

    def column(name: str) -> FloatArray:
        return trace[name][frames]

    if not trace.has("true_x_m", "true_y_m"):
        x, y = column("path_x_m"), column("path_y_m")
        theta = np.arctan2(np.diff(y, append=y[-1:]), np.diff(x, append=x[-1:]))
        theta[-1] = theta[-2]
        return (PoseTrack("along the plan", x, y, theta, BLUE, radius_m=ROVER_RADIUS_M, trail=True),)
    truth = PoseTrack(
        "true pose",
        column("true_x_m"),
        column("true_y_m"),
        column("true_theta_rad"),
        BLUE,
        radius_m=ROVER_RADIUS_M,
        trail=True,
    )
    if not trace.has("est_x_m", "est_y_m"):
        return (truth,)
    cov = np.stack([column(f"cov_{axis}_m2") for axis in ("xx", "xy", "yy")], axis=1)
    estimate = PoseTrack(
        "estimate, 95 % ellipse",
        column("est_x_m"),
        column("est_y_m"),
        column("est_theta_rad"),
        VERMILLION,
        look="outline",
        radius_m=ROVER_RADIUS_M,
        trail=True,
        cov_m2=cov,
    )
    return truth, estimate


def _sights(pictures: TerrainPictures, frames: IntArray, steps: int) -> tuple[SightTrack, ...]:
    """Landmarks in sight at the frames; nothing where they are not those of this trace."""
    counts = pictures.seen_counts
    if len(counts) != steps or not len(pictures.seen):
        return ()
    first = np.concatenate([[0], np.cumsum(counts)])
    seen = [pictures.seen[first[frame] : first[frame + 1]] for frame in frames]
    points = pictures.landmarks[np.concatenate(seen)]
    return (SightTrack("landmarks in sight", counts[frames], points, 0, GREEN),)


def _series(run: RunData, frames: IntArray) -> tuple[Series, ...]:
    trace = run.trace

    def column(name: str) -> FloatArray:
        return trace[name][frames]

    estimated = trace.has("est_x_m", "est_y_m")
    series = [position_error(column)]
    if estimated:
        series.append(Series("landmarks in sight", "", column("beacons_seen"), GREEN))
    else:
        series.append(Series("speed", "m/s", column("v_true_m_s"), BLUE))
        series.append(Series("steering", "°", np.degrees(column("steering_rad")), PURPLE))
    series.append(Series("nearest hazard", "m", column("hazard_distance_m"), ORANGE))
    series.append(Series("height above the lowest", "m", _above(column("elevation_m")), SKY))
    series.append(Series("slope", "°", np.degrees(column("slope_rad")), SKY))
    return tuple(s for s in series if bool(np.isfinite(s.values).any()))[:5]


def _above(heights_m: FloatArray) -> FloatArray:
    known = heights_m[np.isfinite(heights_m)]
    return heights_m - known.min() if known.size else heights_m
