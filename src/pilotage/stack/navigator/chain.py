"""One navigator after another, each to the next goal: a mission of several legs."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

from pydantic import Field, field_validator

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import Command
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import NAVIGATORS, Belief, BeliefStatus, Stack, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.navigator import Parts, localizer_of

COLUMNS = {"leg": "1", "distance_to_go_m": "m", "ref_x_m": "m", "ref_y_m": "m", "ref_theta_rad": "rad"}
"""Told of every leg; nan where a leg's navigator tells nothing of the kind."""


class ChainConfig(Config):
    """The legs' navigators by name, each with its own parameters."""

    legs: tuple[dict[str, Any], ...] = Field(min_length=1)

    @field_validator("legs", mode="before")
    @classmethod
    def _bare_names(cls, legs: Any) -> Any:
        """A bare name stands for the navigator with its defaults."""
        if not isinstance(legs, list | tuple):
            return legs
        return tuple({"name": leg} if isinstance(leg, str) else leg for leg in legs)


@dataclass(slots=True)
class _Leg:
    """The navigator under way, what it alone writes, and how much of that was handed on.

    It reads its own plans and counts again, so they stay with it.
    """

    stack: Stack
    journal: Journal
    events: int = 0
    plans: int = 0
    counted: dict[str, int] = field(default_factory=dict)


@NAVIGATORS.add("chain", ChainConfig)
class ChainNavigator:
    """Drives leg by leg: to ``world.goal`` by the first navigator, on to each of ``task.goals`` by the next.

    A leg begins where the robot believes that the last one ended, with one localizer for all; what a leg has
    to plan it plans then. Every leg is built once before the start, each from the goal before, so that what
    cannot be is refused at once. Fails where a leg fails.
    """

    def __init__(
        self,
        config: ChainConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: Parts,
        journal: Journal,
    ) -> None:
        if len(config.legs) != len(task.goals):
            raise InputError(
                f"navigator 'chain': expected a leg for each goal (world.goal and task.goals), found "
                f"{len(config.legs)} legs for {len(task.goals)} goals"
            )
        self._localizer = localizer_of(parts, "chain")
        self._config, self._robot, self._chart, self._task, self._parts = config, robot, chart, task, parts
        self._journal, self._at = journal, 0
        for number in range(1, len(config.legs)):
            goal = task.goals[number - 1]
            if goal.theta_rad is None:
                continue  # it is not known how the robot will stand there
            pose = replace(task.initial.pose, x_m=goal.x_m, y_m=goal.y_m, theta_rad=goal.theta_rad)
            self._built(number, replace(task.initial, pose=pose, status=BeliefStatus.LOCALIZED))
        self._channel = journal.channel(COLUMNS)
        self._leg = self._begin(0, 0.0)

    def _built(self, number: int, initial: Belief) -> _Leg:
        """One leg, from where the robot believes to stand."""
        choice = dict(self._config.legs[number])
        name = choice.pop("name", None)
        where = f"stack.navigator.legs.{number}"
        if not isinstance(name, str):
            raise InputError(f"{where}: expected the name of a navigator, found {name!r}")
        if name == "chain":
            raise InputError(f"{where}: expected a navigator of one leg, found 'chain'")
        task = replace(self._task, initial=initial, goals=(self._task.goals[number],))
        own = Journal()
        leg = NAVIGATORS.entry(name).factory(
            NAVIGATORS.configure(name, choice, where),
            self._robot,
            self._chart,
            task,
            self._parts,
            own,
        )
        return _Leg(leg, own)

    def _begin(self, number: int, t_s: float) -> _Leg:
        """Set out on a leg; what it said while it planned was said now."""
        initial = self._task.initial if number == 0 else self._localizer.belief
        leg = self._built(number, initial)
        leg.journal.plans[:] = [replace(plan, t_s=t_s) for plan in leg.journal.plans]
        leg.journal.events[:] = [replace(event, t_s=t_s) for event in leg.journal.events]
        self._journal.planning_time_s += leg.journal.planning_time_s
        for name in leg.journal.results():
            self._journal.result(name, lambda name=name: leg.journal.results()[name])  # type: ignore[misc]
        self._tell(leg)
        return leg

    def _tell(self, leg: _Leg) -> None:
        """Hand on what a leg said since the last step."""
        journal = leg.journal
        self._journal.events += journal.events[leg.events :]
        self._journal.plans += journal.plans[leg.plans :]
        leg.events, leg.plans = len(journal.events), len(journal.plans)
        for name, count in journal.counts.items():
            more = count - leg.counted.get(name, 0)
            self._journal.counts[name] = self._journal.counts.get(name, 0) + more
        leg.counted = dict(journal.counts)
        told = dict(zip(journal.units, journal.row, strict=True))
        values = (told.get(name, math.nan) for name in list(COLUMNS)[1:])
        self._channel.tell(float(self._at), *values)

    @property
    def belief(self) -> Belief:
        """The localizer's belief."""
        return self._localizer.belief

    @property
    def status(self) -> tuple[StackStatus, str]:
        """Arrived at the end of the last leg; failed where one failed."""
        status, reason = self._leg.stack.status
        if status is StackStatus.FAILED:
            return status, f"leg {self._at + 1}: {reason}"
        last = self._at == len(self._config.legs) - 1
        return (status, reason) if last else (StackStatus.RUNNING, "")

    def step(self, readings: Readings) -> Command:
        """Drive on, or set out on the next leg."""
        command = self._leg.stack.step(readings)
        if self._leg.stack.status[0] is StackStatus.ARRIVED and self._at < len(self._config.legs) - 1:
            self._tell(self._leg)
            self._at += 1
            self._leg = self._begin(self._at, readings.t_s)
        else:
            self._tell(self._leg)
        return command
