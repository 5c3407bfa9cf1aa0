"""What controllers on the rolling ground do around a decision: update, arrive, remember the command."""

from __future__ import annotations

from pilotage.core.types import STOP, Twist
from pilotage.stack.control.local.fine_goal import approach, is_led, rests_within
from pilotage.stack.control.local.look_around import LookAround
from pilotage.stack.control.local.role import LocalView
from pilotage.stack.control.local.rolling import RollingGround, Scene
from pilotage.stack.control.local.rolling_config import RollingConfig


class RollingController:
    """A local controller on its own rolling ground; what to command there, ``_decide`` says."""

    def __init__(self, ground: RollingConfig, *, foresees: bool = False) -> None:
        self._ground = RollingGround(ground, foresees=foresees)
        self._around = LookAround()
        self.status = "waiting"

    def step(self, view: LocalView) -> Twist:
        """Take the view in and give the next command."""
        scene = self._careful(view, self._ground.update(view))
        led = is_led(scene, view.goal_tolerance_m)
        if led:
            arrived = rests_within(scene, view.goal_tolerance_m)
        else:
            arrived = scene.distance_m < view.goal_tolerance_m
        command: Twist | None = STOP if arrived or scene.blind else None
        if command is None and led:
            command = approach(scene, view.goal_tolerance_m)
        if command is None and not self._is_busy:
            command = self._around.step(view, scene)
        if command is None:
            command = self._decide(view, scene)
        self._ground.sent(view.t_s, command)
        self._look_back(view, scene)
        self.status = "arrived" if arrived else _word_of(command)
        return command

    @property
    def _is_busy(self) -> bool:
        """Whether it is at a manoeuvre of its own that no look around shall interrupt."""
        return False

    def _careful(self, view: LocalView, scene: Scene) -> Scene:  # noqa: ARG002
        """The scene with such limits as the place calls for; most controllers know the robot's own only."""
        return scene

    def _decide(self, view: LocalView, scene: Scene) -> Twist:
        """The command short of the goal, where the laser sees."""
        raise NotImplementedError

    def _look_back(self, view: LocalView, scene: Scene) -> None:
        """What a controller makes of a step that is over; most make nothing of it."""


def _word_of(command: Twist) -> str:
    if command.v_m_s < -0.01:
        return "backing"
    if command.v_m_s > 0.05:
        return "driving"
    return "turning" if abs(command.w_rad_s) > 0.05 else "waiting"
