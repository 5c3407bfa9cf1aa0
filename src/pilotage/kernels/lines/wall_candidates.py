"""Which walls of the map a detected line may be: near enough, overlapping, and in sight."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.filters.wall_line import innovation_distance, wall_innovation
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.geometry.plane import point_segment_distance, segments_cross
from pilotage.kernels.jit import kernel

SIGHT_MARGIN_M = 0.1
"""A line of sight ends this far before the wall that it leads to."""
BESIDE_M = 0.3
"""A line that is no wall's is held against a belief only so near to one: whatever stands in a room lies in
front of one of its walls, and that a belief is off by more the whole scan shows."""


class SeenLines(NamedTuple):
    """The lines of a scan, in the scanner's frame.

    Attributes
    ----------
    mount
        (3,) pose of the scanner in the base frame.
    lines, covs, ends
        (L, 2) rho and alpha, (L, 2, 2) their covariances, (L, 4) x0, y0, x1, y1 of their extents.
    """

    mount: FloatArray
    lines: FloatArray
    covs: FloatArray
    ends: FloatArray


class Walls(NamedTuple):
    """The walls of the map.

    Attributes
    ----------
    normals, line_of, segments
        (W, 2) rho and alpha, (W,) the infinite line that a wall lies on, (W, 4) x0, y0, x1, y1.
    pieces, wall_of
        (P, 4) x0, y0, x1, y1 of what they are made of, without the gaps that one sees through, and (P,) the
        wall that each is a piece of.
    circles
        (C, 3) what hides them besides.
    """

    normals: FloatArray
    line_of: IntArray
    segments: FloatArray
    pieces: FloatArray
    wall_of: IntArray
    circles: FloatArray


class MatchRules(NamedTuple):
    """When a line may be a wall.

    Attributes
    ----------
    gate, joint_gates
        Greatest squared Mahalanobis distance of a line alone, and of k lines together, ``joint_gates[k]``.
    margin
        Another explanation no farther than this from the best one makes a line ambiguous.
    slack, sigmas
        By which a wall is lengthened, as of ``overlap_share``.
    least_overlap
        Share of a line that must lie beside its wall.
    options, nodes
        Walls considered for one line, and trial updates, at most.
    """

    gate: float
    joint_gates: FloatArray
    margin: float
    slack: float
    sigmas: float
    least_overlap: float
    options: int
    nodes: int


@kernel
def overlap_share(
    pose: FloatArray,
    cov: FloatArray,
    mount: FloatArray,
    end: FloatArray,
    alpha: float,
    segment: FloatArray,
    slack: float,
    sigmas: float,
) -> float:
    """Share of a detected line that lies beside a wall; ``end`` (4,) in the sensor's frame, ``segment`` (4,).

    The wall is lengthened at both ends by ``slack`` and by ``sigmas`` standard deviations of where the
    line's end would come to lie along it.
    """
    theta = pose[2] + mount[2]
    c, s = math.cos(theta), math.sin(theta)
    x = pose[0] + math.cos(pose[2]) * mount[0] - math.sin(pose[2]) * mount[1]
    y = pose[1] + math.sin(pose[2]) * mount[0] + math.cos(pose[2]) * mount[1]
    tx, ty = -math.sin(alpha), math.cos(alpha)
    w0 = segment[0] * tx + segment[1] * ty
    w1 = segment[2] * tx + segment[3] * ty
    if w0 > w1:
        w0, w1 = w1, w0
    a = x * tx + y * ty + (c * end[0] - s * end[1]) * tx + (s * end[0] + c * end[1]) * ty
    b = x * tx + y * ty + (c * end[2] - s * end[3]) * tx + (s * end[2] + c * end[3]) * ty
    if a > b:
        a, b = b, a
    reach2 = max(end[0] * end[0] + end[1] * end[1], end[2] * end[2] + end[3] * end[3])
    spread = math.sqrt(cov[0, 0] + cov[1, 1] + reach2 * cov[2, 2])
    tolerance = slack + sigmas * spread
    inside = min(b, w1 + tolerance) - max(a, w0 - tolerance)
    return float(max(inside, 0.0) / max(b - a, 1e-9))


@kernel
def in_sight(
    pose: FloatArray,
    mount: FloatArray,
    end: FloatArray,
    wall: int,
    known: Walls,
) -> bool:
    """Whether any of three points of a detected line could be seen with no other wall in the way."""
    theta = pose[2] + mount[2]
    c, s = math.cos(theta), math.sin(theta)
    x = pose[0] + math.cos(pose[2]) * mount[0] - math.sin(pose[2]) * mount[1]
    y = pose[1] + math.sin(pose[2]) * mount[0] + math.cos(pose[2]) * mount[1]
    pieces, circles = known.pieces, known.circles
    for k in range(3):
        share = 0.25 * (k + 1)
        px = (1.0 - share) * end[0] + share * end[2]
        py = (1.0 - share) * end[1] + share * end[3]
        keep = max(0.0, 1.0 - SIGHT_MARGIN_M / max(math.hypot(px, py), 1e-9))
        bx, by = x + keep * (c * px - s * py), y + keep * (s * px + c * py)
        free = True
        for i in range(pieces.shape[0]):
            if known.wall_of[i] != wall and segments_cross(
                x, y, bx, by, pieces[i, 0], pieces[i, 1], pieces[i, 2], pieces[i, 3]
            ):
                free = False
                break
        for i in range(circles.shape[0]):
            near = point_segment_distance(circles[i, 0], circles[i, 1], x, y, bx, by)
            free = free and near > circles[i, 2]
        if free:
            return True
    return False


@kernel
def candidates(
    pose: FloatArray,
    cov: FloatArray,
    seen: SeenLines,
    known: Walls,
    rules: MatchRules,
    out: IntArray,
    distance: FloatArray,
) -> IntArray:
    """Individually compatible walls of each line: fills out (L, C) and returns how many (L,).

    ``distance`` (L,) is filled with the least squared Mahalanobis distance to a wall that the line
    overlaps and may be, or has both ends beside (inf where there is none): ``BESIDE_M`` and as many standard
    deviations of the pose. Of walls on one infinite line, which a measurement cannot tell apart, the one with
    the greatest overlap stands for all.
    """
    mount, lines, covs, ends = seen.mount, seen.lines, seen.covs, seen.ends
    walls, line_of, segments = known.normals, known.line_of, known.segments
    gate, slack, sigmas = rules.gate, rules.slack, rules.sigmas
    count = np.zeros(lines.shape[0], dtype=np.int64)
    z, H, v = np.empty(2), np.empty((2, 3)), np.empty(2)
    c, s = math.cos(pose[2]), math.sin(pose[2])
    ox, oy = c * mount[0] - s * mount[1], s * mount[0] + c * mount[1]
    rhos, alphas, least = np.empty(walls.shape[0]), np.empty(walls.shape[0]), np.empty(walls.shape[0])
    for w in range(walls.shape[0]):
        nx, ny = math.cos(walls[w, 1]), math.sin(walls[w, 1])
        rhos[w] = walls[w, 0] - nx * (pose[0] + ox) - ny * (pose[1] + oy)
        alphas[w] = walls[w, 1] - pose[2] - mount[2]
    # The variance of a sum of three is no larger than three times the sum of theirs.
    place_var = 3.0 * (cov[0, 0] + cov[1, 1] + cov[2, 2] * (ox * ox + oy * oy))
    shares = np.empty(out.shape[1])
    for i in range(lines.shape[0]):
        distance[i] = math.inf
        # What the angle alone, or the range alone, is off by is no more than the distance of both: first
        # those that may pass the gate, then what is only to say how far the next wall is, once one is known.
        rho_var, angle_var = place_var + covs[i, 0, 0], cov[2, 2] + covs[i, 1, 1]
        x0, y0, x1, y1 = ends[i, 0], ends[i, 1], ends[i, 2], ends[i, 3]
        reach2 = max(x0 * x0 + y0 * y0, x1 * x1 + y1 * y1)
        beside = BESIDE_M + sigmas * math.sqrt(cov[0, 0] + cov[1, 1] + reach2 * cov[2, 2])
        for w in range(walls.shape[0]):
            off = abs(wrap(alphas[w] - lines[i, 1]))
            off = max(min(off, math.pi - off) - 1e-9, 0.0)
            # Seen from either side.
            aside = max(abs(abs(lines[i, 0]) - abs(rhos[w])) - 1e-9, 0.0)
            least[w] = max(off * off / angle_var, aside * aside / rho_var) * (1.0 - 1e-6)
        for within in (True, False):
            for w in range(walls.shape[0]):
                if (least[w] > gate) == within or least[w] > max(gate, distance[i]):
                    continue
                nx, ny = math.cos(alphas[w]), math.sin(alphas[w])
                away = max(abs(nx * x0 + ny * y0 - rhos[w]), abs(nx * x1 + ny * y1 - rhos[w]))
                if least[w] > gate and away > beside:
                    continue
                wall_innovation(pose, mount, walls[w], lines[i], z, H, v)
                nis = innovation_distance(cov, H, v, covs[i])
                if not nis <= max(gate, distance[i]):
                    continue
                if nis > gate and away > beside:
                    continue
                share = overlap_share(pose, cov, mount, ends[i], walls[w, 1], segments[w], slack, sigmas)
                if share < rules.least_overlap:
                    continue
                distance[i] = min(distance[i], nis)
                if nis > gate:
                    continue
                place = count[i]
                for k in range(count[i]):
                    if line_of[out[i, k]] == line_of[w]:
                        place = k
                if place == count[i]:
                    if count[i] == out.shape[1]:
                        continue
                    count[i] += 1
                elif share <= shares[place]:
                    continue
                out[i, place] = w
                shares[place] = share
    return count
