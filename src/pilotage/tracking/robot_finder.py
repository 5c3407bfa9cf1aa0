"""Find the robot's disc in each frame.

Colour alone sits off the disc's centre: boards and wheels cover part of it, unevenly. What is left of the
rim still fixes the disc. First the coloured pixels are sent to the floor, where the disc is round, and their
smallest enclosing circle is taken; then a disc of the learned radius is laid so that it holds the colour and
no paper.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pilotage.core.errors import InputError
from pilotage.tracking.background import Background
from pilotage.tracking.film import Image
from pilotage.tracking.opencv import opencv
from pilotage.tracking.robot_colour import HsvRange
from pilotage.tracking.sheet import Sheet, project

Floats = NDArray[np.float64]

_JOIN = 0.02
"""Of the sheet's side: parts closer than this belong to one body."""
_LEAST_PART = 0.05
"""Of the coloured pixels: smaller parts are specks."""
_TOLERANCE = 1.06
"""A circle may be larger than the learned one by this before pixels are dropped."""
_JUMP = 1.5
"""In radii: how far the robot may be from where it was, for each frame since."""
_MOST_JUMP = 8.0
_ALIKE = 0.4
"""Areas whose logarithms differ by less are alike."""
_PATCH_RADIUS = 18
"""Pixels of the disc's radius on the patch of floor where it is fitted."""
_LEAST_SHARE = 0.2
"""Of the learned area; less is not the robot."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """The robot in one frame.

    Attributes
    ----------
    centre_m
        Centre of the disc, sent to the floor, shape (2,).
    radius_m
        Radius of the circle around the coloured pixels.
    spread_m
        Standard deviation of the places that would fit about as well.
    area_m2
        What the coloured pixels take on the floor: near and far the same.
    bare
        Share of the disc, as it was laid, that shows no body. Much of it: the body is no disc.
    """

    centre_m: Floats
    radius_m: float
    spread_m: float
    area_m2: float
    bare: float = 0.0


@dataclass(frozen=True, slots=True)
class RobotLook:
    """What is known of the robot: its colour (None: told by difference alone), radius, coloured area."""

    colour: HsvRange | None
    radius_m: float
    area_m2: float


class RobotFinder:
    """Finds the robot in one frame after the other.

    Parameters
    ----------
    background
        The sheet without the robot.
    sheet
        Geometry of the sheet in full-size pixels.
    reduction
        How much smaller the frames are than the film.
    look
        What the robot looks like.
    """

    def __init__(self, background: Background, sheet: Sheet, reduction: int, look: RobotLook) -> None:
        self._view = _View(background, sheet, reduction)
        self._look = look
        self._last: Sighting | None = None
        self._missed = 0

    def find(self, reduced_frame: Image) -> Sighting | None:
        """Return the robot in this frame, or None."""
        candidates = self._view.candidates(reduced_frame, self._look.colour, self._look.radius_m)
        large = [one for one in candidates if one[0].area_m2 >= _LEAST_SHARE * self._look.area_m2]
        best = self._choose(large)
        if best is None:
            self._missed += 1
            return None
        self._last, self._missed = best, 0
        return best

    def _choose(self, candidates: list[tuple[Sighting, bool]]) -> Sighting | None:
        """Near where it was, else anywhere, things that reach in over the edge last; the likest in size."""
        if self._last is not None:
            reach = min(_JUMP * (1 + self._missed), _MOST_JUMP) * self._look.radius_m
            last = self._last.centre_m
            near = [one for one, _ in candidates if float(np.hypot(*(one.centre_m - last))) < reach]
            if near:
                return max(near, key=self._likeness)
            # In a film of few frames a second it may have jumped: then it looks in every way as learned.
            candidates = [
                (one, inside)
                for one, inside in candidates
                if inside and (self._likeness(one) > -_ALIKE or self._missed >= _MOST_JUMP)
            ]
        ranked = sorted(candidates, key=lambda pair: (pair[1], self._likeness(pair[0])))
        return ranked[-1][0] if ranked else None

    def _likeness(self, one: Sighting) -> float:
        """The area is as learned: 0; twice or half as large: the same amount below."""
        return -abs(math.log(one.area_m2 / self._look.area_m2))


def learn_look(
    samples: Sequence[Image],
    background: Background,
    sheet: Sheet,
    reduction: int,
    colour: HsvRange | None,
    radius_m: float | None = None,
) -> RobotLook:
    """Learn the robot's radius (unless given) and its coloured area from the samples.

    Raises
    ------
    InputError
        If no sample shows the robot.
    """
    view = _View(background, sheet, reduction)
    seen = []
    for sample in samples:
        candidates = [one for one, inside in view.candidates(sample, colour, radius_m) if inside]
        if candidates:
            seen.append(max(candidates, key=lambda one: one.area_m2))
    if not seen:
        raise InputError("no robot of this colour is on the map in this video; give its colour by --hsv")
    # Half covered discs look smaller, reflections larger: a quantile above the median is the disc.
    radius = radius_m if radius_m is not None else float(np.quantile([one.radius_m for one in seen], 0.7))
    return RobotLook(colour, radius, float(np.median([one.area_m2 for one in seen])))


class _View:
    """Frames in, coloured things on the floor out."""

    def __init__(self, background: Background, sheet: Sheet, reduction: int) -> None:
        self._background = background
        self._reduction = reduction
        self._sheet = sheet
        self._to_floor = sheet.to_floor
        self._to_image = sheet.to_image
        x, y = background.region.offset
        middle = 0.5 * (reduction - 1) / reduction
        self._from_full = np.array(
            [[1.0 / reduction, 0.0, -middle - x], [0.0, 1.0 / reduction, -middle - y], [0.0, 0.0, 1.0]]
        )
        away = np.arange(-_PATCH_RADIUS, _PATCH_RADIUS + 1)
        self._disc = (away[:, None] ** 2 + away**2 <= _PATCH_RADIUS**2).astype(np.float32)
        rows, columns = background.image.shape[:2]
        cv2 = opencv()
        joined_px = max(3, round(_JOIN * float(np.sqrt(np.count_nonzero(background.region.mask)))) | 1)
        self._joiner = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (joined_px, joined_px))
        mask = background.region.mask.astype(np.uint8)
        self._rim = cv2.morphologyEx(mask, cv2.MORPH_GRADIENT, np.ones((5, 5), np.uint8)) > 0
        self._least_pixels = max(12.0, 1e-4 * rows * columns)

    def candidates(
        self, reduced_frame: Image, colour: HsvRange | None, radius_m: float | None
    ) -> list[tuple[Sighting, bool]]:
        """Coloured things in a frame, and whether each lies wholly on the sheet."""
        cv2 = opencv()
        cut = self._background.in_this_light(reduced_frame)
        foreground = self._background.foreground(cut)
        thick = cv2.morphologyEx(foreground, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        mask = thick if colour is None else cv2.bitwise_and(foreground, colour.within(cut))
        # A board may part the disc's colour in two: what belongs together is told by the whole body.
        joined = cv2.morphologyEx(cv2.bitwise_or(thick, mask), cv2.MORPH_CLOSE, self._joiner)
        count, labels, stats, _ = cv2.connectedComponentsWithStats(joined)
        found = []
        for label in range(1, count):
            left, top, width, height, area = (int(value) for value in stats[label])
            if area < self._least_pixels:
                continue
            box = (slice(top, top + height), slice(left, left + width))
            own = labels[box] == label
            inside = not bool(np.any(own & self._rim[box]))
            coloured = np.where(own, mask[box], 0).astype(np.uint8)
            sighting = self._circle(coloured, (left, top), radius_m)
            if sighting is not None and radius_m is not None:
                sighting = self._fitted(sighting, coloured, (left, top), foreground, radius_m)
            if sighting is not None:
                found.append((sighting, inside))
        return found

    def _fitted(
        self, first: Sighting, coloured: Image, corner: tuple[int, int], foreground: Image, radius_m: float
    ) -> Sighting:
        """Lay the disc so that it holds the colour and no paper, on a patch of the floor seen from above."""
        cv2 = opencv()
        step_m = radius_m / _PATCH_RADIUS
        half = round(2.2 * _PATCH_RADIUS)
        origin_m = first.centre_m - half * step_m
        to_metres = np.array([[step_m, 0.0, origin_m[0]], [0.0, step_m, origin_m[1]], [0.0, 0.0, 1.0]])
        to_cut = self._from_full @ self._to_image @ to_metres
        size = (2 * half + 1, 2 * half + 1)
        shift = np.array([[1.0, 0.0, -corner[0]], [0.0, 1.0, -corner[1]], [0.0, 0.0, 1.0]])
        how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        colour = cv2.warpPerspective(coloured, shift @ to_cut, size, flags=how).astype(np.float32)
        body = cv2.warpPerspective(foreground, to_cut, size, flags=how).astype(np.float32)
        gain = (colour - (255.0 - body)) / 255.0
        score = cv2.filter2D(gain, cv2.CV_32F, self._disc, borderType=cv2.BORDER_CONSTANT)
        # All places within a few pixels' worth of the best: their middle is steadier than the best one.
        worth = np.clip(score - (score.max() - 0.02 * float(self._disc.sum())), 0.0, None)
        rows, columns = np.nonzero(worth)
        weights = worth[rows, columns]
        places = np.column_stack([columns, rows]).astype(np.float64)
        middle = np.average(places, axis=0, weights=weights)
        variance = np.average(((places - middle) ** 2).mean(axis=1), weights=weights)
        spread_m = float(np.sqrt(variance)) * step_m
        row, column = np.clip(
            np.rint(middle[::-1]).astype(int) - _PATCH_RADIUS, 0, 2 * (half - _PATCH_RADIUS)
        )
        under = body[row : row + len(self._disc), column : column + len(self._disc)]
        bare = 1.0 - float(np.average(under, weights=self._disc)) / 255.0
        return Sighting(origin_m + middle * step_m, first.radius_m, spread_m, first.area_m2, bare)

    def _circle(self, mask: Image, corner: tuple[int, int], radius_m: float | None) -> Sighting | None:
        cv2 = opencv()
        count, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
        areas = stats[:, cv2.CC_STAT_AREA].astype(np.float64)
        areas[0] = 0.0
        total = areas.sum()
        if count < 2 or total < self._least_pixels:
            return None
        kept = areas >= _LEAST_PART * total
        rows, columns = np.nonzero(kept[labels])
        points = np.column_stack([columns, rows]) + self._background.region.offset + corner
        # The middle of a reduced pixel in pixels of the film.
        full = points * self._reduction + 0.5 * (self._reduction - 1)
        centre, radius = enclosing_circle(project(self._to_floor, full), radius_m)
        at_px = project(self._to_image, centre[None])[0]
        pixel_m2 = abs(float(np.linalg.det(self._sheet.metres_per_px(at_px)))) * self._reduction**2
        return Sighting(centre, radius, 0.0, float(areas[kept].sum()) * pixel_m2)


def enclosing_circle(points: Floats, most_radius: float | None = None) -> tuple[Floats, float]:
    """Return the smallest circle around points, shape (N, 2), the furthest ones dropped if it is too large.

    Parameters
    ----------
    points
        Points in metres.
    most_radius
        Points are dropped, at most a quarter of them, until the circle is no larger than this.

    Returns
    -------
    tuple[Floats, float]
        Centre, shape (2,), and radius.
    """
    cv2 = opencv()
    # OpenCV's tolerance is absolute and meant for pixels: work in thousandths.
    rest = (points * 1000.0).astype(np.float32)
    (x, y), radius = cv2.minEnclosingCircle(cv2.convexHull(rest))
    least = 0.75 * len(points)
    while most_radius is not None and radius > _TOLERANCE * 1000.0 * most_radius and len(rest) > least:
        away = np.hypot(*(rest - np.median(rest, axis=0)).T)
        rest = rest[away <= np.quantile(away, 0.985)]
        (x, y), radius = cv2.minEnclosingCircle(cv2.convexHull(rest))
    return np.array([x, y]) / 1000.0, float(radius) / 1000.0
