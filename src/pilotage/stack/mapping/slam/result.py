"""What the mapper hands over."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.core.types import FloatArray, IntArray
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.stack.mapping.slam.closures import Closure
from pilotage.stack.mapping.slam.clouds import Clouds
from pilotage.stack.mapping.slam.scan_covariances import ScanCovariances
from pilotage.stack.mapping.slam.submaps import Extent


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
        (K,) scans that are the graph's poses.
    closures
        All candidates that were searched, round by round, with their verdicts.
    extents
        The submaps that closures speak of, by keyframes.
    clouds
        Points of the keyframes.
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
    """

    t_s: FloatArray
    poses: FloatArray
    before: FloatArray
    known: ScanCovariances
    keyframes: IntArray
    closures: tuple[Closure, ...]
    extents: tuple[Extent, ...]
    clouds: Clouds
    grid: OccupancyGrid
    beam_spacing: float
    odometry_scale: float
    odometry_turn_scale: float
    searched: int
    lost: int
    warnings: tuple[str, ...]
