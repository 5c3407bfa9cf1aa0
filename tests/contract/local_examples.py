"""What local controllers and the navigator that drives by them must do: find a door by the laser alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from pilotage.core.types import Goal, Pose2, Twist
from pilotage.stack.control.local.dynamic_window import Dwa, DwaConfig
from pilotage.stack.control.local.role import LocalController
from pilotage.stack.interface import StackStatus
from pilotage.stack.navigator.local import LocalConfig, LocalNavigator
from pilotage.stack.navigator.navigator import Parts
from support import worlds
from support.robots import sensors, told_of

START, GOAL = Pose2(2.0, 2.0, 0.0), Goal(8.0, 6.0)


def drives(navigator: Any, config: Any, controller: LocalController) -> list[Twist]:
    """Through the door between the two halves of the room to the goal, touching nothing; its commands."""
    told = told_of(start=START, goal=GOAL, variances=(1e-8, 1e-8, 1e-8))
    parts = Parts(None, None, None, None, None, None, None, None, controller)
    stack = told.navigator(navigator, config, parts)
    sim, command = worlds.alone(worlds.robot(sensors(), start=START)), Twist(0.0, 0.0)
    commands = []
    for _ in range(600):
        command = stack.step(sim.step(command))
        commands.append(command)
        if stack.status[0] is not StackStatus.RUNNING:
            break
    assert stack.status[0] is StackStatus.ARRIVED
    truth = sim.truth
    assert np.hypot(truth.x_m - GOAL.x_m, truth.y_m - GOAL.y_m) < 0.5
    assert [event.kind for event in told.journal.events] == ["arrived"]
    # It brakes as hard as it can, and stands.
    for _ in range(10):
        before, command = command, stack.step(sim.step(command))
        assert abs(command.v_m_s) <= max(abs(before.v_m_s) - 0.1, 0.0)
    assert command == Twist(0.0, 0.0)
    return commands


def controller_finds_the_door(factory: Any, config: Any) -> None:
    """It arrives, and the same generator gives the same commands."""
    runs = [
        drives(LocalNavigator, LocalConfig(), factory(config, np.random.default_rng(3))) for _ in range(2)
    ]
    assert runs[0] == runs[1]


def navigator_drives_by_the_laser(factory: Any, config: Any) -> None:
    """With a controller that has no chance in it."""
    drives(factory, config, Dwa(DwaConfig(), np.random.default_rng(0)))


LOCAL_EXAMPLES: dict[str, tuple[Callable[[Any, Any], None], frozenset[str]]] = {
    "dwa": (controller_finds_the_door, frozenset()),
    "vfh": (
        controller_finds_the_door,
        frozenset({"low", "high", "target_cost", "heading_cost", "before_cost"}),
    ),
    "teb": (controller_finds_the_door, frozenset({"stiffness", "push"})),
    "mppi": (controller_finds_the_door, frozenset({"near_cost", "reverse_cost", "people_cost"})),
    "pure-pursuit": (controller_finds_the_door, frozenset()),
    "gap-horizon": (
        controller_finds_the_door,
        frozenset({"near_cost", "reverse_cost", "people_cost", "people_std", "brake_trust"}),
    ),
}
"""By controller: what it must do, and which of its floats are pure numbers."""
