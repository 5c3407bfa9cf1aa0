"""A map of any format, as layers: what a file says of a world, and what a robot may be told of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pilotage.core.config import FARTHEST_M
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.kernels.geometry.plane import NO_CIRCLES, NO_SEGMENTS
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.elevation import ElevationModel
from pilotage.maps.ground_distance import ground_distance
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.markings import FloorMarkings
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.outlines import outlines
from pilotage.maps.segment_map import SegmentMap

NO_LANDMARKS = Landmarks(np.zeros(0, dtype=np.int64), np.zeros((0, 2)))


@dataclass(frozen=True, eq=False)
class WorldMap:
    """Layers of a map; None where it has none of a kind.

    Attributes
    ----------
    bounds_m
        xmin, ymin, xmax, ymax.
    geometry
        Walls and discs, exactly.
    grid
        Cells that are free, occupied or unknown; of terrain, its hazards.
    elevation, slope_limit_deg
        Heights, and the slope beyond which a cell of ``grid`` is a hazard.
    markings
        What is painted or taped on the floor.
    landmarks
        Points with identities.
    picture
        (rows, columns) a grey picture that came with the map.
    open_ground
        Whether occupied cells are hazards of open ground, which stop neither body nor beam.
    """

    name: str
    bounds_m: tuple[float, float, float, float]
    geometry: SegmentMap | None = None
    grid: OccupancyGrid | None = None
    elevation: ElevationModel | None = None
    slope_limit_deg: float | None = None
    markings: FloorMarkings | None = None
    landmarks: Landmarks = NO_LANDMARKS
    picture: NDArray[np.uint8] | None = None
    open_ground: bool = False

    def __post_init__(self) -> None:
        """Refuse what no run's folder could be read of.

        Raises
        ------
        InputError
            Where the map reaches beyond ``FARTHEST_M``.
        """
        farthest_m = max(map(abs, self.bounds_m))
        if not farthest_m <= FARTHEST_M:
            raise InputError(
                f"map '{self.name}': expected all of it within {FARTHEST_M:g} m of the origin, found up to "
                f"{farthest_m:g}; is the resolution right?"
            )

    @cached_property
    def walls(self) -> SegmentMap:
        """Everything solid as segments and discs: of a grid the outlines of its occupied cells, exactly."""
        if self.geometry is not None:
            return self.geometry
        segments: FloatArray = NO_SEGMENTS if self.grid is None else outlines(self.grid)
        return SegmentMap(segments, NO_CIRCLES, self.bounds_m)

    @cached_property
    def barriers(self) -> SegmentMap:
        """What is not driven into: the walls, and of a grid the outlines of its unknown cells as well."""
        if self.geometry is not None or self.grid is None or not (self.grid.cells < 0).any():
            return self.walls
        return SegmentMap(outlines(self.grid, unknown_is_solid=True), NO_CIRCLES, self.bounds_m)

    @cached_property
    def field(self) -> DistanceField:
        """Distance to the nearest barrier, sampled, with the barriers beside it; negative in solid cells."""
        if self.geometry is None and self.grid is not None:
            return ground_distance(self.barriers, self.grid)
        return DistanceField.from_map(self.barriers)

    @property
    def reflectors(self) -> SegmentMap:
        """What ends a beam: the walls; nothing on open ground, whose hazards do not."""
        return SegmentMap(NO_SEGMENTS, NO_CIRCLES, self.bounds_m) if self.open_ground else self.walls

    @cached_property
    def wall_field(self) -> DistanceField:
        """Distance to the nearest wall that returns a beam, sampled."""
        if self.open_ground:  # one value says it all, however far the ground goes on
            xmin, ymin, xmax, ymax = self.bounds_m
            return DistanceField.from_map(self.reflectors, max(xmax - xmin, ymax - ymin))
        exact = self.geometry is not None or self.grid is None
        return self.field if exact else DistanceField.from_map(self.walls)

    def contains(self, x_m: float, y_m: float) -> bool:
        """Whether a point lies within the bounds."""
        xmin, ymin, xmax, ymax = self.bounds_m
        return xmin <= x_m <= xmax and ymin <= y_m <= ymax

    def extent_only(self) -> WorldMap:
        """What somebody knows who was told how large the place is and nothing of what stands in it."""
        markings = None if self.markings is None else self.markings.without_tapes()
        return WorldMap(self.name, self.bounds_m, markings=markings)

    def with_landmarks(self, landmarks: Landmarks) -> WorldMap:
        """The same map with other landmarks."""
        return replace(self, landmarks=landmarks)
