"""Why a scan corrected the belief as it did: told by the stack, kept by the records, drawn by the report."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from pilotage.core.types import FloatArray, IntArray

__all__ = ["LineVerdict", "ScanUpdate"]


class LineVerdict(StrEnum):
    """What became of a line of a scan."""

    ACCEPTED = "accepted"
    AMBIGUOUS = "ambiguous: another explanation is as likely"
    GATED = "beyond the gate"
    NO_WALL = "beside no wall of the map"
    AT_ODDS = "hidden from here, or at odds with the others"


@dataclass(frozen=True, slots=True)
class ScanUpdate:
    """Why a scan corrected the belief as it did, line by line, for the record.

    Attributes
    ----------
    sensor_pose, sensor_pose_after
        (3,) of the scanner in the map frame, as believed before and after the update.
    points_m, clusters, members
        (N, 2) the scan in the sensor's frame, and per point its cluster and its line, -1 for none.
    ends_m
        (L, 4) x0, y0, x1, y1 of the lines in the sensor's frame.
    walls_m
        (L, 4) in the map frame, the wall that each line was matched to; nan for none.
    distances, gate
        (L,) squared Mahalanobis distance of each line to its wall before the update, or to the nearest that
        it could be (inf where it lies beside none); the chi-square value of the gate, two degrees of freedom.
    verdicts
        One a line.
    """

    sensor_pose: FloatArray
    sensor_pose_after: FloatArray
    points_m: FloatArray
    clusters: IntArray
    members: IntArray
    ends_m: FloatArray
    walls_m: FloatArray
    distances: FloatArray
    gate: float
    verdicts: tuple[LineVerdict, ...]
