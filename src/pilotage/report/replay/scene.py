"""What a replay shows, whatever the run: fixed layers, tracks that move, series, events.

A page fills a ``ReplayScene``; the player knows nothing else of the run. All tracks share the scene's frames
(one a step, or thinned); what comes at its own times (scans, paths, cells that change) brings them along.
Colours are CSS colours, or ``ink``, ``muted``, ``line`` and ``soft`` for the page's own.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pilotage.core.types import FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class Lines:
    """Fixed polylines (each (n, 2)), filled where they are polygons; ``width_px`` on the screen."""

    name: str
    lines_m: tuple[FloatArray, ...]
    colour: str
    width_px: float = 1.5
    fill: bool = False
    dash: bool = False


@dataclass(frozen=True, slots=True)
class Circles:
    """Fixed circles (n, 3): x, y, radius."""

    name: str
    circles_m: FloatArray
    colour: str
    fill: bool = True


@dataclass(frozen=True, slots=True)
class Marks:
    """Fixed points (n, 2) with a label each; ``look`` is ``diamond``, ``dot``, ``ring`` or ``cross``."""

    name: str
    points_m: FloatArray
    labels: tuple[str, ...]
    colour: str
    look: str = "diamond"


@dataclass(frozen=True, slots=True)
class Raster:
    """Cells (rows, columns) of palette numbers, row 0 at the bottom, that may change over time.

    A background image has no changes; a map that the robot fills in has one entry a changed cell, in the
    order of time: when, which cell (row * columns + column), its new number.
    """

    name: str
    bounds_m: tuple[float, float, float, float]
    cells: IntArray
    palette: tuple[str, ...]
    change_t_s: FloatArray = field(default_factory=lambda: np.empty(0))
    change_cell: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    change_value: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    smooth: bool = False


@dataclass(frozen=True, slots=True)
class PoseTrack:
    """A pose a frame, (N,) each, nan where there is none.

    ``look``: ``robot`` (a disc of ``radius_m`` with its heading), ``outline`` (the same, not filled) or
    ``point``; ``body_m`` (K, 2) is a polygon in the robot's frame that is drawn in the disc's place.
    ``trail`` draws the path so far. ``cov_m2`` (N, 3) is xx, xy, yy of its 95 % ellipse. ``absent`` is said
    where there is no pose.
    """

    name: str
    x_m: FloatArray
    y_m: FloatArray
    theta_rad: FloatArray
    colour: str
    look: str = "robot"
    radius_m: float = 0.0
    trail: bool = False
    cov_m2: FloatArray | None = None
    absent: str = ""
    body_m: FloatArray = field(default_factory=lambda: np.empty((0, 2)))


@dataclass(frozen=True, slots=True)
class DiscTrack:
    """Discs that move: ``places_m`` (N, P, 2) at the frames, nan for who is not there; ``radius_m`` (P,)."""

    name: str
    places_m: FloatArray
    radius_m: FloatArray
    colour: str


@dataclass(frozen=True, slots=True)
class ScanTrack:
    """Scans (S, B) from poses (S, 3) of the scanner, each shown until the next; nan for no return."""

    name: str
    t_s: FloatArray
    ranges_m: FloatArray
    angles_rad: FloatArray
    poses: FloatArray
    colour: str


@dataclass(frozen=True, slots=True)
class SightTrack:
    """Lines from a pose track to fixed points seen: ``counts`` (N,) a frame, ``points_m`` (sum, 2)."""

    name: str
    counts: IntArray
    points_m: FloatArray
    seen_from: int
    colour: str


@dataclass(frozen=True, slots=True)
class PathTrack:
    """Paths (n, 2), each valid from its time until the next one's."""

    name: str
    t_s: FloatArray
    paths_m: tuple[FloatArray, ...]
    colour: str


@dataclass(frozen=True, slots=True)
class States:
    """A state a frame (N,), as a number into ``names`` and ``colours``; -1 for none."""

    name: str
    numbers: IntArray
    names: tuple[str, ...]
    colours: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Series:
    """A panel beside the map: ``values`` (N,), a band from 0 to ``band`` or a second line ``other``."""

    title: str
    unit: str
    values: FloatArray
    colour: str
    band: FloatArray | None = None
    band_name: str = ""
    other: FloatArray | None = None
    other_name: str = ""


@dataclass(frozen=True, slots=True)
class SceneEvent:
    """Something that happened: a tick on the time line, its text shown at its time."""

    t_s: float
    kind: str
    text: str
    colour: str


@dataclass(frozen=True, slots=True)
class ReplayScene:
    """All that the player shows.

    ``breaks`` are frames before which the tracks jump (no line is drawn); ``follow_m`` is the width of the
    view when it follows the robot, 0 to leave that to the player.
    """

    t_s: FloatArray
    bounds_m: tuple[float, float, float, float]
    rasters: tuple[Raster, ...] = ()
    lines: tuple[Lines, ...] = ()
    circles: tuple[Circles, ...] = ()
    marks: tuple[Marks, ...] = ()
    paths: tuple[PathTrack, ...] = ()
    poses: tuple[PoseTrack, ...] = ()
    discs: tuple[DiscTrack, ...] = ()
    scans: tuple[ScanTrack, ...] = ()
    sights: tuple[SightTrack, ...] = ()
    states: States | None = None
    series: tuple[Series, ...] = ()
    events: tuple[SceneEvent, ...] = ()
    breaks: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    note: str = ""
    follow_m: float = 0.0
