"""Clear of what the last word stops before, where a controller asks for the same again and again."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pilotage.core.types import STOP, FloatArray, Twist
from pilotage.kernels.control.closing_in import movers_clearance
from pilotage.sensors.lidar import LidarConfig
from pilotage.stack.control.last_word import LastWord
from pilotage.stack.control.shunting import looks_back
from pilotage.stack.knowledge import RobotKnowledge

PATIENCE_S = 2.0
"""What walks goes by itself: so long it stands."""
STEP_S, SPEED_M_S, TURN_RAD_S = 1.0, 0.15, 0.8
"""A step takes so long, and is no faster."""
LOSES_M = 0.002
"""Between two walls no step gains distance, and it may be elsewhere that it can turn: none may lose more."""


def _anything(step: Twist) -> bool:  # noqa: ARG001 - whichever it is
    return True


class StepClear:
    """Steps away from what the lasers show where a command was refused for a while.

    A local controller sees a gap by its own picture of it: what leads through there may come nearer to a post
    than the last word lets anything pass. It does not know of that, and from the same place asks for the same
    for ever. From some way off it finds another way in, or gives the gap up.

    Who rolls asks for something else in the next step, and with weak brakes it takes long to make good for a
    stop of one step: it goes on no faster than it rolls, turning as far as may be, where that has room.

    Backs only where some laser looks. Where no step leads clear the robot stands.
    """

    def __init__(self, robot: RobotKnowledge, last_word: LastWord) -> None:
        self._last_word, self._footprint = last_word, robot.footprint
        speed = min(SPEED_M_S, robot.motion.top_speed_m_s)
        turn, radius_m = TURN_RAD_S, robot.motion.least_turning_radius_m
        turn = min(turn, robot.motion.top_turn_rate_rad_s, speed / radius_m if radius_m > 0.0 else turn)
        sees_behind = any(looks_back(sheet) for sheet in robot.sensors_of(LidarConfig).values())
        speeds = (speed, -speed) if sees_behind else (speed,)
        self._steps = [Twist(v, share * turn) for v in speeds for share in (0.0, 0.5, -0.5, 1.0, -1.0)]
        self._step, self._until_s = STOP, -math.inf

    def instead_of(self, command: Twist, t_s: float, may: Callable[[Twist], bool] = _anything) -> Twist:
        """The command if it may leave; else the same no faster, after a while a step clear, else a stop.

        ``may`` says what else a step has to leave room for.
        """
        if t_s < self._until_s and self._may(self._step, may):
            return self._step
        self._until_s = -math.inf
        if self._last_word.allows(command):
            return command
        for slower in self._last_word.no_faster(command):
            if self._may(slower, may):
                return slower
        if self._last_word.held_s < PATIENCE_S:
            return STOP
        step = self.found(may)
        if step is None:
            return STOP
        self._until_s = t_s + STEP_S
        return step

    def found(self, may: Callable[[Twist], bool] = _anything) -> Twist | None:
        """The step for ``STEP_S`` that leads clear of what was refused last; None where none does.

        Of steps that gain as much the one that goes on as the last one did.
        """
        shown_m, last = self._last_word.shown_m, self._step
        now_m = self._away_m(STOP, shown_m)
        gains_m = {
            step: self._away_m(step, shown_m) - now_m + LOSES_M * (step == last) for step in self._steps
        }
        for step in sorted(gains_m, key=lambda step: -gains_m[step]):
            if gains_m[step] < -LOSES_M:
                break
            if self._may(step, may):
                self._step = step
                return step
        return None

    def _may(self, step: Twist, may: Callable[[Twist], bool]) -> bool:
        return may(step) and self._last_word.allows(step)

    def _away_m(self, step: Twist, points_m: FloatArray) -> float:
        """Distance from the outline after a step to the nearest of (K, 2) points; negative inside."""
        middle = 0.5 * step.w_rad_s * STEP_S
        x, y = step.v_m_s * STEP_S * math.cos(middle), step.v_m_s * STEP_S * math.sin(middle)
        footprint = self._footprint
        if footprint.is_disc:
            return float(np.hypot(points_m[:, 0] - x, points_m[:, 1] - y).min()) - footprint.radius_m
        discs = np.column_stack([points_m, np.zeros(len(points_m))])
        return movers_clearance(x, y, 2.0 * middle, footprint.points_m, footprint.radius_m, discs, math.inf)
