"""The goal navigator's plug: localize, step the state that the robot is in, tell the journal."""

from __future__ import annotations

import math

from pilotage.core.errors import InputError
from pilotage.core.types import Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import NAVIGATORS, BeliefStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.mapping.mapper import Mapper
from pilotage.stack.navigator.global_plan import GlobalPlan
from pilotage.stack.navigator.goal.context import Context
from pilotage.stack.navigator.goal.finding import Lost, first_state, lose
from pilotage.stack.navigator.goal_config import GoalNavigatorConfig
from pilotage.stack.navigator.navigator import Parts, check_for_centre, localizer_of
from pilotage.stack.navigator.own_map import OwnMap
from pilotage.stack.navigator.state import Ended, LocalizingNavigator, State
from pilotage.stack.perception.moving_bodies import MovingBodies

COLUMNS = {
    "ref_x_m": "m",
    "ref_y_m": "m",
    "ref_theta_rad": "rad",
    "w_feedforward_rad_s": "rad/s",
    "w_proportional_rad_s": "rad/s",
    "w_integral_rad_s": "rad/s",
    "w_reactive_rad_s": "rad/s",
    "path_error_m": "m",
    "mode": "1",
    "distance_to_go_m": "m",
}
"""Reference, parts of the command, mode and progress."""


@NAVIGATORS.add("goal", GoalNavigatorConfig)
class GoalNavigator(LocalizingNavigator):
    """Drives to one goal or to several in order (night-watch report, chapter 4: its loop).

    Plans globally before the start; then at every step localizes, maps what is unexpected, follows the
    local plan, and reacts. After an avoidance it replans locally; globally, with the obstacle on the
    robot's own map, where no next waypoint can be reached, the robot is trapped, or it gets no further.
    While its localizer is lost it wanders about by its scanner, maps nothing, and plans once it is found.

    A robot of any shape is planned and guarded for as the disc around it: what fits through a door only
    lengthwise does not try to.
    """

    def __init__(
        self,
        config: GoalNavigatorConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: Parts,
        journal: Journal,
    ) -> None:
        if not task.goals:
            raise InputError("navigator 'goal': expected world.goal, found none")
        if parts.planner is None or parts.local_planner is None or parts.controller is None:
            missing = [
                role for role in ("planner", "local_planner", "controller") if getattr(parts, role) is None
            ]
            raise InputError(
                "navigator 'goal': expected stack.planner, stack.local_planner and stack.controller, "
                f"found no {' and no '.join(f'stack.{role}' for role in missing)}"
            )
        check_for_centre(parts, "goal")
        localizer = localizer_of(parts, "goal")
        self._telemetry = journal.channel(COLUMNS, first=True)
        own_map = OwnMap(chart, parts.mapper)
        journal.result("mapped_circles_m", lambda: own_map.found_circles_m)
        journal.counts |= {"attempts": 0, "replans": 0, "escapes": 0, "waits": 0}
        if len(task.goals) > 1:
            journal.counts["goals"] = 0
        least_m = robot.radius_m + config.guard.margin_m
        rng = robot.streams.stream("planner")
        turns = robot.motion.least_turning_radius_m == 0.0
        plan = GlobalPlan(parts.planner, parts.smoother, chart, rng, journal, least_m, robot, turns)
        self._context = Context(
            config, robot, task, parts, own_map, plan, parts.local_planner, parts.controller, journal
        )
        super().__init__(localizer, self._context)
        self._state: State = first_state(self._context, self.belief)
        self._unseen = MatesUnseen(task.mates, parts.mapper, self._context.bodies, journal)

    def step(self, readings: Readings) -> Twist:
        """One control step."""
        belief, state = self._localizer.step(readings), self._state
        self._context.rest(readings)
        if belief.status is BeliefStatus.LOST and not isinstance(state, (Lost, Ended)):
            state = lose(self._context, state)
        self._state, command = state.step(readings, belief)
        self._unseen.look(readings.t_s)
        self._tell()
        return self._context.leaving(command)

    def _tell(self) -> None:
        context = self._context
        reference, control = context.follower.reference, context.follower.control
        x_m, y_m, theta_rad = (
            (math.nan, math.nan, math.nan)
            if reference is None
            else (reference.x_m, reference.y_m, reference.theta_rad)
        )
        self._telemetry.tell(
            x_m,
            y_m,
            theta_rad,
            context.follower.feedforward.w_rad_s,
            control.proportional_rad_s,
            control.integral_rad_s,
            context.reaction.w_rad_s,
            control.error_m,
            context.mode,
            context.to_go_m,
        )


SCANS = 15
"""Whoever maps has added something after so many of what stands near."""


class MatesUnseen:
    """Says so once: at the start without a mapper, else where one puts nothing of what stands on the map.

    One from outside may map whatever it likes: only what it has not mapped tells of it.

    Parameters
    ----------
    mates
        How many others drive about.
    """

    def __init__(self, mates: int, mapper: Mapper | None, bodies: MovingBodies, journal: Journal) -> None:
        self._others = "another robot drives about" if mates == 1 else f"{mates} others drive about"
        self._mapper, self._bodies, self._journal = mapper, bodies, journal
        self._to_say = mates > 0
        if mapper is None:
            self._say(0.0, "without stack.mapper it goes around nobody")

    def look(self, t_s: float) -> None:
        """Compare what stands near the robot with what the mapper has added, after a step."""
        if not self._to_say or self._mapper is None or self._bodies.shown_scans < SCANS:
            return
        if not len(self._mapper.circles_m):
            what = f"what stands {self._bodies.shown_m:.2f} m away"
            self._say(
                t_s, f"stack.mapper puts nothing on the map of {what}: it goes around nobody who stands"
            )

    def _say(self, t_s: float, why: str) -> None:
        if self._to_say:
            self._journal.say(t_s, "mates-unseen", f"{self._others}, and {why}")
            self._to_say = False
