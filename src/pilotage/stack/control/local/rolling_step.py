"""What controllers on the rolling ground do around a decision: update, arrive, remember the command."""

from __future__ import annotations

from collections.abc import Callable

from pilotage.core.types import STOP, Twist
from pilotage.stack.control.local.role import LocalView
from pilotage.stack.control.local.rolling import RollingGround, Scene

Decide = Callable[[LocalView, Scene], Twist]


def rolling_step(ground: RollingGround, view: LocalView, decide: Decide) -> tuple[Twist, Scene]:
    """Update the ground, decide unless the goal is reached, and tell the ground what was commanded."""
    scene = ground.update(view)
    arrived = scene.distance_m < view.goal_tolerance_m
    command = STOP if arrived or scene.blind else decide(view, scene)
    ground.sent(view.t_s, command)
    return command, scene


def what_it_does(command: Twist, scene: Scene, view: LocalView) -> str:
    """The command in a word."""
    if scene.distance_m < view.goal_tolerance_m:
        return "arrived"
    if command.v_m_s < -0.01:
        return "backing"
    if command.v_m_s > 0.05:
        return "driving"
    return "turning" if abs(command.w_rad_s) > 0.05 else "waiting"
