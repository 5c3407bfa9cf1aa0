"""The navigator that only plans: for studies of planners, in which nobody drives."""

from __future__ import annotations

from pilotage.core.config import Config
from pilotage.core.types import STOP, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import NAVIGATORS, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.global_plan import GlobalPlan
from pilotage.stack.navigator.navigator import Parts, goal_and_planner, localizer_of
from pilotage.stack.navigator.state import LocalizingNavigator, Standing


class PlanOnlyConfig(Config):
    """Nothing to say: the planner says it all."""


@NAVIGATORS.add("plan-only", PlanOnlyConfig)
class PlanOnlyNavigator(LocalizingNavigator):
    """Plans once from the initial belief and is done; the robot stays where it is.

    A plan is one that the robot can drive: its outline fits along it, and no corner is too tight.
    """

    def __init__(
        self,
        config: PlanOnlyConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: Parts,
        journal: Journal,
    ) -> None:
        del config
        goal, planner = goal_and_planner(task, parts, "plan-only")
        super().__init__(localizer_of(parts, "plan-only"), Standing(journal))
        rng = robot.streams.stream("planner")
        least_m = robot.footprint.inner_radius_m
        plan = GlobalPlan(planner, parts.smoother, chart, rng, journal, least_m, robot, as_planned=True)
        nothing = chart.walls.circles_m[:0]
        journal.result("mapped_circles_m", lambda: nothing)
        result = plan.make(0.0, self.belief.pose, goal, nothing, (plan.clearance_m,))
        if result.path is None:
            self._standing.end(0.0, StackStatus.FAILED, f"{result.status}: {result.reason}")
        else:
            self._standing.status, self._standing.reason = StackStatus.ARRIVED, "planned"
            journal.say(0.0, "plan", f"{journal.plans[-1].length_m:.2f} m, nobody drives it")

    def step(self, readings: Readings) -> Twist:
        """Stay."""
        self._localizer.step(readings)
        return STOP
