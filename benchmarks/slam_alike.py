"""Simulated buildings made to look alike: wrong closures, missed ones, and how far the map is off.

    python -m benchmarks.slam_alike --first 0 --count 20

Each seed draws a building (a ring of corridors with niches at a regular spacing, a row of equal rooms,
blocks of equal corridors, a hall that is itself after half a turn), a drive through it, a scanner (8, 30 or
80 m, 181 beams) and an odometry with scale, turn bias and noise. A closure is wrong that is off by more
than 0.5 m or 0.2 rad, along the course of a corridor that it leaves open excepted. A stretch of path that
lies within 1.5 m and 0.6 rad of an earlier one should be closed: it is missed where no closure of it or its
neighbours is accepted.
"""

from __future__ import annotations

import argparse
import time
from itertools import pairwise

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.slam.frames import between, composed
from pilotage.logs.laser_log import LaserLog
from pilotage.stack.mapping.slam.closures import COUNTING, LEAST_APART
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.mapper import map_log
from pilotage.stack.mapping.slam.result import SlamResult

BEAMS, STEP_M, TURN_RAD, SCAN_S = 181, 0.1, 0.12, 0.2
WRONG_M, WRONG_RAD = 0.5, 0.2
AGAIN_M, AGAIN_RAD, NEIGHBOURS = 1.5, 0.6, 3
Building = tuple[list[FloatArray], list[tuple[float, float]]]
"""Walls (4,) each, and the corners of the drive."""


def polyline(corners: list[tuple[float, float]], closed: bool = True) -> list[FloatArray]:
    """Walls from corner to corner."""
    around = [*corners, corners[0]] if closed else corners
    return [np.array([*a, *b]) for a, b in pairwise(around)]


def niched(start: FloatArray, end: FloatArray, spacing_m: float, depth_m: float) -> list[FloatArray]:
    """A wall with niches on its right at a regular spacing."""
    course = (end - start) / np.hypot(*(end - start))
    outward = np.array([course[1], -course[0]])
    corners = [start]
    for k in range(int(np.hypot(*(end - start)) / spacing_m)):
        first, last = (start + course * spacing_m * (k + share) for share in (0.35, 0.6))
        corners += [first, first + depth_m * outward, last + depth_m * outward, last]
    return polyline([(float(x), float(y)) for x, y in [*corners, end]], closed=False)


def ring(rng: np.random.Generator) -> Building:
    """A square ring of corridors, every side and every few metres like the next."""
    side, spacing, walls = rng.choice([12.0, 16.0, 24.0]), rng.choice([2.0, 3.0, 4.0]), []
    for margin, depth, sign in ((0.0, 0.8, 1), (2.0, 0.3, -1)):
        low, high = margin, side - margin
        corners = np.array([(low, low), (high, low), (high, high), (low, high)])[::sign]
        for k in range(4):
            walls += niched(corners[k], corners[(k + 1) % 4], spacing, depth)
    a, b = 1.0, float(side) - 1.0
    around = [(a, a), (b, a), (b, b), (a, b)]
    return walls, [(a + 1.0, a), *around[1:], *around, (a, a), (b, a), (b, 0.5 * b)]


def row_of_rooms(rng: np.random.Generator) -> Building:
    """Equal rooms along both sides of a corridor; some are visited, on the way there or back."""
    count, size, walls = int(rng.integers(4, 9)), float(rng.choice([3.0, 4.0, 5.0])), []
    length = count * size
    for y, out in ((0.0, -1.0), (2.0, 1.0)):
        for k in range(count):
            x, door = k * size, k * size + 0.5 * size
            walls += polyline([(x, y), (door - 0.5, y)], False) + polyline(
                [(door + 0.5, y), (x + size, y)], False
            )
            far = y + out * size
            walls += polyline([(x, y), (x, far), (x + size, far), (x + size, y)], False)
            walls += polyline([(x + 0.8, far - out), (x + 0.8, far)], False)
    walls += polyline([(0.0, 0.0), (0.0, 2.0)], False) + polyline([(length, 0.0), (length, 2.0)], False)
    drive = [(0.6, 1.0)]
    for order in (np.arange(count), np.arange(count)[::-1]):
        for k in order[rng.random(count) < 0.5].tolist():
            door, inside = (k + 0.5) * size, float(rng.choice([-0.5 * size, 2.0 + 0.5 * size]))
            drive += [(door, 1.0), (door, inside), (door, 1.0)]
        drive.append((length - 0.6 if order[0] == 0 else 0.6, 1.0))
    return walls, drive


def blocks(rng: np.random.Generator) -> Building:
    """Corridors around equal blocks: every crossing is like the others."""
    columns, rows = int(rng.integers(2, 4)), int(rng.integers(2, 4))
    size, wide = float(rng.choice([6.0, 8.0, 10.0])), 2.0
    pitch = size + wide
    walls = polyline(
        [
            (0, 0),
            (columns * pitch + wide, 0),
            (columns * pitch + wide, rows * pitch + wide),
            (0, rows * pitch + wide),
        ]
    )
    for c in range(columns):
        for r in range(rows):
            x, y = wide + c * pitch, wide + r * pitch
            corners = np.array([(x, y), (x, y + size), (x + size, y + size), (x + size, y)])
            for k in range(4):
                walls += niched(corners[k], corners[(k + 1) % 4], 3.0, 0.4)
    at = np.array([0, 0])
    drive, came = [at.copy()], np.array([0, 0])
    for _ in range(int(rng.integers(14, 22))):
        steps = [np.array(s) for s in ((1, 0), (-1, 0), (0, 1), (0, -1))]
        free = [
            s
            for s in steps
            if (at + s >= 0).all() and (at + s <= (columns, rows)).all() and not (s == -came).all()
        ]
        came = free[int(rng.integers(len(free)))]
        at = at + came
        drive.append(at.copy())
    return walls, [(1.0 + pitch * float(x), 1.0 + pitch * float(y)) for x, y in drive]


def hall(rng: np.random.Generator) -> Building:
    """A hall with pillars that is itself after half a turn, entered twice from either end."""
    length, width = float(rng.choice([12.0, 18.0])), float(rng.choice([8.0, 10.0]))
    walls = polyline([(0.0, 0.0), (length, 0.0), (length, width), (0.0, width)])
    for x in np.arange(3.0, length - 1.0, 3.0):
        for y in (0.3 * width, 0.7 * width):
            walls += polyline([(x, y), (x + 0.4, y), (x + 0.4, y + 0.4), (x, y + 0.4)])
    low, high = 0.15 * width, 0.85 * width
    drive = [(1.0, low), (length - 1.0, low), (length - 1.0, high), (1.0, high), (1.0, 0.5 * width)]
    return walls, [*drive, (length - 1.0, 0.5 * width), (length - 1.0, low), (1.0, low), (1.0, high)]


FAMILIES = (ring, row_of_rooms, blocks, hall)


def path_along(corners: list[tuple[float, float]]) -> FloatArray:
    """Poses (N, 3) from corner to corner, turning in place."""
    poses: list[tuple[float, float, float]] = []
    heading: float | None = None
    for (x0, y0), (x1, y1) in pairwise(corners):
        course = float(np.arctan2(y1 - y0, x1 - x0))
        if heading is not None:
            turn = (course - heading + np.pi) % (2.0 * np.pi) - np.pi
            count = int(abs(turn) / TURN_RAD)
            poses += [(x0, y0, heading + turn * k / (count + 1)) for k in range(1, count + 1)]
        count = max(1, int(np.hypot(x1 - x0, y1 - y0) / STEP_M))
        poses += [(x0 + (x1 - x0) * k / count, y0 + (y1 - y0) * k / count, course) for k in range(count)]
        heading = course
    return np.array(poses)


def scan(walls: FloatArray, pose: FloatArray, angles: FloatArray) -> FloatArray:
    """Distances (B,) to walls (W, 4), infinite where none is hit."""
    ux, uy = np.cos(pose[2] + angles)[:, None], np.sin(pose[2] + angles)[:, None]
    sx, sy = walls[:, 0] - pose[0], walls[:, 1] - pose[1]
    ex, ey = walls[:, 2] - walls[:, 0], walls[:, 3] - walls[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (sx * ey - sy * ex) / (ux * ey - uy * ex)
        along = (sx * uy - sy * ux) / (ux * ey - uy * ex)
    return np.asarray(np.where((t > 0.0) & (along >= 0.0) & (along <= 1.0), t, np.inf).min(axis=1))


def recording(walls: FloatArray, path: FloatArray, rng: np.random.Generator) -> LaserLog:
    """What a scanner and an odometry of drawn quality make of a drive."""
    angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, BEAMS)
    reach_m, std_m = float(rng.choice([8.0, 30.0, 80.0])), float(rng.choice([0.01, 0.02]))
    ranges = np.array([scan(walls, pose, angles) for pose in path])
    ranges = ranges + std_m * rng.standard_normal(ranges.shape)
    scale, bias = 1.0 + rng.uniform(-0.05, 0.05), rng.uniform(-0.02, 0.02)
    odometry = np.zeros_like(path)
    for k in range(1, len(path)):
        step = between(path[k - 1], path[k])
        moved = float(np.hypot(step[0], step[1]))
        noise = rng.standard_normal(3) * (0.05 * moved + 0.001, 0.02 * moved, 0.02 * abs(step[2]) + 0.002)
        step = np.array([scale * step[0], scale * step[1], step[2] * scale + bias * moved]) + noise
        odometry[k] = composed(odometry[k - 1], step)
    t_s = SCAN_S * np.arange(len(path), dtype=np.float64)
    count, beams = len(path), np.full(len(path), BEAMS, np.int64)
    limited = np.where(ranges > reach_m, np.inf, ranges)
    first, step_rad = np.full(count, angles[0]), np.full(count, angles[1] - angles[0])
    mount = Pose2(0.0, 0.0, 0.0)
    return LaserLog("alike", t_s, limited, beams, first, step_rad, 0.05, reach_m, mount, False, t_s, odometry)


def judged(result: SlamResult, path: FloatArray) -> tuple[int, int, int, int]:
    """Accepted closures, wrong ones, stretches that should be closed, and those that were missed."""
    at = path[result.keyframes[[extent.reference for extent in result.extents]]]
    accepted = [c for c in result.closures if c.verdict in COUNTING]
    wrong = 0
    for closure in accepted:
        c = closure.candidate
        off = closure.match.relative - between(at[c.earlier], at[c.later])
        # What a closure leaves open it does not claim.
        off[:2] -= closure.match.course * (closure.match.course @ off[:2])
        off[2] = (off[2] + np.pi) % (2.0 * np.pi) - np.pi
        wrong += bool(np.hypot(off[0], off[1]) > WRONG_M or abs(off[2]) > WRONG_RAD)
    closed = {closure.candidate.later for closure in accepted}
    due = missed = 0
    for later in range(LEAST_APART, len(at)):
        before = at[: later - LEAST_APART + 1]
        turn = np.abs((before[:, 2] - at[later, 2] + np.pi) % (2.0 * np.pi) - np.pi)
        if (np.hypot(*(before[:, :2] - at[later, :2]).T)[turn < AGAIN_RAD] < AGAIN_M).any():
            due += 1
            missed += not any(later + k in closed for k in range(-NEIGHBOURS, NEIGHBOURS + 1))
    return len(accepted), wrong, due, missed


def main() -> None:
    """Print a line a building, and the sums."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=20)
    asked = parser.parse_args()
    sums = np.zeros(4, np.int64)
    began = time.process_time()
    for seed in range(asked.first, asked.first + asked.count):
        rng = np.random.default_rng(seed)
        family = FAMILIES[seed % len(FAMILIES)]
        walls, drive = family(rng)
        path = path_along(drive)
        log = recording(np.array(walls), path, rng)
        result = map_log(log, SlamConfig())
        true = np.array([between(path[0], pose) for pose in path])
        most_m = float(np.hypot(*(result.poses - true)[:, :2].T).max())
        told = judged(result, path)
        sums += told
        print(
            f"{seed} {family.__name__}, {log.range_max_m:.0f} m: {len(log)} scans, {told[0]} closures, "
            f"{told[1]} wrong, {told[3]} of {told[2]} missed, at most {most_m:.2f} m off; "
            f"{'; '.join(result.warnings)}",
            flush=True,
        )
    took_s = time.process_time() - began
    print(
        f"seeds {asked.first} to {asked.first + asked.count - 1}: {sums[0]} closures, {sums[1]} wrong, "
        f"{sums[3]} of {sums[2]} missed, {took_s:.0f} s of processor time"
    )


if __name__ == "__main__":
    main()
