"""How a path laid out in time is followed: arcs and lines each by their law, corners settled at."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.stack.control.controller import Controller
from pilotage.stack.control.kanayama import KanayamaConfig, KanayamaController
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.navigator.maneuver.config import ManeuverConfig
from pilotage.stack.navigator.reference import Ends, Reference
from pilotage.stack.navigator.timed_path import laid_out, with_turns

ARCS = KanayamaConfig(along_per_s=1.0, length_m=0.45)
"""Steered axles follow arcs softly."""
LINES = KanayamaConfig(along_per_s=3.0, length_m=0.2)
"""Lines begin at rest, after a turn that leads them astray by little, and may be no longer than this."""
HEADING_PER_S, NEARS_PER_S = 3.0, 3.0
"""A heading error dies out in so much of a second's inverse while it turns on the spot, and what is left of a
line where it stops at its end."""
TURN_ACCELERATION_SHARE = 0.8
"""Of the motion's, as turns on the spot begin and end: what is left is for mending errors."""
THERE_M, FACES_RAD, SETTLES_S = 0.005, 0.02, 1.5
"""It goes on at a corner where it is so near to a line's end, or faces the next line so well, or after so
long: an estimate may be vaguer than that."""


class Tracking:
    """Lays paths out in time, and says which command follows them.

    Attributes
    ----------
    reference
        Where to be by now.
    """

    def __init__(self, config: ManeuverConfig, robot: RobotKnowledge, controller: Controller | None) -> None:
        self._config, self._motion, self._dt_s = config, robot.motion, robot.dt_s
        self._turns = robot.motion.least_turning_radius_m == 0.0
        self._on_arcs: Controller = controller or KanayamaController(config.tracking or ARCS, robot)
        sharper = controller is None and config.tracking is None
        self._on_lines = KanayamaController(LINES, robot) if sharper else self._on_arcs
        self._law, self._has_corners, self._settles_s = self._on_arcs, False, 0.0
        self.reference = Reference(np.zeros((0, 5)), self._dt_s)

    def lay_out(self, states: FloatArray, turning_radius_m: float, heading_rad: float) -> None:
        """Follow (N, 3) states from their first on; with no radius, lines, after a turn to the first."""
        motion, config = self._motion, self._config
        braking = motion.braking_m_s2
        acceleration = config.acceleration_share * (braking if math.isfinite(braking) else 2.0)
        speed = min(config.speed_m_s, motion.top_speed_m_s)
        rate = (config.turn_share if self._turns else 1.0) * motion.top_turn_rate_rad_s
        if turning_radius_m == 0.0:
            turning = TURN_ACCELERATION_SHARE * motion.turn_acceleration_rad_s2
            rows = with_turns(states, heading_rad, rate, speed, acceleration, self._dt_s, turning)
        else:
            wheels, pause_s = motion.curvature_rate_per_m_s, 0.0 if self._turns else config.pause_s
            rows = laid_out(states, speed, acceleration, wheels, pause_s, self._dt_s, rate)
        self.reference = Reference(rows, self._dt_s)
        self._has_corners, self._settles_s = turning_radius_m == 0.0, 0.0
        self._law = self._on_lines if self._has_corners else self._on_arcs
        self._law.reset()

    def settles(self, pose: Pose2) -> bool:
        """Whether it is at a corner, and not yet where a line ends or where the next one leads.

        What it turns away short of a line's end it does not sweep, and is beside the next line; as is who
        sets out on that askew. No line is long enough to make up for it.
        """
        ends = self.reference.ends
        if not self._has_corners or ends is Ends.NEITHER:
            self._settles_s = 0.0
            return False
        if ends is Ends.LINE:
            off = self._short_m(pose) > THERE_M
        else:
            off = abs(wrap_to_pi(float(self.reference.pose()[2]) - pose.theta_rad)) > FACES_RAD
        self._settles_s = self._settles_s + self._dt_s if off else 0.0
        return off and self._settles_s <= SETTLES_S

    def command(self, pose: Pose2, row: FloatArray, *, settles: bool) -> Twist:
        """What leads to where the reference is at the step's end: a row (6,) of it."""
        if self.reference.rate == 0.0:
            return STOP
        if settles and self.reference.ends is Ends.LINE:
            return Twist(NEARS_PER_S * self._short_m(pose), 0.0)
        x, y, theta, v, w, _ = row.tolist()
        if v == 0.0:
            # As in the tracking law the reference is meant for the step's end.
            off_rad = wrap_to_pi(theta - pose.theta_rad - w * self._dt_s)
            return Twist(0.0, w + HEADING_PER_S * off_rad if self._turns else w)
        twist = self._law.step(pose, Pose2(x, y, theta), Twist(v, w)).twist
        # The way back along the path is the other direction's: a piece is driven in its own only.
        return Twist(max(twist.v_m_s, 0.0) if v > 0.0 else min(twist.v_m_s, 0.0), twist.w_rad_s)

    def _short_m(self, pose: Pose2) -> float:
        """How much of a line is left before its end; negative behind it."""
        x, y, theta = self.reference.pose().tolist()
        return float(math.cos(theta) * (x - pose.x_m) + math.sin(theta) * (y - pose.y_m))
