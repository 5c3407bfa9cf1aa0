"""Where something beside the robot is in the way of its turn: straight to where it can, then turn."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.types import FloatArray, Twist
from pilotage.kernels.control.ground import clearance_m, nearest_m, seen_under
from pilotage.kernels.geometry.motion import wrap
from pilotage.stack.control.local.rolling import Scene

FARTHEST_M = 1.0
STEP_M = 0.05
SLOW_M_S = 0.3
TURN_RAD_S = 1.5
AHEAD_RAD = 0.5
"""With its way no farther off the heading than this a robot plans again."""
AHEAD_M = 0.4
LONGEST_S = 6.0


@dataclass(frozen=True, slots=True)
class TurningRoom:
    """A place straight ahead or behind where a robot can turn on the spot, and since when it drives there."""

    x_m: float
    y_m: float
    begun_s: float
    turns: bool = False

    def step(self, scene: Scene, room_m: float, t_s: float) -> tuple[TurningRoom | None, Twist]:
        """The next command; None for itself when its way lies ahead, or it has taken too long."""
        x, y, theta = (float(value) for value in scene.start[:3])
        off = _off_the_way(scene)
        if t_s - self.begun_s > LONGEST_S or abs(off) < AHEAD_RAD:
            return None, Twist(0.0, 0.0)
        ahead = math.cos(theta) * (self.x_m - x) + math.sin(theta) * (self.y_m - y)
        if not self.turns and abs(ahead) > 0.5 * STEP_M and nearest_m(x, y, scene.ground) < room_m:
            return self, Twist(math.copysign(min(SLOW_M_S, 1.5 * abs(ahead) + 0.05), ahead), 0.0)
        turn = min(max(3.0 * off, -TURN_RAD_S), TURN_RAD_S)
        return replace(self, turns=True), Twist(0.0, turn)


def find_turning_room(scene: Scene, room_m: float, margin_m: float, t_s: float) -> TurningRoom | None:
    """The nearest place straight ahead or behind with ``room_m`` to everything around it.

    None where the way lies ahead already, where the robot can turn where it is, or there is no such place
    that it gets to over seen ground with ``margin_m``, and within a metre.
    """
    x, y, theta = (float(value) for value in scene.start[:3])
    if not lacks_room_to_turn(scene, room_m):
        return None
    c, s = math.cos(theta), math.sin(theta)
    open_ways = [1.0, -1.0] if scene.drive.reverse > 0.0 else [1.0]
    for away in np.arange(STEP_M, FARTHEST_M, STEP_M):
        for way in list(open_ways):
            px, py = x + way * float(away) * c, y + way * float(away) * s
            clear = clearance_m(px, py, theta, scene.body, scene.ground, margin_m) >= margin_m
            if not (clear and _is_seen(scene, px, py, c, s)):
                open_ways.remove(way)
            elif nearest_m(px, py, scene.ground) >= room_m:
                return TurningRoom(px, py, t_s)
    return None


def lacks_room_to_turn(scene: Scene, room_m: float) -> bool:
    """Whether its way does not lie ahead, and something is nearer than ``room_m``."""
    x, y = float(scene.start[0]), float(scene.start[1])
    return abs(_off_the_way(scene)) >= AHEAD_RAD and bool(nearest_m(x, y, scene.ground) < room_m)


def _is_seen(scene: Scene, x: float, y: float, c: float, s: float) -> bool:
    body, ground = scene.body, scene.ground
    seen: bool = seen_under(
        x, y, c, s, body.outer_m, body.discs, ground.unseen_m, ground.x0_m, ground.y0_m, ground.coarse_m,
        ground.per_coarse,
    )  # fmt: skip
    return seen


def _off_the_way(scene: Scene) -> float:
    """Angle from the heading to the way down the time to go; 0 without any."""
    point = point_of_the_way(scene)
    if point is None:
        return 0.0
    x, y, theta = (float(value) for value in scene.start[:3])
    return float(wrap(math.atan2(float(point[1]) - y, float(point[0]) - x) - theta))


def point_of_the_way(scene: Scene) -> FloatArray | None:
    """(2,) the first point down the time to go that is not right at the robot; None without any."""
    path: FloatArray = scene.path
    beyond = np.flatnonzero(np.hypot(path[:, 0] - scene.start[0], path[:, 1] - scene.start[1]) > AHEAD_M)
    return path[int(beyond[0])] if beyond.size else None
