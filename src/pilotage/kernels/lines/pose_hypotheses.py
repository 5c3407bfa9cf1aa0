"""Poses that a scan allows without any prior: two lines that cross fix a pose once each is a wall."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.geometry.plane import distance_to_nearest
from pilotage.kernels.jit import kernel
from pilotage.kernels.lines.wall_candidates import overlap_share
from pilotage.kernels.scans.rays import fan_ranges

EXPLAINED, OPEN, CONTRADICTED = range(3)
SCATTERED = 0.9
"""The extent of a line whose ends lie askew to it by up to 25 degrees, over the distance between them."""


class Expected(NamedTuple):
    """What a map makes one expect of a scanner, and how far a reading may be from that (m).

    ``first`` is the angle of its first beam, ``step`` that between two. ``eyes`` (V, 2) are the places of
    scanners whose scans are joined to it, x along the first beam.
    """

    first: float
    step: float
    max_range: float
    near: float
    beyond: float
    eyes: FloatArray
    segments: FloatArray
    circles: FloatArray


@kernel
def pair_poses(
    lines: FloatArray,
    ends: FloatArray,
    walls: FloatArray,
    segments: FloatArray,
    circles: FloatArray,
    bounds: FloatArray,
    angle_tolerance: float,
    slack: float,
    least_overlap: float,
    least_clearance: float,
    out: FloatArray,
) -> int:
    """Fill ``out`` (H, 3) with sensor poses from which two lines (2, 2) may be two of the walls.

    Each line may be each wall from either side; the angle between the lines must be that between the
    walls. The heading then follows from the normals, the position from the two distances. Kept are poses
    inside ``bounds`` that leave room for the body and where both lines overlap their walls. Returns how many,
    at most H.
    """
    count = 0
    pose, nothing = np.empty(3), np.zeros(3)
    certain = np.zeros((3, 3))
    between = wrap(lines[1, 1] - lines[0, 1])
    firsts = _long_enough(segments, ends[0], slack, least_overlap)
    seconds = _long_enough(segments, ends[1], slack, least_overlap)
    angles = np.empty(2 * seconds.shape[0])
    for b in range(angles.shape[0]):
        angles[b] = wrap(walls[seconds[b // 2], 1] + (b % 2) * math.pi)
    by_angle = np.argsort(angles)
    angles = angles[by_angle]
    for a in range(2 * firsts.shape[0]):
        first, flip_a = firsts[a // 2], a % 2
        angle_a = walls[first, 1] + flip_a * math.pi
        rho_a = walls[first, 0] * (1.0 - 2.0 * flip_a)
        # In a building of thousands of walls few are at the right angle.
        for b in _about(angles, by_angle, wrap(angle_a + between), angle_tolerance + 1e-9):
            second, flip_b = seconds[b // 2], b % 2
            angle_b = walls[second, 1] + flip_b * math.pi
            error = wrap(angle_b - angle_a - between)
            if abs(error) > angle_tolerance:
                continue
            rho_b = walls[second, 0] * (1.0 - 2.0 * flip_b)
            ax, ay = math.cos(angle_a), math.sin(angle_a)
            bx, by = math.cos(angle_b), math.sin(angle_b)
            determinant = ax * by - ay * bx
            if abs(determinant) < 1e-6:
                continue
            u, v = rho_a - lines[0, 0], rho_b - lines[1, 0]
            pose[0] = (u * by - v * ay) / determinant
            pose[1] = (v * ax - u * bx) / determinant
            pose[2] = wrap(angle_a - lines[0, 1] + 0.5 * error)
            if not (bounds[0] <= pose[0] <= bounds[2] and bounds[1] <= pose[1] <= bounds[3]):
                continue
            if (
                overlap_share(pose, certain, nothing, ends[0], walls[first, 1], segments[first], slack, 0.0)
                < least_overlap
            ):
                continue
            if (
                overlap_share(pose, certain, nothing, ends[1], walls[second, 1], segments[second], slack, 0.0)
                < least_overlap
            ):
                continue
            if distance_to_nearest(pose[0], pose[1], segments, circles) < least_clearance:
                continue
            if count == out.shape[0]:
                return count
            out[count] = pose
            count += 1
    return count


@kernel
def _about(angles: FloatArray, places: IntArray, angle: float, tolerance: float) -> IntArray:
    """Which of ``places``, in their own order, have an angle about the one asked for; ``angles`` rise."""
    ends = np.zeros((3, 2), np.int64)
    for k in range(3):
        around = angle + 2.0 * math.pi * (k - 1)
        ends[k, 0] = np.searchsorted(angles, around - tolerance)
        ends[k, 1] = np.searchsorted(angles, around + tolerance)
    found = np.empty((ends[:, 1] - ends[:, 0]).sum(), np.int64)
    count = 0
    for k in range(3):
        for place in places[ends[k, 0] : ends[k, 1]]:
            found[count] = place
            count += 1
    return np.sort(found)


@kernel
def _long_enough(segments: FloatArray, end: FloatArray, slack: float, least_overlap: float) -> IntArray:
    """Walls that a line of that extent can overlap by so much of it; a little less where its ends scatter.

    An outline of cells has tens of thousands of walls that are shorter than any line.
    """
    least = SCATTERED * least_overlap * math.hypot(end[2] - end[0], end[3] - end[1]) - 2.0 * slack
    found = np.empty(segments.shape[0], np.int64)
    count = 0
    for k in range(segments.shape[0]):
        if math.hypot(segments[k, 2] - segments[k, 0], segments[k, 3] - segments[k, 1]) >= least:
            found[count] = k
            count += 1
    return found[:count]


@kernel
def scan_fit(
    expected: Expected, x: float, y: float, heading: float, ranges: FloatArray, stride: int, extra: float
) -> tuple[float, float]:
    """Shares of every ``stride``-th beam that the map explains, and that it contradicts, from a pose.

    ``heading`` is the first beam's; ``extra`` widens both tolerances. Explained: within ``near`` of the map's
    range. Contradicted: longer than the map's by more than ``beyond``, through what the map says is a wall; a
    shorter one may be something unexpected. Beams of which nothing is known, NaN, do not count; a scan of
    none but these is explained. Of a scan that several scanners took a beam ends where one of them saw
    something, which a wall between may hide from the pose itself: what one of them can have seen is not
    contradicted.
    """
    beams = (ranges.shape[0] + stride - 1) // stride
    step, most = expected.step * stride, expected.max_range
    near, beyond = expected.near + extra, expected.beyond + extra
    met = fan_ranges(x, y, heading, step, beams, most, expected.segments, expected.circles)
    explained = contradicted = known = 0
    for k in range(beams):
        if math.isnan(ranges[k * stride]):
            continue
        known += 1
        measured = min(ranges[k * stride], most)
        if abs(measured - met[k]) <= near:
            explained += 1
        elif measured > met[k] + beyond:
            angle = heading + k * expected.step * stride
            seen = _seen_from(expected, x, y, heading, angle, measured, near, beyond)
            explained += int(seen == EXPLAINED)
            contradicted += int(seen == CONTRADICTED)
    if known == 0:
        return 1.0, 0.0
    return explained / known, contradicted / known


@kernel
def _seen_from(
    expected: Expected,
    x: float,
    y: float,
    heading: float,
    angle: float,
    measured: float,
    near: float,
    beyond: float,
) -> int:
    """What the end of a beam is to the scanner among the eyes to which it fits the map best."""
    best = CONTRADICTED
    eyes = expected.eyes
    c, s = math.cos(heading), math.sin(heading)
    for i in range(eyes.shape[0]):
        ex, ey = x + c * eyes[i, 0] - s * eyes[i, 1], y + s * eyes[i, 0] + c * eyes[i, 1]
        dx, dy = x + measured * math.cos(angle) - ex, y + measured * math.sin(angle) - ey
        away = math.hypot(dx, dy)
        most = away + near + beyond
        met = fan_ranges(ex, ey, math.atan2(dy, dx), 1.0, 1, most, expected.segments, expected.circles)[0]
        if abs(away - met) <= near or (measured >= expected.max_range and met > away):
            return EXPLAINED
        if away <= met + beyond:
            best = OPEN
    return best


@kernel
def fitting_poses(
    expected: Expected,
    poses: FloatArray,
    ranges: FloatArray,
    stride: int,
    extra: float,
    least_explained: float,
    most_contradicted: float,
) -> FloatArray:
    """Indices and explained shares (K, 2) of the sensor poses (H, 3) that fit the scan, best first."""
    kept = np.empty((poses.shape[0], 2))
    count = 0
    for h in range(poses.shape[0]):
        x, y, heading = poses[h, 0], poses[h, 1], poses[h, 2] + expected.first
        explained, contradicted = scan_fit(expected, x, y, heading, ranges, stride, extra)
        if explained >= least_explained and contradicted <= most_contradicted:
            kept[count, 0] = h
            kept[count, 1] = explained
            count += 1
    return kept[:count][np.argsort(-kept[:count, 1], kind="mergesort")]
