"""Graphs to patrol, and what strategies on them are told."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from contract.patrol_examples import lattice
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.messages import PatrolMemory
from pilotage.stack.patrol.strategy import STRATEGIES, PatrolSetting, Strategy

GRAPH = lattice(5, 4, 3.0)
SPEED_M_S = 0.5


def builder(name: str, **parameters: float) -> Callable[[PatrolSetting], Strategy]:
    entry = STRATEGIES.entry(name)
    return lambda setting: entry.factory(entry.config(**parameters), setting)


def memory_at(vertex: int, graph: PatrolGraph = GRAPH, team: int = 2) -> PatrolMemory:
    memory = PatrolMemory(len(graph), 0, team, vertex, SPEED_M_S)
    memory.visit(vertex, 10.0)
    return memory


def setting_for(graph: PatrolGraph = GRAPH, starts: tuple[int, ...] = (0, 5)) -> PatrolSetting:
    return PatrolSetting(graph, 0, np.array(starts), SPEED_M_S, np.random.default_rng(0))


def two_rooms() -> PatrolGraph:
    """Of six places each, far from each other."""
    room = lattice(3, 2, 3.0)
    count = len(room)
    edges = np.full((2 * count, 2 * count), np.inf)
    edges[:count, :count] = edges[count:, count:] = room.edges_m
    edges[count - 1, count] = edges[count, count - 1] = 40.0
    places = np.concatenate([room.vertices_xy_m, room.vertices_xy_m + np.array([45.0, 0.0])])
    return PatrolGraph.of(places, edges)


def ring(count: int = 8) -> PatrolGraph:
    """Of places, 3 m from each to the next."""
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    edges = np.full((count, count), np.inf)
    for k in range(count):
        edges[k, (k + 1) % count] = edges[(k + 1) % count, k] = 3.0
    return PatrolGraph.of(0.49 * count * np.column_stack([np.cos(angles), np.sin(angles)]), edges)
