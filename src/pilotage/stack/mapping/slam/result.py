"""What the mapper hands over."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.stack.mapping.slam.closures import Closure
from pilotage.stack.mapping.slam.clouds import Clouds
from pilotage.stack.mapping.slam.earlier_map import EarlierMap, KeyframeScans
from pilotage.stack.mapping.slam.scan_covariances import ScanCovariances
from pilotage.stack.mapping.slam.submaps import Extent
from pilotage.stack.mapping.slam.uncertainty import Edges


@dataclass(frozen=True, slots=True)
class Joined:
    """How a recording was joined to an earlier map.

    Attributes
    ----------
    earlier
        What was kept of that map: its keyframes are the first of the graph.
    dropped
        How many of its keyframes were superfluous.
    extents, submaps
        Submaps of both, and how many of them are the earlier map's.
    closures
        Candidates between the two, with their verdicts.
    stretches, agreeing
        How many stretches of the recording were searched all over the map, and how many agree where it lies.
    walls
        Share of the recording's points on the map's walls, of those that fall where it saw.
    warnings
        Parts of the recording that were not found.
    """

    earlier: EarlierMap
    dropped: int
    extents: tuple[Extent, ...]
    submaps: int
    closures: tuple[Closure, ...]
    stretches: int
    agreeing: int
    walls: float
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class NotJoined:
    """A recording that was not found in an earlier map, or not surely: the reason, and what was tried."""

    reason: str
    stretches: int
    agreeing: int


@dataclass(frozen=True, slots=True)
class SlamResult:
    """A mapped recording.

    Attributes
    ----------
    t_s
        (N,) times of the scans.
    poses, before
        (N, 3) of the scanner in the map after the last optimization, and by the front end alone.
    known
        How sure ``poses`` are; holds the graph after the last optimization.
    keyframes
        (K,) scans that are the graph's poses, after those of an earlier map.
    closures
        All candidates that were searched, round by round, with their verdicts.
    extents
        The submaps that closures speak of, by keyframes.
    clouds
        Points of the graph's keyframes.
    scans
        What the recording's own keyframes measured, with their true angles.
    grid
        The map.
    beam_spacing
        True angle between beams over the one the log tells, as estimated.
    odometry_scale, odometry_turn_scale
        Path and turn by the map over those by the odometry; NaN without odometry.
    searched, lost
        Scans whose neighbourhood had to be searched, and those that could not be aligned.
    warnings
        What the user should know, a sentence each.
    joined
        Where it extends an earlier map.
    """

    t_s: FloatArray
    poses: FloatArray
    before: FloatArray
    known: ScanCovariances
    keyframes: IntArray
    closures: tuple[Closure, ...]
    extents: tuple[Extent, ...]
    clouds: Clouds
    scans: KeyframeScans
    grid: OccupancyGrid
    beam_spacing: float
    odometry_scale: float
    odometry_turn_scale: float
    searched: int
    lost: int
    warnings: tuple[str, ...]
    joined: Joined | None = None

    def keyframe_scans(self) -> KeyframeScans:
        """Return what all keyframes of the graph measured."""
        return self.scans if self.joined is None else self.joined.earlier.scans.and_more(self.scans)

    def breaks(self) -> IntArray:
        """(B,) keyframes that do not follow the path of the one before."""
        pieces = [extent.piece for extent in self.extents]
        firsts = [e.first for e, piece in zip(self.extents[1:], pieces, strict=False) if e.piece != piece]
        return np.array(firsts, np.int64)

    def earlier_map(self) -> EarlierMap:
        """Return this map as a later recording extends it."""
        graph = self.known.graph
        weighted = graph.information * self.known.weights[:, None, None]
        never = np.zeros(graph.i.size, np.bool_)
        edges = Edges(graph.i, graph.j, graph.measurements, weighted, never)
        last = len(graph) - self.keyframes.size
        return EarlierMap(graph.poses, self.clouds, self.keyframe_scans(), edges, self.breaks(), last)
