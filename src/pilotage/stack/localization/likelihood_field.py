"""How likely a scan is from a pose: by how far its beams end from what is solid on the map."""

from __future__ import annotations

import math

import numpy as np
import scipy

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, Pose2
from pilotage.kernels.filters import particles
from pilotage.kernels.grids.marks import marked_at
from pilotage.maps.known_maps import OncePerMap
from pilotage.maps.nearest_obstacles import NearestObstacles
from pilotage.maps.outlines import rim_lines
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.stack.localization.odometry_watch import TURN_AS_PATH_M

WALL_STD_M, GRID_SHARE = 0.01, 1.0 / 3.0
"""What walls are wrong by, and of cells which share of their side, beyond the cell itself."""
INDEPENDENT_SHARE = 0.25
"""Of a scan's beams that err alike: on cells those on one wall end where its cells were drawn, together."""
VAGUE_M = 0.2
"""Of beams that are told no better than this many end beside another wall than they met: the field errs, and
in every scan from there alike."""
THIN_STDS, THIN_SHARE, ALONG_M, PARALLEL = 3.0, 0.25, 0.1, 0.98
"""Where so large a share of the walls has its other face within so many standard deviations of a beam, ends
are nearer to that face than to the one they met, in every scan from there alike; looked at so far apart, for
faces whose directions have this cosine at least."""
SAME_FACE_M = 1e-3
"""Faces no farther apart are one, drawn in pieces."""
MOST_SAMPLES = 50_000
"""Of a map's walls; longer ones are looked at farther apart."""
ALIKE_M, LEAST_MOVE_M = 3.0, 0.03
"""Path over which the cells in sight, and so their errors, become others; who stands still counts as one who
moves a little: people and noise differ from scan to scan."""
AT_WALL_STDS = 3
"""A beam so near to a wall ends at it."""
TABLE_PER_STD, TABLE_STDS = 50, 12
"""The table of a beam's density: entries per standard deviation, and how many of these."""
LEAST_MAPPED = 0.5
"""Share of a scan that has to end where the map says anything."""
SPACING_M, MOST_NODES = 0.05, 4_000_000
"""Between the nodes that know what is nearest, and how many there are at most where cells are smaller: of
things that lie no farther apart than nodes do the wrong one is nearest."""
BESIDE_CELLS = 2
"""A beam that ends so few cells beyond the known ones may have hit the wall before them."""


class LikelihoodField:
    """The likelihood field of Thrun et al. (2005), table 6.3, on walls or on the cells of a grid.

    A wall is a line, and a beam ends at it but for the variances. A cell is occupied because something in it
    returned beams, nobody knows where in it: all of the cell is as likely. Taking its sides for the wall
    instead sets a robot off by a whole cell wherever the walls were drawn on the same side of where they are,
    and it is sure of that (a millimetre in a map that was 0.05 m off).

    Attributes
    ----------
    errs_alike
        Whether scans from one place err alike: on a grid's cells, and where beams are told vaguely.
    independent_share
        Power of a scan's likelihood that is as informative as its beams are together.
    least_at_wall, least_beside
        Log-densities from which on a beam ends at a wall, and at one or beside it.
    """

    def __init__(
        self,
        chart: WorldMap,
        *,
        resolution_m: float | None,
        range_var_m2: float,
        field_std_m: float | None,
        random_share: float,
        reach_m: float,
    ) -> None:
        on_cells = chart.geometry is None and chart.grid is not None and not chart.open_ground
        half_m, least_std_m, walls = 0.0, WALL_STD_M, chart.reflectors
        if on_cells and chart.grid is not None:
            half_m, least_std_m = 0.5 * chart.grid.resolution_m, GRID_SHARE * chart.grid.resolution_m
            walls = SegmentMap(rim_lines(chart.grid), np.zeros((0, 3)), chart.bounds_m)
        if walls.segments_m.shape[0] + walls.circles_m.shape[0] == 0:
            raise InputError(
                f"particle-filter: expected walls or blocked cells on the robot's map, found none on "
                f"'{chart.name}'; see stack.map"
            )
        self._half_m, self._bounds_m = half_m, chart.bounds_m
        self._nearest = _nearest_of(chart, walls, _spacing_m(chart) if resolution_m is None else resolution_m)
        self._known = _known_of(chart)
        std_m = math.sqrt(range_var_m2 + (least_std_m if field_std_m is None else field_std_m) ** 2)
        if std_m == 0.0:
            raise InputError(
                "particle-filter: a scanner without noise leaves the filter no measurement variance; "
                "set stack.localizer.range_var_m2 or field_std_m above 0"
            )
        self.errs_alike = (
            on_cells
            or std_m > VAGUE_M
            or thin_share(chart.reflectors.segments_m, THIN_STDS * std_m) > THIN_SHARE
        )
        self.independent_share = INDEPENDENT_SHARE if self.errs_alike else 1.0
        self._step_m = std_m / TABLE_PER_STD
        inside = round(half_m / self._step_m)
        z = np.maximum(np.arange(inside + TABLE_STDS * TABLE_PER_STD + 1) - inside, 0) / TABLE_PER_STD
        width_m = std_m * math.sqrt(2.0 * math.pi) + 2.0 * half_m
        self._table = np.log((1.0 - random_share) * np.exp(-0.5 * z * z) / width_m + random_share / reach_m)
        self.least_at_wall = float(self._table[inside + AT_WALL_STDS * TABLE_PER_STD])
        self.least_beside = float(self._table[-2])

    def log_likelihoods(self, points: FloatArray, poses: FloatArray) -> FloatArray:
        """(N,) of a scan's end points (K, 2) in the robot's frame, seen from each of the poses (N, 3)."""
        nodes, table = self._nearest.nodes, self._table
        found: FloatArray = particles.log_likelihoods(poses, points, nodes, table, self._step_m)
        return found

    def log_densities(self, points: FloatArray, pose: FloatArray) -> FloatArray:
        """(K,) of each of a scan's end points (K, 2) in the robot's frame, from a pose (3,)."""
        away = self._nearest.at(Pose2.from_array(pose).placed(points))
        entries = np.minimum(away / self._step_m + 0.5, len(self._table) - 1.0)
        return np.asarray(self._table[entries.astype(np.int64)])

    def alike(self, moved_m: float, turned_rad: float) -> float:
        """How much the error of a scan taken after a move is the last one's: from 0, not at all, to 1.

        A grid's errors are the same from scan to scan while the same cells are in sight: such scans are no
        independent witnesses.
        """
        if not self.errs_alike:
            return 0.0
        path_m = moved_m + TURN_AS_PATH_M * turned_rad
        return math.exp(-max(path_m, LEAST_MOVE_M) / ALIKE_M)

    def mapped(self, points: FloatArray, pose: FloatArray) -> FloatArray:
        """Those of a scan's end points (K, 2) that lie where the map says anything, as seen from a pose (3,).

        What ends in unknown cells would speak for whatever pose puts it beside a known wall instead; a scan
        of which most does so says nothing.
        """
        if self._known is None or not len(points):
            return points
        mapped = self.known_at(Pose2.from_array(pose).placed(points))
        return np.ascontiguousarray(points[mapped & (mapped.mean() >= LEAST_MAPPED)])

    def known_at(self, points: FloatArray) -> BoolArray:
        """(K,) whether the map says anything of points (K, 2) of the map frame."""
        if self._known is None:
            xmin, ymin, xmax, ymax = self._bounds_m
            x, y = points[:, 0], points[:, 1]
            return np.asarray((x >= xmin) & (x <= xmax) & (y >= ymin) & (y <= ymax))
        return marked_at(np.ascontiguousarray(points), *self._known)

    def distances_m(self, points: FloatArray) -> FloatArray:
        """(K,) from points (K, 2) of the map frame to the nearest wall or occupied cell."""
        return np.maximum(self._nearest.at(points) - self._half_m, 0.0)


def thin_share(segments_m: FloatArray, within_m: float) -> float:
    """Share of the walls' length (S, 4) that has another, parallel face nearer than ``within_m``."""
    ends = segments_m.reshape(-1, 2, 2)
    along = ends[:, 1] - ends[:, 0]
    length_m = np.hypot(along[:, 0], along[:, 1])
    total_m = float(length_m.sum())
    if total_m == 0.0:
        return 0.0
    counts = np.maximum(1, (length_m / max(ALONG_M, total_m / MOST_SAMPLES)).astype(np.int64))
    owner = np.repeat(np.arange(len(ends)), counts)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    share = (number + 0.5) / counts[owner]
    unit = along / np.maximum(length_m, 1e-12)[:, None]
    samples = ends[owner, 0] + share[:, None] * along[owner]
    beside = np.zeros(len(samples), np.bool_)
    # Just beside a sample, for another's samples lie up to half their distance farther along.
    reach_m = math.hypot(within_m, 0.5 * float((length_m / counts).max()))
    pairs = scipy.spatial.cKDTree(samples).query_pairs(reach_m, output_type="ndarray")
    first, second = owner[pairs[:, 0]], owner[pairs[:, 1]]
    apart = samples[pairs[:, 1]] - samples[pairs[:, 0]]
    across_m = np.abs(unit[first, 0] * apart[:, 1] - unit[first, 1] * apart[:, 0])
    parallel = np.abs((unit[first] * unit[second]).sum(axis=1)) > PARALLEL
    thin = (first != second) & parallel & (across_m < within_m) & (across_m > SAME_FACE_M)
    beside[pairs[thin].ravel()] = True
    return float((beside * (length_m / counts)[owner]).sum()) / total_m


_NEAREST: OncePerMap[NearestObstacles] = OncePerMap()


def _nearest_of(chart: WorldMap, walls: SegmentMap, resolution_m: float) -> NearestObstacles:
    """What of a map's walls is nearest where; robots that are told the same map work it out once."""
    return _NEAREST.get(chart, resolution_m, lambda: NearestObstacles.from_map(walls, resolution_m))


def _spacing_m(chart: WorldMap) -> float:
    """Between nodes: as near as the map's cells, where memory allows."""
    if chart.geometry is not None or chart.grid is None:
        return SPACING_M
    width_m, height_m = chart.grid.size_m
    least_m = math.sqrt(width_m * height_m / MOST_NODES)
    return min(SPACING_M, max(chart.grid.resolution_m, least_m))


def _known_of(chart: WorldMap) -> tuple[BoolArray, FloatArray] | None:
    """Which cells of the grid are known or lie right beside such, and its frame; None where all are."""
    if chart.geometry is not None or chart.grid is None or not (chart.grid.cells < 0).any():
        return None
    known = scipy.ndimage.binary_dilation(chart.grid.cells >= 0, iterations=BESIDE_CELLS)
    return known, chart.grid.frame
