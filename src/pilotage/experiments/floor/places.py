"""Random poses in a world: drawn from the seed among the places that the body can drive to."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import label

from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap
from pilotage.missions.floor import FloorMission, Kidnap
from pilotage.missions.mission import PoseConfig

GRID_M = 0.1
MAX_DRAWS = 100_000


def settle_places(mission: FloorMission, floor: SegmentMap) -> FloorMission:
    """Return the mission with its random places drawn, so that it can be recorded and run again as it is."""
    world = mission.world
    if world.random_start is None and all(kidnap.to is not None for kidnap in world.kidnaps):
        return mission
    streams = RandomStreams(mission.run.seed)
    start = world.start
    if world.random_start is not None:
        start = random_pose(floor, world.start, world.random_start.clearance_m, streams.stream("start"))
    rng = streams.stream("kidnap")
    kidnaps = tuple(
        kidnap if kidnap.to is not None else _carried(kidnap, floor, world.start, rng)
        for kidnap in world.kidnaps
    )
    settled = world.model_copy(update={"start": start, "random_start": None, "kidnaps": kidnaps})
    return mission.model_copy(update={"world": settled})


def _carried(kidnap: Kidnap, floor: SegmentMap, near: PoseConfig, rng: np.random.Generator) -> Kidnap:
    return kidnap.model_copy(update={"to": random_pose(floor, near, kidnap.clearance_m, rng)})


def random_pose(
    floor: SegmentMap, reachable_from: PoseConfig, clearance_m: float, rng: np.random.Generator
) -> PoseConfig:
    """Draw a pose, uniform over the floor that is connected to a place at a clearance.

    Raises
    ------
    InputError
        Where the place itself has less clearance, or nothing is found.
    """
    field = DistanceField.from_map(floor, GRID_M)
    regions, _ = label(field.distance_m >= clearance_m)
    x0, y0 = field.origin_xy_m
    row, col = round((reachable_from.y_m - y0) / GRID_M), round((reachable_from.x_m - x0) / GRID_M)
    inside = 0 <= row < regions.shape[0] and 0 <= col < regions.shape[1]
    home = int(regions[row, col]) if inside else 0
    if home == 0:
        raise InputError(
            f"world.start: expected {clearance_m:g} m to the nearest wall, from where random places are "
            f"reached, found less at ({reachable_from.x_m:g}, {reachable_from.y_m:g})"
        )
    xmin, ymin, xmax, ymax = floor.bounds_m
    for _ in range(MAX_DRAWS):
        x, y, theta = rng.uniform([xmin, ymin, -math.pi], [xmax, ymax, math.pi])
        if regions[round((y - y0) / GRID_M), round((x - x0) / GRID_M)] != home:
            continue
        if floor.distance_m(x, y) >= clearance_m:
            return PoseConfig(x_m=float(x), y_m=float(y), theta_rad=float(theta))
    raise InputError(f"random place: found none with {clearance_m:g} m of clearance; ask for less")
