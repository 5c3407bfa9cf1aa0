"""What is learned of a film before the robot is followed: sheet, background, robot, marks on the floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pilotage.core.errors import InputError
from pilotage.tracking.background import Background, learn_background
from pilotage.tracking.film import Advance, FilmSummary, Image, survey
from pilotage.tracking.floor_marks import FloorMarks, find_marks
from pilotage.tracking.light import Region
from pilotage.tracking.opencv import opencv
from pilotage.tracking.robot_colour import HsvRange, learn_colour
from pilotage.tracking.robot_finder import RobotLook, learn_look
from pilotage.tracking.sheet import Sheet
from pilotage.tracking.sheet_finder import find_corners

Floats = NDArray[np.float64]

_GIVEN_CORNER_STD_PX = 1.0
"""A corner that a person points at is good to about a pixel."""
_TOP_VIEW_PX = 900
SMALLEST_M, LARGEST_M = 1e-3, 1e6
"""Sides of maps."""


@dataclass(frozen=True, slots=True)
class TrackOptions:
    """What the user may tell of the film.

    Attributes
    ----------
    corners_px
        Corners of the sheet (lower left, lower right, upper right, upper left), or None: found.
    colour
        The robot's colour, or None: learned from what moves.
    grid
        Cells along a side.
    size_m
        Side of the sheet.
    radius_m
        Radius of the robot's coloured disc, or None: learned.
    height_m
        Height of that disc over the floor.
    """

    corners_px: Floats | None = None
    colour: HsvRange | None = None
    grid: int = 25
    size_m: float = 1.8
    radius_m: float | None = None
    height_m: float = 0.0

    def __post_init__(self) -> None:
        if not 1 <= self.grid <= 1000:
            raise InputError(f"--grid: expected 1 to 1000 cells a side, found {self.grid}")
        if not SMALLEST_M <= self.size_m <= LARGEST_M:
            raise InputError(
                f"--size: expected metres from {SMALLEST_M:g} to {LARGEST_M:g}, found {self.size_m}"
            )
        if self.radius_m is not None and not 0.0 < self.radius_m < 0.5 * self.size_m:
            raise InputError(f"--radius: expected metres between 0 and half the map, found {self.radius_m}")
        if not 0.0 <= self.height_m < self.size_m:
            raise InputError(
                f"--height: expected metres >= 0 and below the map's size, found {self.height_m}"
            )


@dataclass(frozen=True, slots=True)
class Scene:
    """A film that has been learned.

    Attributes
    ----------
    film
        What the first pass found.
    options
        What the user told.
    sheet
        Where the sheet is, in pixels of the film.
    background
        The sheet without the robot.
    marks
        Boxes and tapes.
    look
        What the robot looks like; None for a single picture, which shows a map but no path.
    """

    film: FilmSummary
    options: TrackOptions
    sheet: Sheet
    background: Background
    marks: FloorMarks
    look: RobotLook | None

    @property
    def camera_m(self) -> Floats | None:
        """Where the camera is, x, y, z, or None where the picture does not tell."""
        return self.sheet.camera_m((self.film.height_px, self.film.width_px))


def learn_scene(path: Path, options: TrackOptions, advance: Advance | None = None) -> Scene:
    """Learn a film in one pass over it.

    Raises
    ------
    InputError
        If the file is no video, no map is in it, or nothing moves on it.
    """
    film = survey(path, advance)
    sheet = _find_sheet(film, options, path)
    reduced_corners = (sheet.corners_px - 0.5 * (film.reduction - 1)) / film.reduction
    region = Region.around(reduced_corners, film.samples[0].shape[:2])
    if np.count_nonzero(region.mask) < 2000:
        raise InputError(f"{path}: the map takes less than 2000 pixels of the picture; too small to track on")
    background = learn_background(film.samples, region)
    look: RobotLook | None = None
    if film.frames > 1:
        background, look = _learn_robot(film.samples, background, sheet, film.reduction, options)
    marks = find_marks(
        _empty_top_view(background, reduced_corners), background.paper, options.size_m, options.grid
    )
    return Scene(film, options, sheet, background, marks, look)


def _find_sheet(film: FilmSummary, options: TrackOptions, path: Path) -> Sheet:
    if options.corners_px is not None:
        corners = options.corners_px
        if not np.all((corners >= -1.0) & (corners <= [film.width_px, film.height_px])):
            raise InputError(
                f"--corners: a corner lies outside the picture of {film.width_px} x {film.height_px} pixels"
            )
        return Sheet(corners, options.size_m, _GIVEN_CORNER_STD_PX)
    found = find_corners(film.samples)
    if found is None:
        raise InputError(
            f"{path}: no map found: no even four-cornered sheet stands out in this video; try --corners"
        )
    corners, deviation = found
    full = corners * film.reduction + 0.5 * (film.reduction - 1)
    return Sheet(full, options.size_m, deviation * film.reduction)


def _learn_robot(
    samples: Sequence[Image], background: Background, sheet: Sheet, reduction: int, options: TrackOptions
) -> tuple[Background, RobotLook]:
    colour = options.colour if options.colour is not None else learn_colour(samples, background)
    try:
        return background, learn_look(samples, background, sheet, reduction, colour, options.radius_m)
    except InputError:
        if options.colour is None:
            raise
    # It has the colour that was given and never moved, so it was learned as part of the floor.
    cleared = background.cleared_of(options.colour.within(background.image))
    return cleared, learn_look(samples, cleared, sheet, reduction, options.colour, options.radius_m)


def _empty_top_view(background: Background, reduced_corners: Floats) -> Image:
    """The background from above."""
    side = _TOP_VIEW_PX
    H = Sheet(reduced_corners - background.region.offset, 1.0, 0.0).to_top_view(side)
    view: Image = opencv().warpPerspective(background.image, H, (side, side), flags=opencv().INTER_LINEAR)
    return view
