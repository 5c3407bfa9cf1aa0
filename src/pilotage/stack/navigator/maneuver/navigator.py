"""The maneuver navigator's plug: localize, step the state that the robot is in."""

from __future__ import annotations

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import NAVIGATORS, BeliefStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.maneuver.config import ManeuverConfig
from pilotage.stack.navigator.maneuver.context import Context
from pilotage.stack.navigator.maneuver.states import Lost, first_state
from pilotage.stack.navigator.navigator import (
    Parts,
    check_finds_place,
    check_keeps_time,
    goal_and_planner,
    localizer_of,
)
from pilotage.stack.navigator.state import Ended, LocalizingNavigator


@NAVIGATORS.add("maneuver", ManeuverConfig)
class ManeuverNavigator(LocalizingNavigator):
    """Follows a plan with its changes of direction by a speed profile; the plan is made on the true outline.

    A robot that turns on the spot does so at the path's corners, so that it drives the very lines of a sweep.

    It drives no faster than lets it stop, along its path and with its outline, on its own half of the way to
    whatever its laser sees that is on no map: team mates, people, things. Without mates on its floor it gives
    way to who walks, who comes farther than his half. Where that stays in the way it
    plans around it, or backs out of the way that it came. Where it cannot keep up with the plan it plans
    anew; what a path that covers a floor left of it, as far as the robot knows, is driven in the end. Lost,
    it stands, and drives about after a while, a car ahead and back in turn; told nothing of its start it does
    so at once, and plans from where it finds itself.
    """

    def __init__(
        self,
        config: ManeuverConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: Parts,
        journal: Journal,
    ) -> None:
        goal, planner = goal_and_planner(task, parts, "maneuver")
        localizer = localizer_of(parts, "maneuver")
        check_keeps_time(parts, "maneuver")
        self._context = context = Context(config, robot, chart, task, parts, goal, planner, journal)
        if context.plan.takes_long:
            xmin, ymin, xmax, ymax = chart.bounds_m
            corners_m = np.array([(x, y) for x in (xmin, xmax) for y in (ymin, ymax)])
            check_finds_place(localizer, task.initial, corners_m, config.astray_m, "maneuver", "corner")
        super().__init__(localizer, context)
        self._state = first_state(context, self.belief)
        if context.plan.hopeless and context.plan.too_tight:
            remedy = "take rrt-star-dubins, or stack.smoother: shortcut"
            raise InputError(f"navigator 'maneuver': {context.reason}; or {remedy}")

    def step(self, readings: Readings) -> Twist:
        """One control step."""
        belief, state, context = self._localizer.step(readings), self._state, self._context
        context.last_word.take_in(readings)
        if belief.status is BeliefStatus.LOST and not isinstance(state, Lost | Ended):
            state = Lost(context, state, readings.t_s)
        self._state, command = state.step(readings, belief)
        return context.last_word.leaving(command)
