"""Rooms of segments and the scans that a laser takes in them, for tests of the mapper."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.logs.laser_log import LaserLog

BEAMS = 180
SPAN_RAD = np.pi


def room(x0: float, y0: float, x1: float, y1: float) -> list[tuple[float, float, float, float]]:
    """Four walls."""
    return [(x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0)]


def furnished() -> FloatArray:
    """A room of 10 x 7 m with a box, a pillar and a niche, unlike itself from every side."""
    walls = room(0.0, 0.0, 10.0, 7.0) + room(3.0, 2.0, 4.2, 2.8) + room(7.0, 4.5, 7.4, 4.9)
    return np.array([*walls, (0.0, 5.0, 1.5, 5.0), (6.0, 0.0, 6.0, 1.4)])


def ranges(walls: FloatArray, pose: FloatArray, angles: FloatArray) -> FloatArray:
    """Distances (B,) along beams to segments (W, 4); infinite where none is hit."""
    directions = np.stack([np.cos(pose[2] + angles), np.sin(pose[2] + angles)], axis=1)
    start, along = walls[:, :2] - pose[:2], walls[:, 2:] - walls[:, :2]
    cross = directions[:, None, 0] * along[None, :, 1] - directions[:, None, 1] * along[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0])[None] / cross
        u = (start[None, :, 0] * directions[:, None, 1] - start[None, :, 1] * directions[:, None, 0]) / cross
        hit = (t > 0.0) & (u >= 0.0) & (u <= 1.0)
    return np.asarray(np.where(hit, t, np.inf).min(axis=1), dtype=np.float64)


def recording(
    walls: FloatArray,
    path: FloatArray,
    rng: np.random.Generator,
    range_std_m: float = 0.01,
    drift: float = 0.02,
    beams: int = BEAMS,
) -> LaserLog:
    """A laser log along poses (N, 3), a scan every 0.2 s, with odometry whose path and turns are too long."""
    step = SPAN_RAD / (beams - 1)
    angles = np.asarray(-0.5 * SPAN_RAD + step * np.arange(beams), dtype=np.float64)
    scans = np.array([ranges(walls, pose, angles) for pose in path])
    scans = np.asarray(scans + range_std_m * rng.standard_normal(scans.shape), dtype=np.float64)
    odometry = np.zeros_like(path)
    for k in range(1, len(path)):
        c, s = np.cos(path[k - 1, 2]), np.sin(path[k - 1, 2])
        dx, dy = path[k, :2] - path[k - 1, :2]
        turn = (path[k, 2] - path[k - 1, 2] + np.pi) % (2.0 * np.pi) - np.pi
        x, y = (1.0 + drift) * (c * dx + s * dy), (1.0 + drift) * (-s * dx + c * dy)
        co, so = np.cos(odometry[k - 1, 2]), np.sin(odometry[k - 1, 2])
        odometry[k] = odometry[k - 1] + [co * x - so * y, so * x + co * y, (1.0 + drift) * turn]
    t_s = np.asarray(0.2 * np.arange(len(path)), dtype=np.float64)
    return LaserLog(
        "simulated",
        t_s,
        np.where(scans < 30.0, scans, np.inf),
        np.full(len(path), beams, np.int64),
        np.full(len(path), angles[0]),
        np.full(len(path), step),
        0.05,
        30.0,
        Pose2(0.0, 0.0, 0.0),
        False,
        t_s,
        odometry,
    )


def write_carmen(path: Path, log: LaserLog) -> Path:
    """Write a log with odometry as a CARMEN file."""
    assert log.odometry is not None
    lines = []
    for k in range(len(log)):
        x, y, a = log.odometry[k]
        pose = f"{x:.5f} {y:.5f} {a:.5f}"
        beams = " ".join(f"{min(r, 81.0):.3f}" for r in log.ranges_m[k])
        lines.append(f"ODOM {pose} 0 0 0 {log.t_s[k]:.3f} host {log.t_s[k]:.3f}\n")
        lines.append(f"FLASER {log.beams[k]} {beams} {pose} {pose} {log.t_s[k]:.3f} host {log.t_s[k]:.3f}\n")
    path.write_text("".join(lines), encoding="utf-8")
    return path


def along(corners: list[tuple[float, float]], step_m: float = 0.08, turn_rad: float = 0.12) -> FloatArray:
    """Poses (N, 3) of a robot that drives from corner to corner and turns in place at each."""
    poses: list[list[float]] = []
    heading = None
    for (x0, y0), (x1, y1) in pairwise(corners):
        course = float(np.arctan2(y1 - y0, x1 - x0))
        if heading is not None:
            turn = (course - heading + np.pi) % (2.0 * np.pi) - np.pi
            count = int(abs(turn) / turn_rad)
            poses += [[x0, y0, heading + turn * k / (count + 1)] for k in range(1, count + 1)]
        length = float(np.hypot(x1 - x0, y1 - y0))
        count = max(1, int(length / step_m))
        poses += [[x0 + (x1 - x0) * k / count, y0 + (y1 - y0) * k / count, course] for k in range(count)]
        heading = course
    out = np.array(poses)
    out[:, 2] = (out[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    return out
