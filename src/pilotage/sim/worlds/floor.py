"""A layer of what is painted or taped on the floor, as a sensor sees it that looks down."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.kernels.geometry.plane import NO_CIRCLES, distance_to_nearest
from pilotage.maps.markings import FloorMarkings


@dataclass(frozen=True, slots=True)
class FloorLayer:
    """Tapes and the sheet's edge."""

    markings: FloorMarkings

    def is_dark(self, x_m: float, y_m: float, blur_m: float = 0.0) -> bool:
        """Whether the floor is dark there; tapes and the dark floor reach ``blur_m`` farther than they do."""
        marks = self.markings
        tapes = distance_to_nearest(x_m, y_m, marks.tapes_m, NO_CIRCLES)
        if tapes <= 0.5 * marks.tape_width_m + blur_m:
            return True
        width, height = marks.size_m
        inside = min(x_m, width - x_m, y_m, height - y_m)
        return marks.edge_is_dark and inside < blur_m
