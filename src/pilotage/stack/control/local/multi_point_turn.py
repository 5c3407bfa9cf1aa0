"""Where a robot can neither turn on the spot nor drive straight to where it can: turn in several moves."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.types import FloatArray, Twist
from pilotage.kernels.control.multi_point_turn import multi_point_turn
from pilotage.kernels.geometry.motion import wrap
from pilotage.stack.control.local.rolling import Scene
from pilotage.stack.control.local.turning_room import lacks_room_to_turn, point_of_the_way

SLOW_M_S, TURN_RAD_S = 0.1, 0.6
"""Millimetres from walls that its laser shows to a few of them."""
NEAR_M, STRAIGHT_RAD, AT_REST_RAD_S = 0.004, 0.02, 0.1
GAIN_PER_S = 3.0
LONGEST_S = 40.0


@dataclass(frozen=True, slots=True)
class MultiPointTurn:
    """Turns and straight moves, one after the other, and since when it is at them.

    ``moves``: (N, 3) x, y, theta at the end of each; a turn's place is that of the move before.
    """

    moves: FloatArray
    begun_s: float
    at: int = 0

    def step(self, scene: Scene, t_s: float) -> tuple[MultiPointTurn | None, Twist]:
        """The next command; None for itself when it is done, or has taken too long."""
        if self.at == len(self.moves) or t_s - self.begun_s > LONGEST_S:
            return None, Twist(0.0, 0.0)
        x, y, theta, v, w = (float(value) for value in scene.start)
        to_x, to_y, to_theta = (float(value) for value in self.moves[self.at])
        off = wrap(to_theta - theta)
        turn = min(max(GAIN_PER_S * off, -TURN_RAD_S), TURN_RAD_S)
        ahead = math.cos(to_theta) * (to_x - x) + math.sin(to_theta) * (to_y - y)
        if self._turns:
            there = abs(off) < STRAIGHT_RAD and abs(w) < AT_REST_RAD_S
            command = Twist(0.0, turn)
        else:
            # Past the end it does not come back: the next turn is hardly elsewhere.
            there = ahead * self._way < NEAR_M and abs(v) < SLOW_M_S
            command = Twist(math.copysign(min(SLOW_M_S, 1.5 * abs(ahead) + 0.02), ahead), turn)
        return (replace(self, at=self.at + 1), Twist(0.0, 0.0)) if there else (self, command)

    @property
    def _turns(self) -> bool:
        return self.at > 0 and bool((self.moves[self.at, :2] == self.moves[self.at - 1, :2]).all())

    @property
    def _way(self) -> float:
        """1 for a move ahead, -1 for one back."""
        before, after = self.moves[self.at - 1], self.moves[self.at]
        return math.copysign(1.0, (after[:2] - before[:2]) @ [math.cos(after[2]), math.sin(after[2])])


def find_multi_point_turn(
    scene: Scene, room_m: float, margins_m: tuple[float, ...], behind_m: float, t_s: float
) -> MultiPointTurn | None:
    """The moves towards its way with the widest of these margins that leaves any; None without one.

    Where it backs it keeps ``behind_m``. None as well where its way lies ahead or nothing is nearer than
    ``room_m``: there it is not the room to turn that it lacks. Nor for a robot that may not back, or turn on
    the spot.
    """
    point = point_of_the_way(scene)
    if point is None or not lacks_room_to_turn(scene, room_m):
        return None
    if scene.drive.reverse <= 0.0 or scene.drive.least_radius > 0.0:
        return None
    for margin_m in margins_m:
        poses = multi_point_turn(
            scene.start[:3],
            float(point[0]),
            float(point[1]),
            scene.body,
            scene.ground,
            margin_m,
            max(margin_m, behind_m),
        )
        if len(poses) > 1:
            return MultiPointTurn(_moves(poses), t_s, 1)
    return None


def _moves(poses: FloatArray) -> FloatArray:
    """Poses (N, 3) one step apart as the ends of turns and of straight stretches, the start first."""
    steps = np.diff(poses, axis=0)
    along = np.sign(steps[:, 0] * np.cos(poses[1:, 2]) + steps[:, 1] * np.sin(poses[1:, 2]))
    turned = np.sign([wrap(float(angle)) for angle in steps[:, 2]])
    straight = np.hypot(steps[:, 0], steps[:, 1]) > 0.0
    kind = np.where(straight, 2.0 * along, turned)
    ends = np.flatnonzero(np.append(kind[1:] != kind[:-1], True)) + 1
    return np.vstack([poses[:1], poses[ends]])
