"""Segment maps in YAML files: bounds, walls, landmarks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import model_validator

from pilotage.core.config import MapConfig, validate
from pilotage.core.errors import InputError
from pilotage.core.limits import limit, too_large
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.segment_map import SegmentMap

MOST_PARTS = 10_000
"""Walls, circles and landmarks each: what looks at all of them in every step is slow long before."""
Coordinates = tuple[float, float, float, float]


class LandmarkEntry(MapConfig):
    """One landmark."""

    id: int
    x_m: float
    y_m: float


class MapFile(MapConfig):
    """The file's schema: metres, x right, y up."""

    map: str
    description: str = ""
    bounds_m: Coordinates | None = None
    walls_m: tuple[Coordinates, ...]
    circles_m: tuple[tuple[float, float, float], ...] = ()
    landmarks: tuple[LandmarkEntry, ...] = ()
    walls_count: int | None = None
    landmarks_count: int | None = None
    """Where given, how many the file must hold: a file cut in half is noticed."""

    @staticmethod
    def where_listed(key: str) -> str:
        """What to give for a key that is missing."""
        return (
            "the map's own name, such as 'map: room', beside its walls" if key == "map" else f"{key} of a map"
        )

    @model_validator(mode="after")
    def _something_solid(self) -> MapFile:
        if not self.walls_m and not self.circles_m:
            raise ValueError("walls_m: expected at least 1 item, or one in circles_m, found none in either")
        return self


@dataclass(frozen=True, slots=True)
class LandmarkMap:
    """A segment map with its landmarks."""

    name: str
    walls: SegmentMap
    landmarks: Landmarks


def parse_map(values: dict[str, Any], where: str) -> LandmarkMap:
    """Build a map from a parsed file.

    Raises
    ------
    InputError
        One line where a key is unknown or missing, a number is not finite, or walls are missing.
    """
    return build_map(validate(MapFile, values, where), where)


def build_map(entry: MapFile, where: str) -> LandmarkMap:
    """Build a map from a validated entry; InputError where walls are missing or far too many."""
    counts = (
        ("walls", entry.walls_count, len(entry.walls_m)),
        ("landmarks", entry.landmarks_count, len(entry.landmarks)),
    )
    for what, expected, found in counts:
        if expected is not None and expected != found:
            raise InputError(
                f"{where}: expected {expected} {what} ({what}_count), found {found}; "
                "the file seems to be cut short"
            )
    for what, found in (
        ("walls", len(entry.walls_m)),
        ("circles", len(entry.circles_m)),
        ("landmarks", len(entry.landmarks)),
    ):
        if found > limit(MOST_PARTS):
            raise too_large(where, limit(MOST_PARTS), found, what)
    for i, (x0, y0, x1, y1) in enumerate(entry.walls_m):
        if (x0, y0) == (x1, y1):  # bodies run into it, and no laser sees it
            raise InputError(
                f"{where}: walls_m.{i}: expected a wall from one place to another, found ({x0:g}, {y0:g})"
            )
    walls = SegmentMap.of(np.array(entry.walls_m), np.array(entry.circles_m).reshape(-1, 3))
    if entry.bounds_m is not None:
        walls = SegmentMap(walls.segments_m, walls.circles_m, entry.bounds_m)
    landmarks = Landmarks(
        np.array([mark.id for mark in entry.landmarks], dtype=np.int64),
        np.array([[mark.x_m, mark.y_m] for mark in entry.landmarks]).reshape(-1, 2),
    )
    return LandmarkMap(entry.map, walls, landmarks)
