"""The walls of a map as a line matcher wants them: merged where collinear and near, in normal form."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import FloatArray, IntArray
from pilotage.maps.segment_map import SegmentMap


@dataclass(frozen=True, slots=True)
class WallLines:
    """Walls of a map.

    Attributes
    ----------
    segments_m
        (W, 4) x0, y0, x1, y1 of the merged walls.
    normals
        (W, 2) distance rho >= 0 in m of the wall's infinite line from the map's origin, and angle alpha in
        rad of its normal: x cos(alpha) + y sin(alpha) = rho.
    line_of
        (W,) number of the infinite line that a wall lies on; walls with a gap between them may share one.
    pieces_m, wall_of
        (P, 4) the map's own segments, and (P,) the wall that each is a piece of.
    """

    segments_m: FloatArray
    normals: FloatArray
    line_of: IntArray
    pieces_m: FloatArray
    wall_of: IntArray

    def __len__(self) -> int:
        return int(self.segments_m.shape[0])

    @staticmethod
    def of(
        world: SegmentMap,
        gap_m: float = 0.0,
        offset_tolerance_m: float = 1e-3,
        angle_tolerance_rad: float = 1e-3,
    ) -> WallLines:
        """Merge the segments of a map that lie on one line and are no farther than ``gap_m`` apart.

        Pieces of no length are left out. The face of a wall in a recorded map is a row of cells with some
        missing and some before it: a scan has one line along it, and no piece of it is as long.

        Tolerances apply to a wall's own normal form, so a map drawn by hand with walls a few
        millimetres askew keeps them apart. A merged wall lies where its own pieces do: walls with a gap
        between them share a number, not a place, because a filter that averages hundreds of scans sees the
        half millimetre by which a map in whole millimetres puts them off one line.
        """
        pieces = [np.asarray(piece, dtype=np.float64) for piece in world.segments_m]
        pieces = [piece for piece in pieces if math.hypot(*(piece[2:] - piece[:2])) > 0.0]
        pieces.sort(key=lambda piece: -math.hypot(*(piece[2:] - piece[:2])))
        lines: list[tuple[float, float]] = []
        table = np.empty((len(pieces), 3))
        spans: list[list[_Span]] = []
        for piece in pieces:
            number = _first_line(piece, table[: len(lines)], offset_tolerance_m, angle_tolerance_rad)
            if number is None:
                number = len(lines)
                rho, alpha = normal_form(piece)
                lines.append((rho, alpha))
                table[number] = math.cos(alpha), math.sin(alpha), rho
                spans.append([])
            rho_alpha = lines[number]
            ends = sorted((_along(piece[:2], rho_alpha), _along(piece[2:], rho_alpha)))
            spans[number].append(_Span(ends[0], ends[1], [piece]))
        segments: list[list[float]] = []
        normals: list[list[float]] = []
        line_of, wall_of = list[int](), list[int]()
        own: list[FloatArray] = []
        for number in range(len(lines)):
            for span in _merged(spans[number], max(gap_m, offset_tolerance_m)):
                own += span.pieces
                wall_of += [len(segments)] * len(span.pieces)
                rho, alpha = _fitted(span.pieces)
                along = [_along(end, (rho, alpha)) for piece in span.pieces for end in (piece[:2], piece[2:])]
                foot = rho * math.cos(alpha), rho * math.sin(alpha)
                tangent = -math.sin(alpha), math.cos(alpha)
                segments.append(
                    [foot[k % 2] + (min(along), max(along))[k // 2] * tangent[k % 2] for k in range(4)]
                )
                normals.append([rho, alpha])
                line_of.append(number)
        return WallLines(
            np.array(segments, dtype=np.float64).reshape(-1, 4),
            np.array(normals, dtype=np.float64).reshape(-1, 2),
            np.array(line_of, dtype=np.int64),
            np.array(own, dtype=np.float64).reshape(-1, 4),
            np.array(wall_of, dtype=np.int64),
        )


@dataclass(frozen=True, slots=True)
class _Span:
    """Pieces of one wall, and how far they reach along their line."""

    low: float
    high: float
    pieces: list[FloatArray]


def normal_form(segment: FloatArray) -> tuple[float, float]:
    """Distance rho >= 0 and angle alpha of the normal of the infinite line through a segment (4,)."""
    dx, dy = float(segment[2] - segment[0]), float(segment[3] - segment[1])
    alpha = math.atan2(-dx, dy)
    rho = float(segment[0]) * math.cos(alpha) + float(segment[1]) * math.sin(alpha)
    if rho < 0.0:
        rho, alpha = -rho, alpha + math.pi
    return rho, wrap_to_pi(alpha)


def _along(point: FloatArray, line: tuple[float, float]) -> float:
    return float(-point[0] * math.sin(line[1]) + point[1] * math.cos(line[1]))


def _first_line(segment: FloatArray, lines: FloatArray, offset_m: float, angle_rad: float) -> int | None:
    """The first line that both ends of a segment (4,) lie on and that it runs along.

    Parameters
    ----------
    lines
        (L, 3) cos(alpha), sin(alpha) and rho of their normal forms. All at once: an outline of cells has tens
        of thousands of pieces on thousands of lines.
    """
    c, s, rho = lines.T
    x0, y0, x1, y1 = segment.tolist()
    dx, dy = x1 - x0, y1 - y0
    on = np.abs(x0 * c + y0 * s - rho) <= offset_m
    on &= np.abs(x1 * c + y1 * s - rho) <= offset_m
    on &= np.abs(dx * c + dy * s) <= angle_rad * math.hypot(dx, dy)
    found = np.flatnonzero(on)
    return int(found[0]) if len(found) else None


def _merged(spans: list[_Span], gap_m: float) -> list[_Span]:
    """Union of intervals, joined where they overlap or no more than a gap is between them."""
    merged: list[_Span] = []
    for span in sorted(spans, key=lambda span: (span.low, span.high)):
        if merged and span.low <= merged[-1].high + gap_m:
            last = merged[-1]
            merged[-1] = _Span(last.low, max(last.high, span.high), last.pieces + span.pieces)
        else:
            merged.append(span)
    return merged


def _fitted(pieces: list[FloatArray]) -> tuple[float, float]:
    """Normal form of the line that is nearest to all points of the pieces (total least squares)."""
    if all(np.array_equal(piece, pieces[0]) for piece in pieces):
        return normal_form(pieces[0])
    length = np.array([math.hypot(*(piece[2:] - piece[:2])) for piece in pieces])
    half = 0.5 * np.array([piece[2:] - piece[:2] for piece in pieces])
    middle = np.array([0.5 * (piece[:2] + piece[2:]) for piece in pieces])
    centre = length @ middle / length.sum()
    off = middle - centre
    # A segment of half extent h about its middle has the second moment h h' / 3 a metre.
    moment = (off * length[:, None]).T @ off + (half * length[:, None]).T @ half / 3.0
    direction = np.linalg.eigh(moment)[1][:, -1]
    return normal_form(np.concatenate([centre, centre + direction]))
