"""How much of a floor a map shows, and how far its walls are from the true ones."""

from __future__ import annotations

import numpy as np
import scipy

from pilotage.core.types import BoolArray, FloatArray, Pose2
from pilotage.maps.nearest_obstacles import NearestObstacles
from pilotage.maps.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap

LATTICE_M = 0.05
FIELD_M = 0.05
"""A field of distances may be so much too small in the middle of a gap, where it folds between its nodes."""
RIDGE_SHARE = 0.8
"""By so much of the lattice another node may be farther from walls than one in the middle between them."""
BESIDE_M = 0.05
"""Floor nearer to a wall than this shares a cell with it: it does not count."""
ROUNDING_M = 1e-9


def reachable_floor(chart: WorldMap, radius_m: float, start: Pose2, spare_m: float = 0.0) -> FloatArray:
    """Points (N, 2) of a lattice that a disc can cover somewhere on its ways from a start.

    It keeps ``spare_m`` beside it on all of them. What stops a body counts, walls: cells that a map says
    nothing of are floor, as bodies and beams pass them. A gap counts that is wide enough, wherever the
    lattice lies.
    """
    clear_m = radius_m + spare_m
    xmin, ymin, xmax, ymax = chart.bounds_m
    x = np.arange(xmin + 0.5 * LATTICE_M, xmax, LATTICE_M)
    y = np.arange(ymin + 0.5 * LATTICE_M, ymax, LATTICE_M)
    points = np.stack(np.meshgrid(x, y), axis=2).reshape(-1, 2)
    distance = chart.wall_field.at(points).reshape(y.size, x.size)
    room = distance >= clear_m
    narrow = _narrow_places(distance, clear_m, LATTICE_M + FIELD_M) & ~room
    room[narrow] = [_has_room(chart.walls, point, clear_m) for point in points[narrow.ravel()]]
    labels, _ = scipy.ndimage.label(room)
    row = min(max(int((start.y_m - ymin) / LATTICE_M), 0), y.size - 1)
    column = min(max(int((start.x_m - xmin) / LATTICE_M), 0), x.size - 1)
    if labels[row, column] == 0:
        return np.zeros((0, 2))
    stands = labels == labels[row, column]
    away = scipy.ndimage.distance_transform_edt(~stands, sampling=LATTICE_M)
    floor = points[(away <= clear_m).ravel()]
    if not len(floor) or len(chart.walls.segments_m) + len(chart.walls.circles_m) == 0:
        return np.asarray(floor)
    # The field is coarser than what is asked: beside thin walls it tells 0.05 m of points 0.025 m away.
    return np.asarray(floor[_from_walls_m(floor, chart.walls, LATTICE_M) >= BESIDE_M - ROUNDING_M])


def _narrow_places(distance_m: FloatArray, clear_m: float, off_m: float) -> BoolArray:
    """Which nodes (rows, columns) between walls are clear, or not, by less than ``off_m``."""
    middle = distance_m >= scipy.ndimage.maximum_filter(distance_m, 3) - RIDGE_SHARE * LATTICE_M
    return np.asarray(middle & (np.abs(distance_m - clear_m) < off_m))


def _has_room(walls: SegmentMap, node_xy_m: FloatArray, clear_m: float) -> bool:
    """Whether anywhere around a node of the lattice walls are so far away."""
    steps = np.linspace(-0.5 * LATTICE_M, 0.5 * LATTICE_M, 6)
    return any(
        walls.distance_m(float(node_xy_m[0] + dx), float(node_xy_m[1] + dy)) >= clear_m
        for dx in steps
        for dy in steps
    )


def floor_map_metrics(
    grid: OccupancyGrid, chart: WorldMap, radius_m: float, start: Pose2, spare_m: float = 0.0
) -> dict[str, object]:
    """Share of the reachable floor that is free on the map, and how far its walls are from the true ones.

    The map's frame must be the world's. A wall of the map is an occupied cell; its error is the distance of
    its middle from the nearest wall, so that half a cell's side of it are the grid's own.
    """
    floor = reachable_floor(chart, radius_m, start, spare_m)
    metrics: dict[str, object] = {}
    if len(floor):
        cells = grid.cells_at(floor)
        inside = ((cells >= 0) & (cells < [grid.rows, grid.columns])).all(axis=1)
        free = np.zeros(len(floor), np.bool_)
        free[inside] = grid.cells[cells[inside, 0], cells[inside, 1]] == FREE
        metrics["floor_mapped"] = float(free.mean())
        metrics["floor_area_m2"] = len(floor) * LATTICE_M**2
    walls = np.argwhere(grid.cells == OCCUPIED)
    if len(walls):
        off = _from_walls_m(grid.centres_m(walls), chart.walls, grid.resolution_m)
        metrics["wall_rms_m"] = float(np.sqrt((off**2).mean()))
        metrics["wall_max_m"] = float(off.max())
    return metrics


def _from_walls_m(points_m: FloatArray, walls: SegmentMap, spacing_m: float) -> FloatArray:
    """Distance (N,) of points (N, 2) that lie on a lattice of a spacing from the nearest wall.

    The nearest is looked up at the points themselves: at nodes anywhere else both sides of a wall of one or
    two cells may be as near, and a cell on the one side be measured to the other.
    """
    low, high = points_m.min(axis=0), points_m.max(axis=0) + spacing_m
    bounds_m = float(low[0]), float(low[1]), float(high[0]), float(high[1])
    around = SegmentMap(walls.segments_m, walls.circles_m, bounds_m)
    return NearestObstacles.from_map(around, spacing_m).at(points_m)
