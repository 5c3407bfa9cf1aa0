"""Find the sheet in a film: the largest even quadrilateral, its sides fitted to the edges in the picture.

Several frames are searched on their own and have to agree, so that a foot over a corner or a hand in the
picture spoils some of them and not the answer.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pilotage.tracking.channels import greatest_channel, least_channel
from pilotage.tracking.film import Image
from pilotage.tracking.opencv import opencv
from pilotage.tracking.sheet import in_map_order, turning

Floats = NDArray[np.float64]

_THRESHOLDS = 9
_LEAST_AREA = 0.05
"""Of the picture; less is no map that a robot could be measured on."""
_LEAST_FIT = 0.85
"""Overlap of region and quadrilateral over their union."""
_LEAST_PAPER = 0.5
"""Share of the quadrilateral that has to be of one colour."""
_PAPER_REACH = 40.0
_LEAST_SUPPORT = 0.35
"""Share of each side that has to show an edge on one straight line."""
_FRAMES = 9
_PLACES = 80
"""Places along a side where its edge is sought."""
_SYSTEMATIC_PX = 0.3
"""Lenses bend lines and paper curls: averaging over an edge does not help against that."""
_AGREE = 0.02
"""Of the picture's longer side: corners within this are the same sheet."""


def find_corners(samples: Sequence[Image]) -> tuple[Floats, float] | None:
    """Find the corners of the sheet.

    Parameters
    ----------
    samples
        Frames spread over the film.

    Returns
    -------
    tuple[Floats, float] | None
        Corners in pixels of the samples (lower left, lower right, upper right, upper left), shape (4, 2),
        and their standard deviation in pixels; None where no sheet is seen.
    """
    chosen = [samples[i] for i in np.unique(np.linspace(0, len(samples) - 1, _FRAMES).astype(int))]
    refined = [found for found in map(_best_quadrilateral, chosen) if found is not None]
    if not refined:
        return None
    side = max(chosen[0].shape[:2])
    corners = np.array([quad for quad, _ in refined])
    # The frame that most others agree with, and the median of those.
    apart = np.abs(corners[:, None] - corners[None]).max(axis=(2, 3))
    agreeing = corners[apart[np.argmin(np.median(apart, axis=1))] < _AGREE * side]
    if len(agreeing) < max(1, len(chosen) // 3):
        return None
    middle = np.median(agreeing, axis=0)
    spread = float(np.median(np.abs(agreeing - middle))) * 1.4826
    fitted_std = float(np.median([deviation for _, deviation in refined]))
    return middle, float(np.linalg.norm([spread, fitted_std, _SYSTEMATIC_PX]))


def refine_corners(image: Image, corners: Floats) -> tuple[Floats, float, float]:
    """Fit the four sides to the edges in the picture and intersect them.

    Returns
    -------
    tuple[Floats, float, float]
        Corners, shape (4, 2); the standard deviation of a corner in pixels, by the scatter of the edges and
        by how much they are bent; and the share of the worst side that shows an edge where the line was
        laid, beyond what would by chance. Corners that would move further than the searched band stay where
        they were.
    """
    grey = opencv().GaussianBlur(least_channel(image), (0, 0), 1.0).astype(np.float32)
    centre = corners.mean(axis=0)
    current, deviation, support = corners, 1.0, 0.0
    for band in (0.03, 0.012):
        lines, deviations, supports = [], [], []
        for start, end in zip(current, np.roll(current, -1, axis=0), strict=True):
            length = float(np.hypot(*(end - start)))
            reach, near = max(4.0, band * length), max(1.5, 0.004 * length)
            points = _edge_points(grey, start, end, centre, reach)
            line, spread = _robust_line(points)
            lines.append(line)
            off = points @ line[:2] - line[2]
            on_line = np.abs(off) < near
            by_chance = near / reach
            share = np.count_nonzero(on_line) / _PLACES
            supports.append(max(0.0, (share - by_chance) / (1.0 - by_chance)))
            seen = np.abs(off) < max(near, 3.0 * spread)
            scatter = spread / np.sqrt(max(len(points) / 4.0, 1.0))
            deviations.append(float(np.hypot(scatter, _bend(points[seen], off[seen], line))))
        moved = np.array([_meet(lines[i - 1], lines[i]) for i in range(4)])
        furthest = 2.0 * band * float(np.max(np.hypot(*(current - np.roll(current, 1, axis=0)).T)))
        if not np.all(np.isfinite(moved)) or np.hypot(*(moved - current).T).max() > furthest:
            break
        current, deviation, support = moved, float(np.mean(deviations)), min(supports)
    return current, deviation, support


def _best_quadrilateral(image: Image) -> tuple[Floats, float] | None:
    """Return the corners of the most sheet-like quadrilateral of one frame, and their standard deviation.

    A rough floor may look like a sheet of its own, and a hand on a corner like paper: what counts besides
    size and shape is how much of each side shows an edge where it should be.
    """
    best, best_score = None, 0.0
    for quad, score in sorted(_quadrilaterals(image), key=lambda pair: -pair[1]):
        if score <= best_score:
            break
        corners, deviation, support = refine_corners(image, in_map_order(quad))
        if support >= _LEAST_SUPPORT and score * support > best_score:
            best, best_score = (corners, deviation), score * support
    return best


def _quadrilaterals(image: Image) -> list[tuple[Floats, float]]:
    """Even quadrilaterals of one frame with a score of size and shape; those that are alike only once."""
    cv2 = opencv()
    found: list[tuple[Floats, float]] = []
    light = cv2.GaussianBlur(least_channel(image), (5, 5), 0)
    dark = cv2.GaussianBlur(255 - greatest_channel(image), (5, 5), 0)
    for channel in (light, dark):
        low, high = np.percentile(channel[::4, ::4], [10.0, 99.0])
        for threshold in np.linspace(low, high, _THRESHOLDS + 2)[1:-1]:
            mask = cv2.morphologyEx(
                (channel > threshold).astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)
            )
            outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
            for outline in outlines:
                quad, score = _as_quadrilateral(outline, image.shape[:2])
                if quad is None or any(score <= other and _alike(quad, one) for one, other in found):
                    continue
                if _even(image, quad):
                    found.append((quad, score))
    return found


def _alike(first: Floats, second: Floats) -> bool:
    """Whether two quadrilaterals have each corner within what the fit of the sides makes good."""
    near = 0.005 * float(np.ptp(first, axis=0).max())
    return bool(np.abs(first[:, None] - second[None]).max(axis=2).min(axis=1).max() < near)


def _as_quadrilateral(outline: NDArray[np.int32], shape: tuple[int, int]) -> tuple[Floats | None, float]:
    cv2 = opencv()
    height, width = shape
    if cv2.contourArea(outline) < _LEAST_AREA * height * width:
        return None, 0.0
    hull = cv2.convexHull(outline)
    length = cv2.arcLength(hull, True)
    quad = None
    for share in np.linspace(0.01, 0.12, 23):
        corners = cv2.approxPolyDP(hull, share * length, True).reshape(-1, 2)
        if len(corners) <= 4:
            quad = corners.astype(np.float64) if len(corners) == 4 else None
            break
    if quad is None or not np.all(turning(quad) * turning(quad)[0] > 0.0):
        return None, 0.0
    fit = _overlap_over_union(outline, quad, shape)
    if fit < _LEAST_FIT:
        return None, 0.0
    # A sheet with a corner on the border of the picture goes on beyond it: more likely a table or a wall.
    margin = 2.0
    inside = (quad > margin).all() and (quad < np.array([width, height]) - 1 - margin).all()
    area_share = cv2.contourArea(quad.astype(np.float32)) / (height * width)
    return quad, float(fit**2 * np.sqrt(area_share) * (1.0 if inside else 0.4))


def _even(image: Image, quad: Floats) -> bool:
    """Whether most of a quadrilateral is of one colour, as a sheet is and a textured floor is not."""
    cv2 = opencv()
    inside = cv2.fillConvexPoly(np.zeros(image.shape[:2], np.uint8), np.rint(quad).astype(np.int32), 1)
    pixels = image[::4, ::4][inside[::4, ::4] > 0].astype(np.float32)
    if len(pixels) < 50:
        return False
    away = np.abs(pixels - np.median(pixels, axis=0)).max(axis=1)
    return bool(np.mean(away < _PAPER_REACH) > _LEAST_PAPER)


def _overlap_over_union(outline: NDArray[np.int32], quad: Floats, shape: tuple[int, int]) -> float:
    cv2 = opencv()
    region = cv2.drawContours(np.zeros(shape, np.uint8), [outline], -1, 1, -1)
    ideal = cv2.fillConvexPoly(np.zeros(shape, np.uint8), np.rint(quad).astype(np.int32), 1)
    both, either = int(np.count_nonzero(region & ideal)), int(np.count_nonzero(region | ideal))
    return both / max(either, 1)


def _edge_points(
    grey: NDArray[np.float32], start: Floats, end: Floats, centre: Floats, reach: float
) -> Floats:
    """Strongest edge across a side at many places along it, shape (N, 2)."""
    cv2 = opencv()
    along = (end - start) / max(float(np.hypot(*(end - start))), 1e-9)
    inward = np.array([-along[1], along[0]])
    inward = inward if inward @ (centre - 0.5 * (start + end)) > 0.0 else -inward
    share = np.linspace(0.04, 0.96, _PLACES)[:, None]
    offsets = np.arange(-reach, reach + 0.25, 0.5)
    base = start + share * (end - start)
    x = (base[:, :1] + offsets * inward[0]).astype(np.float32)
    y = (base[:, 1:] + offsets * inward[1]).astype(np.float32)
    profile = cv2.remap(grey, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    # Half a pixel a step: the difference over four steps is the slope over two pixels.
    slope = profile[:, 4:] - profile[:, :-4]
    rising = slope if np.median(slope.sum(axis=1)) >= 0.0 else -slope
    strongest = rising.argmax(axis=1)
    strength = rising[np.arange(len(rising)), strongest]
    clear = strength > max(0.4 * float(np.median(strength)), 3.0)
    offset = offsets[2:-2][strongest]
    return np.asarray((base + offset[:, None] * inward)[clear])


def _robust_line(points: Floats) -> tuple[Floats, float]:
    """Fit ``n . p = d`` by least squares, outliers weighed down; returns (nx, ny, d) and the spread."""
    if len(points) < 10:
        return np.full(3, np.nan), float("nan")
    weight = np.ones(len(points))
    line, spread = np.zeros(3), 1.0
    low, high = (len(points) - 1) // 2, len(points) // 2
    for _ in range(12):
        # As np.average and np.median have it, without their questions to such arrays.
        middle = (points * weight[:, None]).sum(axis=0) / weight.sum()
        away = points - middle
        _, vectors = np.linalg.eigh((away * weight[:, None]).T @ away)
        normal = vectors[:, 0]
        residual = away @ normal
        size = np.partition(np.abs(residual), (low, high))
        spread = max(1.4826 * float(0.5 * (size[low] + size[high])), 0.1)
        weight = 1.0 / (1.0 + (residual / (2.0 * spread)) ** 2) ** 2
        line = np.array([normal[0], normal[1], normal @ middle])
    return line, spread


def _bend(points: Floats, off: Floats, line: Floats) -> float:
    """How far the ends of a bent edge are from the straight line that was fitted to it.

    A parabola of sagitta s is 2/3 s beyond its best line at the ends, where the corners are.
    """
    if len(points) < 20:
        return 0.0
    along = points @ np.array([-line[1], line[0]])
    share = 2.0 * (along - along.min()) / max(float(np.ptp(along)), 1e-9) - 1.0
    return 2.0 / 3.0 * abs(float(np.polyfit(share, off, 2)[0]))


def _meet(first: Floats, second: Floats) -> Floats:
    matrix = np.array([first[:2], second[:2]])
    if not np.all(np.isfinite(matrix)) or abs(np.linalg.det(matrix)) < 1e-6:
        return np.full(2, np.nan)
    return np.linalg.solve(matrix, np.array([first[2], second[2]]))
