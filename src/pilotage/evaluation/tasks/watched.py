"""What most tasks have in common: over at the first collision, or when nobody is under way any more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

from pilotage.core.types import Event
from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.evaluation.tasks.contacts import contact_words
from pilotage.evaluation.tasks.task import Attempt, all_ended
from pilotage.evaluation.tasks.team import verdict
from pilotage.missions.places import GoalConfig


class WatchedTask:
    """A task that leaves it to the robots when they are done; whoever is one says how to judge each robot."""

    columns: Mapping[str, str]
    goals: tuple[GoalConfig, ...]
    drives: ClassVar[bool] = True

    def __init__(self, goals: tuple[GoalConfig, ...] = ()) -> None:
        self.columns, self.goals = {}, goals
        self.events: list[Event] = []

    def step(self, t_s: float, attempts: Sequence[Attempt]) -> str | None:
        """Over at the first collision, or when nobody is under way any more."""
        touched = [attempt.body for attempt in attempts if attempt.body.collisions]
        if not touched:
            return "" if all_ended(attempts) else None
        names = [body.name for body in touched] if len(attempts) > 1 else [""]
        self.events += [
            Event(t_s, "collision", f"{name}: {contact_words(body.touched)}".removeprefix(": "))
            for name, body in zip(names, touched, strict=True)
        ]
        whose = f"of {' and '.join(names)} " if len(attempts) > 1 else ""
        # Two that ran into each other are both named already.
        told = {f"robot {name}" for name in names}
        others = dict.fromkeys(what for body in touched for what in body.touched if what not in told)
        what = f" with {' and '.join(others)}" if others else ""
        pose = touched[0].pose
        return f"collision {whose}at ({pose.x_m:.2f}, {pose.y_m:.2f}){what} after {t_s:.1f} s"

    def row(self, index: int) -> tuple[float, ...]:  # noqa: ARG002
        """Nothing beyond what every trace has."""
        return ()

    def progress(self, attempts: Sequence[Attempt]) -> tuple[tuple[str, str], ...]:  # noqa: ARG002
        """Nothing beyond what every progress line has."""
        return ()

    def judge(self, run: FinishedRun) -> Verdict:
        """The team's metrics from those of its robots."""
        return verdict([self.judge_robot(run, robot) for robot in run.robots], run)

    def judge_robot(self, run: FinishedRun, robot: RobotRun) -> Verdict:
        """One robot's metrics, ``success`` and ``reason`` among them."""
        raise NotImplementedError
