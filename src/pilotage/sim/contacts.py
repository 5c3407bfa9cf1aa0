"""Who or what a body that ran into something touches, in words."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pilotage.kernels.bodies import clearances
from pilotage.kernels.geometry.plane import NO_CIRCLES, NO_SEGMENTS
from pilotage.kernels.geometry.solids import Fixed
from pilotage.sim.bodies.body import APART_M, Body
from pilotage.sim.people.crowd import Crowd
from pilotage.sim.worlds.grid import GridLayer
from pilotage.sim.worlds.world import World

WALL, OBSTACLE, CELL = "a wall", "an obstacle", "an occupied cell"
"""What stands: on a map of walls, on no map, on a grid."""


def what_is_touched(body: Body, bodies: Sequence[Body], crowd: Crowd | None) -> tuple[str, ...]:
    """All that a body is at when a collision is counted; what is nearest where it has left it already.

    Parameters
    ----------
    crowd
        The people; who walked into the body on his own is not among those told.

    Returns
    -------
    People and robots with their names, then what does not move; empty in a world without anything.
    """
    people = () if crowd is None else crowd.driven_into(body.row)
    gaps_m = {f"robot {other.name}": body.distance_to_m(other) for other in bodies if other is not body}
    gaps_m |= _fixed_m(body)
    near_m = APART_M + body.motion.release_m
    found = (*(f"person {name}" for name in people), *(what for what, m in gaps_m.items() if m < near_m))
    if found or not gaps_m:
        return found
    nearest = min(gaps_m, key=lambda what: gaps_m[what])
    return (nearest,) if math.isfinite(gaps_m[nearest]) else ()


def _fixed_m(body: Body) -> dict[str, float]:
    """Distances from what stands, of each kind."""
    x, y, theta = body.state[:3].tolist()
    return {
        what: float(clearances.fixed_clearance(x, y, theta, body.footprint.outline, solid))
        for what, solid in _layers(body.world)
    }


def _layers(world: World) -> list[tuple[str, Fixed]]:
    none, geometry = GridLayer.none().tiles, world.chart.geometry
    layers: list[tuple[str, Fixed]] = [
        (OBSTACLE, (world.obstacle_segments_m, world.obstacle_circles_m, none)),
        (CELL, (NO_SEGMENTS, NO_CIRCLES, world.grid.tiles)),
    ]
    if geometry is not None:
        layers.append((WALL, (geometry.segments_m, geometry.circles_m, none)))
    return layers
