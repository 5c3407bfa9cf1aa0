"""Unexpected obstacles: fixed ones, and those that the seed puts across the planned path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Goal, Pose2
from pilotage.kernels.geometry import plane
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.segment_map import SegmentMap, box_segments
from pilotage.missions.world import (
    AcrossPathObstacle,
    BoxObstacle,
    CircleObstacle,
    Obstacle,
    TrapObstacle,
)

MAX_DRAWS = 2000
MOST_SAMPLED = 100_000_000
"""Nodes of all draws together at which a way around is looked for: of a large map there are fewer draws."""
ENDS_CLEAR_M = 2.5
"""An obstacle drawn by the seed keeps this far from start and goal."""
HEAD_ON_M = 0.2
"""A plan that leads straight in keeps the body this far from the sides, from a metre before the mouth on."""
BEFORE_MOUTH_M = 1.0
PASSAGE_M = 0.5
"""A way around must remain at this clearance."""


@dataclass(frozen=True, slots=True)
class Obstacles:
    """Geometry of all unexpected obstacles.

    Attributes
    ----------
    segments_m, circles_m
        (K, 4) and (L, 3).
    polygons_m
        One (4, 2) outline a box, for pictures.
    pockets_m
        One (4, 2) outline for the inside of each trap.
    """

    segments_m: FloatArray
    circles_m: FloatArray
    polygons_m: list[FloatArray]
    pockets_m: list[FloatArray]

    @classmethod
    def none(cls) -> Obstacles:
        """Nothing stands there."""
        return cls(np.zeros((0, 4)), np.zeros((0, 3)), [], [])

    @classmethod
    def fixed(cls, obstacles: Sequence[Obstacle]) -> Obstacles:
        """Those whose places a mission says.

        Raises
        ------
        InputError
            Where a box has no length.
        """
        placed = cls.none()
        for index, obstacle in enumerate(obstacles):
            placed = _with_fixed(placed, obstacle, f"world.obstacles.{index}")
        return placed

    def room_m(self, x_m: float, y_m: float) -> float:
        """Distance from a place to the nearest of them; none inside one."""
        for polygon in self.polygons_m:
            side, to_it = np.roll(polygon, -1, axis=0) - polygon, np.array([x_m, y_m]) - polygon
            beyond = side[:, 0] * to_it[:, 1] - side[:, 1] * to_it[:, 0]
            if (beyond >= 0.0).all() or (beyond <= 0.0).all():
                return 0.0
        return float(plane.distance_to_nearest(x_m, y_m, self.segments_m, self.circles_m))


def place_obstacles(
    obstacles: Sequence[Obstacle],
    world: SegmentMap,
    start: Pose2,
    goal: Goal | None,
    planned: FloatArray | None,
    body_radius_m: float,
    rng: np.random.Generator,
) -> Obstacles:
    """Place every obstacle of a mission.

    Parameters
    ----------
    planned
        (N, 3) states of the path that the robot has planned; None where it has none.

    Raises
    ------
    InputError
        If a fixed obstacle stands on the start, or no place is found for one that the seed draws.
    """
    placed = Obstacles.none()
    for index, obstacle in enumerate(obstacles):
        where = f"world.obstacles.{index}"
        if isinstance(obstacle, CircleObstacle | BoxObstacle):
            placed = _with_fixed(placed, obstacle, where)
        elif planned is not None and planned.shape[0] > 1:
            drawn = _draw_across(obstacle, world, placed, start, goal, planned, body_radius_m, rng, where)
            placed = _with(placed, *drawn)
        if placed.room_m(start.x_m, start.y_m) < body_radius_m:
            raise InputError(f"{where}: expected the start to be free, found the obstacle standing on it")
    return placed


def _with_fixed(placed: Obstacles, obstacle: Obstacle, where: str) -> Obstacles:
    """With one more, where its place is said."""
    if isinstance(obstacle, CircleObstacle):
        return _with(placed, circle=np.array([[*obstacle.centre_m, obstacle.radius_m]]))
    return _with(placed, [_box_between(obstacle, where)]) if isinstance(obstacle, BoxObstacle) else placed


def _with(
    placed: Obstacles,
    boxes: Sequence[FloatArray] = (),
    pockets: Sequence[FloatArray] = (),
    circle: FloatArray | None = None,
) -> Obstacles:
    return Obstacles(
        np.concatenate([placed.segments_m, *boxes]),
        placed.circles_m if circle is None else np.concatenate([placed.circles_m, circle]),
        [*placed.polygons_m, *(box[:, :2] for box in boxes)],
        [*placed.pockets_m, *pockets],
    )


def _box_between(obstacle: BoxObstacle, where: str) -> FloatArray:
    """A box whose middle line runs between the two given points."""
    (x0, y0), (x1, y1) = obstacle.from_m, obstacle.to_m
    length = math.hypot(x1 - x0, y1 - y0)
    if length == 0.0:
        raise InputError(f"{where}: expected two different ends, found the same point twice")
    return box_segments(
        (x0 + x1) / 2, (y0 + y1) / 2, length, obstacle.thickness_m, math.atan2(y1 - y0, x1 - x0)
    )


def _draw_across(
    obstacle: AcrossPathObstacle | TrapObstacle,
    world: SegmentMap,
    placed: Obstacles,
    start: Pose2,
    goal: Goal | None,
    planned: FloatArray,
    body_radius_m: float,
    rng: np.random.Generator,
    where: str,
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Boxes and pockets at the first place drawn along the path that is free and leaves a way around."""
    before = world.with_obstacles(placed.segments_m, placed.circles_m)
    draws = sampled = 0
    while draws < MAX_DRAWS and sampled <= MOST_SAMPLED:
        draws += 1
        index = int(rng.uniform(*obstacle.along) * (planned.shape[0] - 1))
        x, y, theta = planned[index]
        pockets: list[FloatArray] = []
        if isinstance(obstacle, TrapObstacle):
            boxes, pocket = _trap(obstacle, x, y, theta, rng)
            pockets = [pocket]
            if obstacle.head_on and not _leads_in(planned[: index + 1], pocket, body_radius_m):
                continue
        else:
            length = rng.uniform(*obstacle.length_m)
            # The box's own middle is a little off the path, so that either side may be the nearer one.
            off = rng.uniform(-0.25, 0.25) * length
            boxes = [
                box_segments(
                    x - off * math.sin(theta),
                    y + off * math.cos(theta),
                    length,
                    obstacle.thickness_m,
                    theta + math.pi / 2,
                )
            ]
        sides = np.concatenate(boxes)
        ends = [(start.x_m, start.y_m)] + ([] if goal is None else [(goal.x_m, goal.y_m)])
        if any(_distance_to_hull(px, py, sides) < ENDS_CLEAR_M for px, py in ends):
            continue
        if not _free_of_walls(sides, before):
            continue
        if goal is None:
            return boxes, pockets
        field = DistanceField.from_map(before.with_obstacles(sides, np.zeros((0, 3))))
        if _passable(field, start, goal):
            return boxes, pockets
        sampled += field.distance_m.size
    raise InputError(
        f"{where}: expected room for a {obstacle.kind} across the planned path with a way around it, "
        f"found none in {draws} draws; make it smaller"
    )


def _trap(
    obstacle: TrapObstacle, x: float, y: float, theta: float, rng: np.random.Generator
) -> tuple[list[FloatArray], FloatArray]:
    """Three boxes, a back across the path at (x, y) and two sides towards the robot; and their inside."""
    width, depth = rng.uniform(*obstacle.width_m), rng.uniform(*obstacle.depth_m)
    thick = obstacle.thickness_m
    c, s = math.cos(theta), math.sin(theta)
    # In the path's frame: the back's inner face at 0, the sides reach to -depth; inside width x depth.
    back = box_segments(x + c * thick / 2, y + s * thick / 2, width + 2 * thick, thick, theta + math.pi / 2)
    boxes = [back]
    for side in (1.0, -1.0):
        along, across = -depth / 2, side * (width + thick) / 2
        boxes.append(
            box_segments(x + c * along - s * across, y + s * along + c * across, depth, thick, theta)
        )
    return boxes, box_segments(x - c * depth / 2, y - s * depth / 2, depth, width, theta)[:, :2]


def _leads_in(before: FloatArray, pocket: FloatArray, body_radius_m: float) -> bool:
    """Whether a path (N, 3) that ends at a trap's back comes straight in between its sides."""
    middle, theta = pocket.mean(axis=0), before[-1, 2]
    axis = np.array([math.cos(theta), math.sin(theta)])
    away = before[:, :2] - middle
    along, across = away @ axis, away @ np.array([-axis[1], axis[0]])
    corners = pocket - middle
    depth, width = np.ptp(corners @ axis), np.ptp(corners @ np.array([-axis[1], axis[0]]))
    outside = np.flatnonzero(along < -depth / 2 - BEFORE_MOUTH_M)
    if outside.size == 0:
        return False
    return bool(np.abs(across[outside[-1] :]).max() < width / 2 - body_radius_m - HEAD_ON_M)


def _distance_to_hull(x: float, y: float, sides: FloatArray) -> float:
    """Distance to the nearest corner or side of an obstacle (its inside counts by its sides)."""
    return float(plane.distance_to_nearest(x, y, sides, plane.NO_CIRCLES))


def _free_of_walls(sides: FloatArray, world: SegmentMap) -> bool:
    """Whether the rectangle around the obstacle, in its own frame, meets no wall."""
    points = np.concatenate([sides[:, :2], sides[:, 2:]])
    axis = sides[0, 2:] - sides[0, :2]
    axis = axis / np.hypot(*axis)
    frame = np.column_stack([axis, [-axis[1], axis[0]]])
    local = points @ frame
    low, high = local.min(axis=0), local.max(axis=0)
    corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    hull = corners @ frame.T
    xmin, ymin, xmax, ymax = world.bounds_m
    # First, since it bounds the walk: one of a kilometre has thousands of millions of points.
    if not ((hull >= [xmin, ymin]).all() and (hull <= [xmax, ymax]).all()):
        return False
    # Walk over the rectangle finely enough that no wall slips between the points.
    steps = np.ceil((high - low) / 0.1).astype(int) + 1
    grid = np.stack(
        np.meshgrid(np.linspace(low[0], high[0], steps[0]), np.linspace(low[1], high[1], steps[1])), axis=-1
    ).reshape(-1, 2)
    least = plane.least_distance(np.ascontiguousarray(grid @ frame.T), world.segments_m, world.circles_m)
    return bool(least > 0.1)


def _passable(field: DistanceField, start: Pose2, goal: Goal) -> bool:
    """Whether start and goal are connected for a disc of radius ``PASSAGE_M``."""
    labels, _ = scipy.ndimage.label(field.distance_m >= PASSAGE_M)
    x0, y0 = field.origin_xy_m

    def label(x: float, y: float) -> int:
        row = round((y - y0) / field.resolution_m)
        col = round((x - x0) / field.resolution_m)
        return int(labels[row, col])

    first = label(start.x_m, start.y_m)
    return first != 0 and first == label(goal.x_m, goal.y_m)
