"""A patrol graph from any map: rooms, doors, and viewpoints from which the whole floor is seen."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy

from pilotage.core.config import Config
from pilotage.core.content import content_of
from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.patrol.cover import greedy_cover
from pilotage.kernels.patrol.visibility import seen_from
from pilotage.maps.floor import ROUNDING_M, Floor
from pilotage.maps.known_maps import OncePerMap
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.patrol.graph import PatrolGraph

BEAMS = 1440
MOST_PAIRS = 30_000_000
"""Of places to look from and points to see: both are thinned beyond."""
MOST_VERTICES = 400
ON_WALL = 0.6
"""Cells: the field of distances is sampled, and never quite 0."""
FAR_M = 8.0
"""As far as a vertex is taken to see by lasers that see farther."""
CLOSE_M, CLOSE_EVERY_M = 1.5, 0.1
"""What is seen from none of the places to look from is looked at from so near, by places so near together."""


class DerivationConfig(Config):
    """How a graph is laid over a floor."""

    reach_m: Positive | None = None
    """As far as a vertex is taken to see: the laser's range, or less for more vertices; None: 8 m, or what is
    left of the range of the team's shortest laser where somebody passes the vertex, if that is less."""
    door_width_m: Positive = 2.0
    """Passages narrower than this between wider places are doors."""
    apart_m: Positive = 1.0
    """A door this near to a viewpoint has no vertex of its own."""
    see_every_m: Positive = 0.25
    stand_every_m: Positive = 0.5
    """Spacing of the points that must be seen, and of those to look from."""
    room_m: NonNegative = 0.1
    """Beyond the largest body, of the places and passages that the graph counts on: more than a navigator's
    margin, so that what is derived can be driven."""

    @property
    def sees_m(self) -> float:
        """How far a vertex is taken to see."""
        return FAR_M if self.reach_m is None else self.reach_m

    def seeing(self, reach_m: float) -> DerivationConfig:
        """The same for who sees so far; what is said of it stands."""
        return self if self.reach_m is not None else self.model_copy(update={"reach_m": min(FAR_M, reach_m)})


@dataclass(frozen=True, slots=True, eq=False)
class Derived:
    """A graph and what it was derived from.

    Attributes
    ----------
    doors_xy_m
        (D, 2) middles of doors.
    rooms
        Number of rooms.
    points_xy_m
        (M, 2) the floor's points, each in view from some vertex within reach.
    viewpoints
        How many of the vertices, the first ones, were chosen for what they see.
    """

    graph: PatrolGraph
    doors_xy_m: FloatArray
    rooms: int
    points_xy_m: FloatArray
    viewpoints: int


_DERIVED: OncePerMap[Derived] = OncePerMap()


def derive_graph(world: WorldMap, floor: Floor, config: DerivationConfig | None = None) -> Derived:
    """Lay a patrol graph over a floor.

    Rooms are what is left of the floor where passages narrower than a door are closed, grown back (Bormann
    et al. 2016, morphological segmentation); doors are where two of them meet. Viewpoints are chosen
    greedily until every point that the robot's body can cover is in view from one within reach; a point that
    no place of the body's sees at all is left out. Edges join vertices whose regions, by length of path,
    touch.

    Raises
    ------
    InputError
        Where the floor needs far too many vertices.
    """
    config = config or DerivationConfig()
    return _DERIVED.get(world, content_of(floor, config), lambda: _derive_graph(world, floor, config))


def _derive_graph(world: WorldMap, floor: Floor, config: DerivationConfig) -> Derived:
    """The same, worked out."""
    least = np.count_nonzero(floor.swept) * floor.cell_m**2 / (math.pi * config.sees_m**2)
    if least > MOST_VERTICES:  # before the work that it would be
        raise _too_many(world, math.ceil(least))
    rooms, doors_xy_m = _rooms_and_doors(floor, config.door_width_m)
    stand, points, sees = views(world, floor, config.sees_m, config.stand_every_m, config.see_every_m)
    covered = np.zeros(len(points), np.bool_)
    # Between places that see as much, the one farther from walls: others pass, and people do.
    rows, columns = floor.cells_of(stand)
    chosen = greedy_cover(sees, floor.clearance_m[rows, columns], covered)
    vertices = stand[chosen]
    # What lies on a wall's line is no floor, though the body's edge can be there.
    rows, columns = floor.cells_of(points)
    covered |= floor.clearance_m[rows, columns] <= ON_WALL * floor.cell_m
    if not covered.all():
        # Corners behind jambs: somebody has to look into them from nearby.
        near = _thinned(_beside(floor, points[~covered]), floor, CLOSE_EVERY_M)
        close = seen_from(floor.middles(near), config.sees_m, points[~covered], BEAMS, *_solid(world))
        few = greedy_cover(close, floor.clearance_m[near], np.zeros(close.shape[1], np.bool_))
        vertices = np.vstack([vertices, floor.middles(near)[few]])
        covered[~covered] = close.any(axis=0)
    viewpoints = len(vertices)
    for door in doors_xy_m:
        if np.hypot(*(vertices - door).T).min() >= config.apart_m:
            vertices = np.vstack([vertices, door])
    if len(vertices) > MOST_VERTICES:
        raise _too_many(world, len(vertices))
    edges = floor.lengths_m(vertices, _touching(floor, vertices), "vertex")
    graph = PatrolGraph.of(vertices, edges, f"patrol graph of '{world.name}'")
    return Derived(graph, doors_xy_m, rooms, points[covered], viewpoints)


def _too_many(world: WorldMap, vertices: float) -> InputError:
    return InputError(
        f"patrol graph of '{world.name}': expected at most {MOST_VERTICES} vertices, found {vertices:g} or "
        "more; take a larger task.derive.reach_m"
    )


def derive_drivable(
    world: WorldMap,
    radius_m: float,
    inside_xy_m: tuple[float, float] | None = None,
    config: DerivationConfig | None = None,
) -> tuple[Floor, Derived]:
    """A floor and its graph, all of whose places a robot comes to that keeps ``room_m`` from walls besides.

    Where one that keeps none comes to more places, those are left out.
    """
    config = config or DerivationConfig()
    floor = Floor.of(world, radius_m, inside_xy_m=inside_xy_m)
    derived = derive_graph(world, floor, config)
    wide_m = radius_m + config.room_m - ROUNDING_M
    roomy = Floor.of(world, wide_m, inside_xy_m=inside_xy_m, between=True)
    # Behind a door that is too narrow the nearest of its cells that are reached may be before the door.
    fits = replace(roomy, reachable=roomy.clearance_m >= roomy.radius_m)
    try:
        if all(roomy.reachable[fits.nearest_cell(place)] for place in derived.graph.vertices_xy_m):
            return floor, derived
    except InputError:  # there is no room for it at the place itself
        pass
    return roomy, derive_graph(world, roomy, config)


def views(
    world: WorldMap, floor: Floor, reach_m: float, stand_every_m: float, see_every_m: float
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Places to look from (P, 2), points to see (M, 2), and which see which (P, M), all around within reach.

    Points are middles of cells that the robot's body can cover, places of cells that its centre can reach;
    both are thinned to a spacing, more where there would be too many.
    """
    # Nothing lies nearer than cells do.
    stand_every_m, see_every_m = max(stand_every_m, floor.cell_m), max(see_every_m, floor.cell_m)
    area_m2 = np.count_nonzero(floor.swept) * floor.cell_m**2
    pairs = area_m2**2 / (stand_every_m * see_every_m) ** 2
    coarser = max(1.0, (pairs / MOST_PAIRS) ** 0.25)
    stand = floor.middles(_thinned(floor.reachable, floor, coarser * stand_every_m))
    points = floor.middles(_thinned(floor.swept, floor, coarser * see_every_m))
    return stand, points, seen_from(stand, reach_m, points, BEAMS, *_solid(world))


def _solid(world: WorldMap) -> tuple[FloatArray, FloatArray]:
    return world.walls.segments_m, world.walls.circles_m


def _beside(floor: Floor, points_xy_m: FloatArray) -> BoolArray:
    """Cells that the body's centre can reach, near some of the points."""
    out = np.zeros_like(floor.reachable)
    reach = math.ceil(CLOSE_M / floor.cell_m)
    for row, column in zip(*floor.cells_of(points_xy_m), strict=True):
        square = (
            slice(max(0, row - reach), row + reach + 1),
            slice(max(0, column - reach), column + reach + 1),
        )
        out[square] = floor.reachable[square]
    return out


def _thinned(cells: BoolArray, floor: Floor, every_m: float) -> BoolArray:
    """One marked cell of each square of a side: the one farthest from walls."""
    side = max(1, round(every_m / floor.cell_m))
    out = np.zeros_like(cells)
    row, column = np.nonzero(cells)
    square = (row // side) * (cells.shape[1] // side + 1) + column // side
    order = np.lexsort((-floor.clearance_m[row, column], square))
    first = np.ones(len(order), np.bool_)
    first[1:] = square[order][1:] != square[order][:-1]
    kept = order[first]
    out[row[kept], column[kept]] = True
    return out


def _rooms_and_doors(floor: Floor, door_width_m: float) -> tuple[int, FloatArray]:
    """How many rooms, and the middles of the doors between them (D, 2)."""
    wide = floor.reachable & (floor.clearance_m >= 0.5 * door_width_m)
    room, count = scipy.ndimage.label(wide)
    if count < 2:
        return 1, np.zeros((0, 2))
    grown = _grown(floor, room.astype(np.int64))
    doors: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for beside in ((0, 1), (1, 0)):
        ahead = np.roll(grown, (-beside[0], -beside[1]), axis=(0, 1))
        inner = np.zeros_like(floor.reachable)
        inner[: grown.shape[0] - beside[0], : grown.shape[1] - beside[1]] = True
        for row, column in np.argwhere(inner & (grown > 0) & (ahead > 0) & (grown != ahead)):
            a, b = sorted((int(grown[row, column]), int(ahead[row, column])))
            doors.setdefault((a, b), []).append((int(row), int(column)))
    middles = []
    for cells in doors.values():
        mark = np.zeros_like(floor.reachable)
        mark[tuple(np.array(cells).T)] = True
        # Two rooms may share several doors.
        pieces, number = scipy.ndimage.label(mark, structure=np.ones((3, 3)))
        for piece in range(1, number + 1):
            where = np.where(pieces == piece, floor.clearance_m, -np.inf)
            best = np.unravel_index(int(np.argmax(where)), where.shape)
            middles.append(floor.middles(_only(mark.shape, best))[0])
    return count, np.array(middles).reshape(-1, 2)


def _only(shape: tuple[int, ...], cell: tuple[np.intp, ...]) -> BoolArray:
    mark = np.zeros(shape, np.bool_)
    mark[cell] = True
    return mark


def _grown(floor: Floor, label: IntArray) -> IntArray:
    """Labels spread over the reachable floor, ring after ring."""
    label = label.copy()
    cross = scipy.ndimage.generate_binary_structure(2, 1)
    while True:
        ring = scipy.ndimage.grey_dilation(label, footprint=cross)
        new = floor.reachable & (label == 0) & (ring > 0)
        if not new.any():
            return label
        label[new] = ring[new]


def _touching(floor: Floor, vertices: FloatArray) -> BoolArray:
    """(V, V) whose regions of nearest cells, by length of path, share a border."""
    cells = floor.regions_of(vertices, "vertex")
    touch = np.zeros((len(vertices), len(vertices)), np.bool_)
    for one, other in ((cells[:, :-1], cells[:, 1:]), (cells[:-1], cells[1:])):
        differ = (one >= 0) & (other >= 0) & (one != other)
        touch[one[differ], other[differ]] = True
    return touch | touch.T
