"""A run as a Rerun recording (extra ``rerun``): the world, every robot's poses and scans, all numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.extras import missing
from pilotage.core.shown import shown
from pilotage.core.types import FloatArray
from pilotage.core.whole_file import draft_of
from pilotage.records.events import require_times
from pilotage.records.run_data import RunData, read_run, read_team
from pilotage.records.trace import Trace, read_trace

CLOCK = "time"
GREY, RED, BLUE, GREEN, PINK = (90, 90, 90), (210, 90, 30), (30, 90, 200), (30, 150, 60), (220, 90, 170)
THIN_M, MARK_M = 0.02, 0.08


def rerun() -> Any:
    """Return the module ``rerun``.

    Raises
    ------
    InputError
        Where it is not installed, with the remedy.
    """
    try:
        import rerun
    except ImportError:
        raise missing("Rerun files need the library rerun-sdk, which is not installed", "rerun") from None
    return rerun


def write_rerun(path: Path, folder: Path) -> None:
    """Write one ``.rrd`` file, whole or not at all.

    Raises
    ------
    InputError
        Where Rerun is not installed, or the folder is no run's.
    """
    rr = rerun()
    first, whole = read_run(folder), read_trace(folder)
    team = read_team(folder, first)
    require_times(first.events, whole, folder)
    with draft_of(path) as draft:
        draft.touch()  # where nothing can be written that is told before all the work
        stream = rr.RecordingStream("pilotage", recording_id=shown(folder.name))
        # Rerun's own writer of files waits for ever, now and then, where the disk is full.
        kept = stream.memory_recording()
        try:
            _run(rr, stream, team, whole)
        finally:
            written = kept.drain_as_bytes()  # what is dropped undrained it warns of, in colours
        draft.write_bytes(written)


def _run(rr: Any, stream: Any, team: tuple[RunData, ...], whole: Trace) -> None:
    first = team[0]
    stream.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    _world(rr, stream, first)
    for robot, data in enumerate(team):
        # Robots may be called "robot 1", or what is no word of a path.
        name = rr.new_entity_path([data.robots[robot] if data.robots else "robot"])
        _robot(rr, stream, data, name)
        _numbers(rr, stream, whole.of(robot), f"{name}/trace")
    for event in first.events:
        stream.set_time(CLOCK, duration=event.t_s)
        stream.log("/events", rr.TextLog(f"{event.kind}: {event.text}"))


def _world(rr: Any, stream: Any, data: RunData) -> None:
    world = data.world
    for name, segments_m, circles_m, colour in (
        ("walls", world.segments_m, world.circles_m, GREY),
        ("obstacles", world.obstacle_segments_m, world.obstacle_circles_m, RED),
    ):
        rings = [_ring(*map(float, circle)) for circle in circles_m]
        strips = [_flat(segment.reshape(2, 2)) for segment in segments_m] + rings
        if name == "obstacles":
            strips += [_flat(np.vstack([p, p[:1]])) for p in world.obstacle_polygons_m if len(p)]
        if strips:
            lines = rr.LineStrips3D(strips, colors=[colour], radii=[THIN_M])
            stream.log(f"/world/{name}", lines, static=True)
    if world.landmarks:
        marks = np.array([(mark.x_m, mark.y_m) for mark in world.landmarks])
        names = [mark.id for mark in world.landmarks]
        points = rr.Points3D(_flat(marks), labels=names, colors=[BLUE], radii=[MARK_M], show_labels=False)
        stream.log("/world/landmarks", points, static=True)
    if data.grid is not None:
        rows, columns = np.nonzero(data.grid.cells >= 50)
        cell_m = data.grid.resolution_m
        inner = np.column_stack([(columns + 0.5) * cell_m, (len(data.grid.cells) - rows - 0.5) * cell_m])
        places = data.grid.origin.placed(inner)
        stream.log(
            "/world/cells", rr.Points3D(_flat(places), colors=[GREY], radii=[0.5 * cell_m]), static=True
        )


def _robot(rr: Any, stream: Any, data: RunData, name: str) -> None:
    trace = data.trace
    for kind, prefix, colour in (("truth", "true", GREEN), ("estimate", "est", BLUE)):
        poses = np.column_stack([trace[f"{prefix}_{part}"] for part in ("x_m", "y_m", "theta_rad")])
        known = np.isfinite(poses).all(axis=1)
        if not known.any():
            continue
        points, half = _flat(poses[known, :2]), 0.5 * poses[known, 2]
        zeros = np.zeros(len(half))
        turns = np.column_stack([zeros, zeros, np.sin(half), np.cos(half)])
        moves = rr.Transform3D.columns(translation=points, quaternion=turns)
        stream.send_columns(f"{name}/{kind}", indexes=[_clock(rr, trace.t_s[known])], columns=moves)
        stream.log(
            f"{name}/{kind}_path", rr.LineStrips3D([points], colors=[colour], radii=[THIN_M]), static=True
        )
        outline = _outline(data)
        if len(outline):
            body = rr.LineStrips3D([outline], colors=[colour], radii=[THIN_M])
            stream.log(f"{name}/{kind}/body", body, static=True)
    for plan in data.plans:
        stream.set_time(CLOCK, duration=float(np.nan_to_num(plan.t_s)))
        lines = rr.LineStrips3D([_flat(plan.path[:, :2])], colors=[PINK], radii=[THIN_M])
        stream.log(f"{name}/plan", lines)
    _scans(rr, stream, data, f"{name}/estimate/scan")


def _scans(rr: Any, stream: Any, data: RunData, entity: str) -> None:
    """The scans' points in the robot's frame, which moves with the estimate."""
    seen = data.sightings
    if not len(seen.scan_t_s):
        return
    hit = np.isfinite(seen.ranges_m)
    x_m, y_m, theta_rad = seen.mount
    angles = seen.angles_rad + theta_rad
    ranges = np.where(hit, seen.ranges_m, 0.0)
    places = np.stack([x_m + ranges * np.cos(angles), y_m + ranges * np.sin(angles)], axis=2)[hit]
    points = rr.Points3D.columns(positions=_flat(places)).partition(lengths=hit.sum(axis=1))
    stream.send_columns(entity, indexes=[_clock(rr, seen.scan_t_s)], columns=points)


def _numbers(rr: Any, stream: Any, trace: Trace, entity: str) -> None:
    """Every column of the trace as a series."""
    clock = _clock(rr, trace.t_s)
    for column, values in trace.columns.items():
        if column != "t_s":
            series = rr.Scalars.columns(scalars=values)
            stream.send_columns(entity + rr.new_entity_path([column]), indexes=[clock], columns=series)


def _clock(rr: Any, t_s: FloatArray) -> Any:
    return rr.TimeColumn(CLOCK, duration=t_s)


def _outline(data: RunData) -> FloatArray:
    polygon, radius_m = data.outline.polygon_m, data.outline.radius_m
    if len(polygon):
        return _flat(np.vstack([polygon, polygon[:1]]))
    return _ring(0.0, 0.0, radius_m) if radius_m is not None else np.empty((0, 3))


def _ring(x_m: float, y_m: float, radius_m: float) -> FloatArray:
    angles = np.linspace(0.0, 2.0 * np.pi, 33)
    return _flat(np.column_stack([x_m + radius_m * np.cos(angles), y_m + radius_m * np.sin(angles)]))


def _flat(points_m: FloatArray) -> FloatArray:
    """(N, 3) points on the floor."""
    return np.column_stack([points_m, np.zeros(len(points_m))])
