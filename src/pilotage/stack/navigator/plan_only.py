"""The navigator that only plans: for studies of planners, in which nobody drives."""

from __future__ import annotations

from collections.abc import Mapping

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import STOP, Event, FloatArray, Twist
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief, ExplainableUpdate, PlannedPath, StackStatus
from pilotage.stack.knowledge import Knowledge
from pilotage.stack.navigator.global_plan import GlobalPlan
from pilotage.stack.navigator.navigator import NAVIGATORS, Parts


class PlanOnlyConfig(Config):
    """Nothing to say: the planner says it all."""


@NAVIGATORS.add("plan-only", PlanOnlyConfig)
class PlanOnlyNavigator:
    """Plans once from the initial belief and is done; the robot stays where it is."""

    counts: Mapping[str, int]

    def __init__(self, config: PlanOnlyConfig, knowledge: Knowledge, parts: Parts) -> None:
        del config
        if knowledge.goal is None or parts.planner is None:
            raise InputError(
                "navigator 'plan-only': expected world.goal and stack.planner, found one missing"
            )
        self._localizer = parts.localizer
        self._plan = GlobalPlan(
            parts.planner,
            parts.smoother,
            knowledge.world_map,
            knowledge.goal,
            knowledge.streams.stream("planner"),
        )
        self._nothing = knowledge.world_map.circles_m[:0]
        self._status, self._reason = StackStatus.RUNNING, ""
        self._events: list[Event] = []
        self.counts = {}

    @property
    def belief(self) -> Belief:
        """The localizer's belief."""
        return self._localizer.belief

    @property
    def last_update(self) -> ExplainableUpdate | None:
        """Nothing is updated."""
        return None

    @property
    def status(self) -> tuple[StackStatus, str]:
        """Arrived where there is a plan."""
        return self._status, self._reason

    @property
    def plans(self) -> list[PlannedPath]:
        """The one plan, where there is one."""
        return self._plan.history

    @property
    def planning_time_s(self) -> float:
        """Wall time spent planning."""
        return self._plan.planning_time_s

    @property
    def mapped_circles_m(self) -> FloatArray:
        """It maps nothing."""
        return self._nothing

    def prepare(self) -> None:
        """Plan."""
        result = self._plan.make(0.0, self.belief.pose, self._nothing, (self._plan.clearance_m,))
        if result.path is None:
            self._status, self._reason = StackStatus.FAILED, f"{result.status}: {result.reason}"
            self._events.append(Event(0.0, "failed", self._reason))
        else:
            plan = self._plan.history[-1]
            self._status, self._reason = StackStatus.ARRIVED, "planned"
            self._events.append(Event(0.0, "plan", f"{plan.length_m:.2f} m, nobody drives it"))

    def step(self, readings: Readings) -> Twist:
        """Stay."""
        self._localizer.step(readings)
        return STOP

    def telemetry(self) -> Mapping[str, float]:
        """What the localizer tells."""
        return self._localizer.telemetry()

    def drain_events(self) -> list[Event]:
        """Events since the last call."""
        events, self._events = self._events, []
        return events
