"""The scene of a run on a floor: map, truth, belief, what was seen, plans and reference."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray, IntArray, Pose2
from pilotage.records.run_data import RunData
from pilotage.report.figures.grid import OCCUPIED_COLOUR, UNKNOWN_COLOUR, cell_classes, known_corners
from pilotage.report.figures.layers import PEOPLE_COLOUR, body_outline
from pilotage.report.modes import MODES
from pilotage.report.replay.common import Column, position_error, scene_events
from pilotage.report.replay.scene import (
    Circles,
    DiscTrack,
    Lines,
    Marks,
    PathTrack,
    PoseTrack,
    Raster,
    ReplayScene,
    ScanTrack,
    Series,
    SightTrack,
    States,
)
from pilotage.report.replay.upright import upright
from pilotage.report.style import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION

MOST_FRAMES = 20_000
"""A longer run is thinned; a page must stay one that can be sent by mail."""
MOST_SCAN_VALUES = 400_000
MOST_PATH_POINTS = 1500
DEFAULT_RADIUS_M = 0.2
GRID_PALETTE = ("transparent", UNKNOWN_COLOUR, OCCUPIED_COLOUR)


def floor_scene(run: RunData) -> ReplayScene | None:
    """Return what there is to replay; None where the run left no true path and no estimate."""
    trace = run.trace
    truth = trace.has("true_x_m", "true_y_m")
    if trace.steps < 2 or not (truth or trace.has("est_x_m", "est_y_m")):
        return None
    t_s = trace.t_s
    if not bool(np.isfinite(t_s).all()) or bool((np.diff(t_s) <= 0.0).any()):
        return None
    stride = math.ceil(trace.steps / MOST_FRAMES)
    frames = np.arange(0, trace.steps, stride)
    if frames[-1] != trace.steps - 1:
        frames = np.append(frames, trace.steps - 1)

    def column(name: str) -> FloatArray:
        values = trace[name][frames]
        return np.where(np.isfinite(values), values, np.nan)

    poses = _poses(run, column)
    scan = _scan(run, t_s[frames])
    note = [
        f"One step in {stride} is shown." if stride > 1 else "",
        "Scans are thinned, in time and in beams." if scan else "",
    ]
    return ReplayScene(
        t_s=t_s[frames],
        bounds_m=_bounds(run, poses),
        rasters=_rasters(run),
        lines=_lines(run),
        circles=(
            Circles("walls", run.world.circles_m, "ink"),
            Circles("unexpected obstacles", run.world.obstacle_circles_m, VERMILLION),
        ),
        marks=_marks(run),
        paths=_paths(run),
        poses=poses,
        discs=_people(run, t_s[frames]),
        scans=scan,
        sights=_sights(run, frames, 0),
        states=_states(column),
        series=_series(column),
        events=scene_events(run),
        breaks=_breaks(run, t_s[frames]),
        note=" ".join(part for part in note if part),
    )


def _poses(run: RunData, column: Column) -> tuple[PoseTrack, ...]:
    radius_m, body_m = run.outline.radius_m or DEFAULT_RADIUS_M, run.outline.polygon_m
    tracks = []
    if run.trace.has("true_x_m", "true_y_m"):
        tracks.append(
            PoseTrack(
                "true pose",
                column("true_x_m"),
                column("true_y_m"),
                column("true_theta_rad"),
                colour=BLUE,
                radius_m=radius_m,
                trail=True,
                body_m=body_m,
            )
        )
    if run.trace.has("est_x_m", "est_y_m"):
        cov = np.stack([column(f"cov_{axis}_m2") for axis in ("xx", "xy", "yy")], axis=1)
        tracks.append(
            PoseTrack(
                "estimate, 95 % ellipse",
                column("est_x_m"),
                column("est_y_m"),
                column("est_theta_rad"),
                colour=ORANGE,
                look="outline",
                radius_m=radius_m,
                cov_m2=cov,
                absent="lost",
                body_m=body_m,
            )
        )
    if run.trace.has("ref_x_m", "ref_y_m"):
        x, y, theta = column("ref_x_m"), column("ref_y_m"), column("ref_theta_rad")
        tracks.append(PoseTrack("reference", x, y, theta, colour=PURPLE, look="point"))
    return tuple(tracks)


def _people(run: RunData, frames_s: FloatArray) -> tuple[DiscTrack, ...]:
    """Everybody at the frames."""
    people = run.people
    if not len(people.t_s):
        return ()
    return (DiscTrack("people", people.at(frames_s), people.radius_m, PEOPLE_COLOUR),)


def _lines(run: RunData) -> tuple[Lines, ...]:
    world, outline = run.world, run.outline
    goal = outline.goals[-1] if outline.goals else None
    bay = None
    if goal is not None and goal[2] is not None and len(outline.polygon_m):
        bay = body_outline(goal[0], goal[1], goal[2], 0.0, outline.polygon_m)
    return (
        Lines("unexpected obstacles", world.obstacle_polygons_m, VERMILLION, fill=True),
        Lines("unexpected obstacles", _segments(world.obstacle_segments_m), VERMILLION, 2.5),
        # The walls of a grid are its cells.
        *((Lines("walls", _segments(world.segments_m), "ink", 2.2),) if run.grid is None else ()),
        *((Lines("goal", (bay,), "muted", 1.5, dash=True),) if bay is not None else ()),
    )


def _rasters(run: RunData) -> tuple[Raster, ...]:
    if run.grid is None:
        return ()
    classes, size_m = cell_classes(run.grid)
    box, cells = upright(classes[::-1], run.grid.origin.as_array(), size_m)
    return (Raster("map", box, cells, GRID_PALETTE),)


def _segments(table: FloatArray) -> tuple[FloatArray, ...]:
    return tuple(row.reshape(2, 2) for row in table)


def _marks(run: RunData) -> tuple[Marks, ...]:
    world, outline = run.world, run.outline
    marks = []
    if world.landmarks:
        points = np.array([[mark.x_m, mark.y_m] for mark in world.landmarks])
        marks.append(Marks("landmarks", points, tuple(mark.id for mark in world.landmarks), GREEN))
    starts = () if outline.start is None else (outline.start,)
    for name, places, look in (("start", starts, "ring"), ("goal", outline.goals, "cross")):
        if places:
            points = np.array([place[:2] for place in places], dtype=np.float64)
            names = (name,) if len(places) == 1 else tuple(f"{name} {k}" for k in range(1, len(places) + 1))
            marks.append(Marks(name, points, names, "muted", look))
    return tuple(marks)


def _paths(run: RunData) -> tuple[PathTrack, ...]:
    plans = [(p.t_s, p.path[:, :2]) for p in run.plans if math.isfinite(p.t_s) and len(p.path) > 1]
    if not plans:
        return ()
    plans.sort(key=lambda plan: plan[0])
    thinned = tuple(path[_evenly(len(path), MOST_PATH_POINTS)] for _, path in plans)
    return (PathTrack("plan", np.array([t for t, _ in plans]), thinned, PURPLE),)


def _evenly(n: int, most: int) -> IntArray:
    return np.unique(np.linspace(0, n - 1, min(n, most)).round().astype(np.int64))


def _scan(run: RunData, frames_s: FloatArray) -> tuple[ScanTrack, ...]:
    """Each frame's nearest scan, thinned."""
    seen = run.sightings
    if not seen.ranges_m.size:
        return ()
    middles = 0.5 * (seen.scan_t_s[1:] + seen.scan_t_s[:-1])
    nearest = np.unique(np.searchsorted(middles, frames_s - 1e-6))
    stride = max(1, math.ceil(nearest.size * seen.ranges_m.shape[1] / MOST_SCAN_VALUES))
    shown = nearest[::stride]
    mount = Pose2.from_array(seen.mount)
    track = ScanTrack(
        "scan",
        seen.scan_t_s[shown],
        seen.ranges_m[shown],
        seen.angles_rad,
        np.array([Pose2.from_array(pose).compose(mount).as_array() for pose in seen.scan_poses[shown]]),
        SKY,
    )
    return (track,)


def _sights(run: RunData, frames: IntArray, seen_from: int) -> tuple[SightTrack, ...]:
    """Beacons seen at the frames; an id that the map does not hold (two maps mixed) draws nothing."""
    seen = run.sightings
    if len(seen.beacon_counts) != run.trace.steps or not len(seen.beacon_ids):
        return ()
    places = {mark.id: (mark.x_m, mark.y_m) for mark in run.world.landmarks}
    starts = np.concatenate([[0], np.cumsum(seen.beacon_counts)])
    counts, points = [], []
    for frame in frames:
        ids = seen.beacon_ids[starts[frame] : starts[frame + 1]]
        found = [places[str(i)] for i in ids if str(i) in places]
        counts.append(len(found))
        points += found
    table = np.array(points, dtype=np.float64).reshape(-1, 2)
    return (SightTrack("beacons seen", np.array(counts), table, seen_from, GREEN),)


def _states(column: Column) -> States | None:
    mode = column("mode")
    if not bool(np.isfinite(mode).any()):
        return None
    numbers = np.full(len(mode), -1, dtype=np.int64)
    for index, known in enumerate(MODES):
        numbers[mode == known.number] = index
    return States("mode", numbers, tuple(m.name for m in MODES), tuple(m.colour for m in MODES))


def _series(column: Column) -> tuple[Series, ...]:
    command = column("v_cmd_m_s")
    series = [
        position_error(column),
        Series(
            "speed",
            "m/s",
            column("v_true_m_s"),
            BLUE,
            other=command if bool(np.isfinite(command).any()) else None,
            other_name="command",
        ),
        Series("clearance", "m", column("clearance_m"), GREEN),
    ]
    return tuple(s for s in series if bool(np.isfinite(s.values).any()))


def _breaks(run: RunData, t_s: FloatArray) -> IntArray:
    """Frames that a carried robot begins anew at."""
    times = [e.t_s for e in run.events if e.kind == "kidnap" and math.isfinite(e.t_s)]
    frames = np.searchsorted(t_s, np.array(times) + 1e-6, side="left")
    return np.asarray(frames[frames < len(t_s)], dtype=np.int64)


def _bounds(run: RunData, poses: tuple[PoseTrack, ...]) -> tuple[float, float, float, float]:
    if run.grid is not None:
        corners = known_corners(run.grid)
        (x0, y0), (x1, y1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        return x0, y0, x1, y1
    if run.world.bounds_m is not None:
        return run.world.bounds_m
    x = np.concatenate([p.x_m for p in poses] + [run.world.segments_m[:, [0, 2]].reshape(-1)])
    y = np.concatenate([p.y_m for p in poses] + [run.world.segments_m[:, [1, 3]].reshape(-1)])
    pad = 1.0
    return (
        float(np.nanmin(x)) - pad,
        float(np.nanmin(y)) - pad,
        float(np.nanmax(x)) + pad,
        float(np.nanmax(y)) + pad,
    )
