"""What a run folder tells, as ROS messages in the order of time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.bridges.ros import messages as ros
from pilotage.bridges.words import topic_words
from pilotage.core.types import FloatArray, Pose2
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.rasterize import rasterized
from pilotage.maps.segment_map import SegmentMap
from pilotage.records.events import require_times
from pilotage.records.reckoning import odometry_increments, reckoned
from pilotage.records.run_data import RunData, read_run, read_team
from pilotage.records.trace import Trace, read_trace
from pilotage.records.world import World

ROW_TYPE = "pilotage_msgs/msg/TraceRow"
"""A type of the run's own: one float64 a column of the trace, so that every viewer plots it by name."""
LOG_TYPE = "rcl_interfaces/msg/Log"
INFORMATION = 20
MAP_CELL_M = 0.05
MOST_MAP_CELLS = 4_000_000
MARK_M = 0.05
DARK, KNOWN_TO_NOBODY, BEACON, ROBOT = (0.2, 0.2, 0.2), (0.8, 0.3, 0.1), (0.1, 0.4, 0.8), (0.1, 0.6, 0.2)
CIRCLE_CORNERS = 24


@dataclass(frozen=True, slots=True)
class Stamped:
    """One message: its topic, time and type, and its fields as plain values."""

    topic: str
    time_ns: int
    msgtype: str
    fields: ros.Fields
    kept: bool = False
    """Whether whoever comes later is to have it too (a map, not a reading)."""


@dataclass(frozen=True, slots=True)
class RunMessages:
    """A run's messages, and the definitions of the types that ROS has not."""

    stamped: list[Stamped]
    own_types: dict[str, str]


def run_messages(folder: Path) -> RunMessages:
    """Read a run folder.

    Raises
    ------
    InputError
        Where it is none, or one of its files cannot be read.
    """
    first = read_run(folder)
    whole = read_trace(folder)
    require_times(first.events, whole, folder)
    team = read_team(folder, first)
    began_s = float(whole.t_s[0]) if whole.steps else 0.0
    out = list(_world(first, began_s))
    fields = field_names(whole)
    # Two robots on one topic could not be told apart.
    names = [f"/{word}" for word in topic_words(first.robots)] if len(team) > 1 else [""]
    for robot, (name, data) in enumerate(zip(names, team, strict=True)):
        out += _robot(data, name, began_s)
        out += _rows(whole.of(robot), name, fields)
    if first.events:
        out += [
            Stamped(
                "/events",
                ros.nanoseconds(event.t_s),
                LOG_TYPE,
                {"stamp": ros.stamp(event.t_s), "level": INFORMATION, "name": event.kind, "msg": event.text},
            )
            for event in first.events
        ]
    out.sort(key=lambda message: message.time_ns)
    definition = "".join(f"float64 {field}\n" for field in fields.values())
    return RunMessages(out, {ROW_TYPE: definition})


def field_names(trace: Trace) -> dict[str, str]:
    """The trace's columns by what a message may call them."""
    return dict(zip(trace.columns, topic_words(trace.columns), strict=True))


def _rows(trace: Trace, name: str, fields: dict[str, str]) -> Iterator[Stamped]:
    columns = [(field, trace[column]) for column, field in fields.items()]
    for k, t_s in enumerate(trace.t_s):
        row = {field: float(values[k]) for field, values in columns}
        yield Stamped(f"{name}/trace", ros.nanoseconds(t_s), ROW_TYPE, row)


def _robot(data: RunData, name: str, began_s: float) -> Iterator[Stamped]:
    """Poses, transforms, commands, scans and plans of one robot."""
    own = name.lstrip("/") + "/" if name else ""
    odom, base, truth = f"{own}odom", f"{own}base_link", f"{own}base_link_truth"
    trace = data.trace
    true = np.column_stack([trace["true_x_m"], trace["true_y_m"], trace["true_theta_rad"]])
    believed = np.column_stack([trace["est_x_m"], trace["est_y_m"], trace["est_theta_rad"]])
    driven, speeds = _odometry(trace)
    covs = _covariances(trace)
    placed = Pose2(0.0, 0.0, 0.0)
    for k, t in enumerate(trace.t_s):
        t_s = float(t)
        time_ns = ros.nanoseconds(t_s)
        frames = []
        here = _pose(believed[k])
        if here is not None:
            yield Stamped(
                f"{name}/pose", time_ns, ros.POSE, ros.pose_with_covariance(t_s, "map", here, covs[k])
            )
        if driven is not None:
            reckoned = Pose2.from_array(driven[k])
            placed = placed if here is None else here.compose(reckoned.inverse())
            frames += [
                ros.transform(t_s, "map", odom, placed),
                ros.transform(t_s, odom, base, reckoned),
            ]
            read = ros.odometry(t_s, odom, base, reckoned, ros.twist(*speeds[k]))
            yield Stamped(f"{name}/odom", time_ns, ros.ODOMETRY, read)
        elif here is not None:
            frames.append(ros.transform(t_s, "map", base, here))
        there = _pose(true[k])
        if there is not None:
            speed = ros.twist(_known(trace["v_true_m_s"][k]), _known(trace["w_true_rad_s"][k]))
            frames.append(ros.transform(t_s, "map", truth, there))
            yield Stamped(
                f"{name}/truth", time_ns, ros.ODOMETRY, ros.odometry(t_s, "map", truth, there, speed)
            )
        v, w, sideways = (trace[column][k] for column in ("v_cmd_m_s", "w_cmd_rad_s", "lateral_cmd_m_s"))
        if np.isfinite(v) and np.isfinite(w):
            yield Stamped(f"{name}/cmd_vel", time_ns, ros.TWIST, ros.twist(v, w, _known(sideways)))
        if frames:
            yield Stamped("/tf", time_ns, ros.TRANSFORMS, {"transforms": frames})
    began_ns = ros.nanoseconds(began_s)
    if data.outline.radius_m is not None:
        mark = ros.marker(0, f"{own}robot", base, ros.LINE_LIST, _closed(_outline(data)), MARK_M, ROBOT)
        yield Stamped(f"{name}/outline", began_ns, ros.MARKERS, {"markers": [mark]}, kept=True)
    for plan in data.plans:
        at_s = plan.t_s if np.isfinite(plan.t_s) else began_s
        yield Stamped(f"{name}/plan", ros.nanoseconds(at_s), ros.PATH, ros.path(at_s, "map", plan.path))
    seen = data.sightings
    if len(seen.scan_t_s):
        laser = f"{own}laser"
        mount = ros.transform(began_s, base, laser, Pose2.from_array(seen.mount))
        yield Stamped("/tf_static", began_ns, ros.TRANSFORMS, {"transforms": [mount]}, kept=True)
        for t, ranges in zip(seen.scan_t_s, seen.ranges_m, strict=True):
            scan = ros.laser_scan(float(t), laser, seen.angles_rad, ranges, seen.max_range_m)
            yield Stamped(f"{name}/scan", ros.nanoseconds(float(t)), ros.SCAN, scan)


def _odometry(trace: Trace) -> tuple[FloatArray | None, FloatArray]:
    """Poses (N, 3) in the odometry's own frame, which begins where the robot does, and (N, 3) the speeds
    forward, turning and to the left since the reading before; None and nothing without odometry."""
    steps = odometry_increments(trace)
    if steps is None:
        return None, np.empty((0, 3))
    speeds, rows = np.zeros((trace.steps, 3)), np.flatnonzero(np.isfinite(steps[:, 0]))
    if len(rows) > 1:
        apart_s = np.diff(trace.t_s[rows])
        apart_s = np.maximum(np.concatenate([apart_s[:1], apart_s]), 1e-9)
        last = np.maximum(np.searchsorted(rows, np.arange(trace.steps), side="right") - 1, 0)
        speeds = (steps[rows] / apart_s[:, None])[last]
    return reckoned(steps), speeds


def _covariances(trace: Trace) -> FloatArray:
    """(N, 3, 3)."""
    names = ("xx_m2", "xy_m2", "xt_m_rad", "xy_m2", "yy_m2", "yt_m_rad", "xt_m_rad", "yt_m_rad", "tt_rad2")
    return np.column_stack([trace[f"cov_{name}"] for name in names]).reshape(-1, 3, 3)


def _pose(values: FloatArray) -> Pose2 | None:
    return Pose2.from_array(values) if bool(np.isfinite(values).all()) else None


def _known(value: float) -> float:
    return float(value) if np.isfinite(value) else 0.0


def _world(data: RunData, began_s: float) -> Iterator[Stamped]:
    """The map as cells, and everything that stands in the world as lines."""
    world, began_ns = data.world, ros.nanoseconds(began_s)
    cells = data.grid or _drawn(world)
    if cells is not None:
        yield Stamped("/map", began_ns, ros.GRID, ros.grid(began_s, "map", cells), kept=True)
    hidden = [_closed(polygon) for polygon in world.obstacle_polygons_m]
    lines = (
        ("walls", [world.segments_m.reshape(-1, 2), *_circles(world.circles_m)], DARK),
        (
            "obstacles",
            [world.obstacle_segments_m.reshape(-1, 2), *_circles(world.obstacle_circles_m), *hidden],
            KNOWN_TO_NOBODY,
        ),
    )
    marks = [
        ros.marker(number, name, "map", ros.LINE_LIST, np.concatenate(pieces), MARK_M, colour)
        for number, (name, pieces, colour) in enumerate(lines)
        if sum(map(len, pieces))
    ]
    beacons = [(mark.x_m, mark.y_m) for mark in world.landmarks]
    if beacons:
        marks.append(ros.marker(len(lines), "landmarks", "map", ros.SPHERE_LIST, beacons, 4 * MARK_M, BEACON))
    if marks:
        yield Stamped("/world", began_ns, ros.MARKERS, {"markers": marks}, kept=True)


def _drawn(world: World) -> OccupancyGrid | None:
    """The known walls as cells."""
    if world.bounds_m is None or not (len(world.segments_m) or len(world.circles_m)):
        return None
    xmin, ymin, xmax, ymax = world.bounds_m
    cell_m = max(MAP_CELL_M, float(np.sqrt((xmax - xmin) * (ymax - ymin) / MOST_MAP_CELLS)))
    return rasterized(SegmentMap(world.segments_m, world.circles_m, world.bounds_m), cell_m)


def _outline(data: RunData) -> FloatArray:
    outline = data.outline
    if len(outline.polygon_m):
        return outline.polygon_m
    return _corners(0.0, 0.0, outline.radius_m or 0.0)


def _corners(x_m: float, y_m: float, radius_m: float) -> FloatArray:
    angles = np.linspace(0.0, 2.0 * np.pi, CIRCLE_CORNERS, endpoint=False)
    return np.column_stack([x_m + radius_m * np.cos(angles), y_m + radius_m * np.sin(angles)])


def _circles(circles_m: FloatArray) -> list[FloatArray]:
    return [_closed(_corners(*map(float, circle))) for circle in circles_m]


def _closed(polygon_m: FloatArray) -> FloatArray:
    """(2 K, 2) the ends of a polygon's K sides."""
    return np.stack([polygon_m, np.roll(polygon_m, -1, axis=0)], axis=1).reshape(-1, 2)
