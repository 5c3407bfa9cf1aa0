"""Small floors with passages that have room for one."""

from __future__ import annotations

import numpy as np

from pilotage.maps.floor import Floor
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.passages import Passages

RADIUS_M = 0.3


def walled(width_m: float, height_m: float, *walls: tuple[float, float, float, float]) -> WorldMap:
    edge = [(0, 0, width_m, 0), (width_m, 0, width_m, height_m), (width_m, height_m, 0, height_m)]
    segments = np.array([*edge, (0, height_m, 0, 0), *walls], dtype=float)
    geometry = SegmentMap(segments, np.zeros((0, 3)), (0.0, 0.0, width_m, height_m))
    return WorldMap("walled", geometry.bounds_m, geometry=geometry)


def row(world: WorldMap, *places: tuple[float, float]) -> tuple[PatrolGraph, Passages]:
    """Places one after the other, joined to the next."""
    floor, count = Floor.of(world, RADIUS_M), len(places)
    joined = np.abs(np.subtract.outer(np.arange(count), np.arange(count))) == 1
    xy = np.array(places)
    graph = PatrolGraph.of(xy, floor.lengths_m(xy, joined))
    return graph, Passages.of(floor, graph, RADIUS_M)


def with_door(width_m: float) -> WorldMap:
    """Two rooms of 4 m x 5 m with a door."""
    half_m = 0.5 * width_m
    return walled(8, 5, (4, 0, 4, 2.5 - half_m), (4, 2.5 + half_m, 4, 5))


def with_corridor() -> WorldMap:
    """A corridor of 6 m with room for one between two rooms."""
    low, high = 2.05, 2.95
    walls = [(4, 0, 4, low), (4, high, 4, 5), (10, 0, 10, low), (10, high, 10, 5)]
    return walled(14, 5, *walls, (4, low, 10, low), (4, high, 10, high))


def on_floor(
    world: WorldMap, places: list[tuple[float, float]], edges: list[tuple[int, int]]
) -> tuple[PatrolGraph, Passages]:
    """Places joined as told."""
    floor, xy = Floor.of(world, RADIUS_M), np.array(places)
    joined = np.zeros((len(xy), len(xy)), dtype=np.bool_)
    for a, b in edges:
        joined[a, b] = joined[b, a] = True
    graph = PatrolGraph.of(xy, floor.lengths_m(xy, joined))
    return graph, Passages.of(floor, graph, RADIUS_M)


def two_doors() -> tuple[PatrolGraph, Passages]:
    """Two rooms with two doors: in by the one, out by the other."""
    walls = [(4.0, 0.0, 4.0, 1.0), (4.0, 2.0, 4.0, 6.0), (4.0, 7.0, 4.0, 8.0)]
    places = [(2.0, 1.5), (6.0, 1.5), (6.0, 6.5), (2.0, 6.5)]
    return on_floor(walled(8, 8, *walls), places, [(0, 1), (1, 2), (2, 3), (3, 0)])
