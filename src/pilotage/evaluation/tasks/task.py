"""The role: watches a run, says when it is over, and judges it; and the registry of tasks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol

from pilotage.core.checked import Gives, keeps
from pilotage.core.registry import Registry
from pilotage.core.types import Event
from pilotage.evaluation.finished import FinishedRun, Verdict
from pilotage.evaluation.tasks.given import unfit_ending, unfit_kept, unfit_progress, unfit_row, unfit_verdict
from pilotage.maps.world_map import WorldMap
from pilotage.missions.mission import Mission
from pilotage.missions.places import GoalConfig
from pilotage.models.footprint import Footprint
from pilotage.sim.bodies.body import Body
from pilotage.stack.interface import Stack, StackStatus
from pilotage.stack.journal import Journal


@dataclass(frozen=True, slots=True)
class TaskSetting:
    """What a task is built in.

    Attributes
    ----------
    mission, chart
        The mission, its places drawn, and the world's map.
    footprints
        One a robot.
    """

    mission: Mission
    chart: WorldMap
    footprints: Sequence[Footprint]


@dataclass(frozen=True, slots=True)
class Attempt:
    """One robot at its task: its true body, what runs on it, what it tells."""

    body: Body
    stack: Stack
    journal: Journal


class Task(Protocol):
    """Built as ``cls(config, setting)``; refuses a mission that lacks what it needs.

    Where it has a true ``any_order`` as well, each robot visits the goals in the order that is best by its
    own map, and its own goal last.

    One with places that a team shares out has ``patrol`` besides, a ``PatrolSite``, of which every robot is
    told. One that is about a certain floor has a static method ``about(config)``: a place on it, or None.

    One that judges what a robot hands over in the end has ``wants`` besides, the names of that. One about
    places that a robot is told, goals or those of a patrol, has a true ``gives_places``.
    """

    columns: Mapping[str, str]
    """The task's own columns of the trace with their units, one set a robot."""
    events: list[Event]
    """What happened, as seen from outside; whoever runs the task takes them out."""
    goals: tuple[GoalConfig, ...]
    """Further goals after a robot's own, in order."""
    drives: ClassVar[bool]
    """Whether anybody drives at all."""

    def step(self, t_s: float, attempts: Sequence[Attempt]) -> str | None:
        """Look at every robot after a step; why the run is over, or None. Empty: the robots ended it."""

    def row(self, index: int) -> tuple[float, ...]:
        """The task's numbers of the last step for one robot, in the order of ``columns``."""

    def progress(self, attempts: Sequence[Attempt]) -> tuple[tuple[str, str], ...]:
        """The numbers that tell most while the run goes on: (label, text) each."""

    def judge(self, run: FinishedRun) -> Verdict:
        """The metrics by JSON key, ``success`` and ``reason`` among them, and what else came to light."""


TASKS: Registry[Task] = Registry(
    "task",
    "pilotage.evaluation.tasks",
    gives=(
        keeps("columns with their units, a list of events, a tuple of goals, and drives", unfit_kept),
        Gives("row", "a tuple of numbers, one a column", unfit_row),
        Gives("progress", "a tuple of (label, text) each", unfit_progress),
        Gives("step", "why the run is over, or None", unfit_ending),
        Gives("judge", "a Verdict with success, true or false, and a reason", unfit_verdict),
    ),
)


def all_ended(attempts: Sequence[Attempt]) -> bool:
    """Whether no robot is at it any more."""
    return all(attempt.stack.status[0] is not StackStatus.RUNNING for attempt in attempts)
