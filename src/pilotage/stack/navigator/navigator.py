"""The parts that a navigator is put together from."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Goal, Pose2, Twist
from pilotage.stack.control.controller import Controller
from pilotage.stack.control.escape import Escape
from pilotage.stack.control.local.role import LocalController
from pilotage.stack.control.reactive import Reactive
from pilotage.stack.interface import Belief
from pilotage.stack.knowledge import TaskKnowledge
from pilotage.stack.localization.heading_filter import HeadingFilter
from pilotage.stack.localization.localizer import Abilities, Localizer
from pilotage.stack.mapping.mapper import Mapper
from pilotage.stack.patrol.task import PatrolTask
from pilotage.stack.perception.unexplained import UnexplainedReturns
from pilotage.stack.planning.local_planner import LocalPlanner
from pilotage.stack.planning.planner import Planner, Smoother

DISC_HINT = " (for the disc around the robot; navigator maneuver and planner hybrid-astar drive its outline)"
"""Where a disc finds no path, and the body is none."""
AROUND = ", which it knows no way around (navigators maneuver and goal plan one)"
"""Of a robot that plans nothing anew, before what stands in its way."""
SIGMAS = 3.0
"""Of its start, by which who never corrects that may be wrong."""
TURN_GAIN_PER_S, TURN_RATE_RAD_S = 2.0, 0.8
"""Turned on the spot no faster than this, slower towards the end."""


@dataclass(frozen=True, slots=True)
class Parts:
    """The components of a mission's stack, and its share of a patrol; None where the mission does without."""

    localizer: Localizer | None
    planner: Planner | None
    smoother: Smoother | None
    local_planner: LocalPlanner | None
    controller: Controller | None
    reactive: Reactive | None
    mapper: Mapper | None
    escape: Escape | None
    local_controller: LocalController | None = None
    heading: HeadingFilter | None = None
    patrol: PatrolTask | None = None


def missing(needed: Mapping[str, object]) -> str:
    """Which of what is needed, by its key in a mission, is None, as "no world.goal"; else nothing."""
    return " and ".join(f"no {key}" for key, part in needed.items() if part is None)


def arrival_within_m(arrival_m: float | None, goal_tolerance_m: float) -> float:
    """How near the goal a robot has to believe to be: half the goal's tolerance where nothing is said.

    It is never quite where it believes to be: one that stops where its belief comes within the tolerance
    stands outside it in every second run. Nor does it help to say more than the tolerance.
    """
    return min(0.5 * goal_tolerance_m if arrival_m is None else arrival_m, goal_tolerance_m)


def only_goal(task: TaskKnowledge, needed_by: str) -> Goal | None:
    """The goal of a navigator that drives to one, None without; InputError where there are several."""
    if len(task.goals) > 1:
        raise InputError(
            f"navigator '{needed_by}': expected one goal, found {len(task.goals)} (world.goal and the "
            "task's); navigator goal drives to several, navigator chain with a navigator for each"
        )
    return task.goal


def goal_and_planner(task: TaskKnowledge, parts: Parts, needed_by: str) -> tuple[Goal, Planner]:
    """Both, for a navigator that plans to one goal; InputError where the mission has not."""
    goal = only_goal(task, needed_by)
    if goal is None or parts.planner is None:
        absent = missing({"world.goal": goal, "stack.planner": parts.planner})
        raise InputError(f"navigator '{needed_by}': expected world.goal and stack.planner, found {absent}")
    return goal, parts.planner


def turn_at_goal_rad(task: TaskKnowledge, pose: Pose2) -> float:
    """How far to turn for the last goal's heading; 0 within half its tolerance, and where any will do."""
    asked_rad = task.goals[-1].theta_rad
    if asked_rad is None or task.goal_tolerance_rad >= math.pi:
        return 0.0
    off_rad = wrap_to_pi(asked_rad - pose.theta_rad)
    return off_rad if abs(off_rad) > 0.5 * task.goal_tolerance_rad else 0.0


def turned_by(off_rad: float, top_rad_s: float) -> Twist:
    """The command that turns on the spot by so much."""
    most = min(TURN_RATE_RAD_S, top_rad_s)
    return Twist(0.0, min(max(TURN_GAIN_PER_S * off_rad, -most), most))


def localizer_of(parts: Parts, needed_by: str) -> Localizer:
    """The localizer; InputError where the mission has none and no oracle stands in for it."""
    if parts.localizer is None:
        raise InputError(
            f"navigator '{needed_by}': expected stack.localizer, or run.oracles: [localizer], found neither"
        )
    return parts.localizer


def check_finds_place(
    localizer: Localizer, start: Belief, places_m: FloatArray, most_m: float, needed_by: str, what: str
) -> None:
    """Refuse a start so vague that places (P, 2) are missed by more, where no sensor mends it."""
    if Abilities.of(localizer).on_map:
        return
    away_m = float(np.hypot(*(places_m - (start.pose.x_m, start.pose.y_m)).T).max())
    position_m, heading_rad = (SIGMAS * math.sqrt(start.cov.diagonal()[of].max()) for of in ([0, 1], [2]))
    wrong_m = math.hypot(position_m, away_m * heading_rad)
    if wrong_m > most_m:
        raise InputError(
            f"navigator '{needed_by}': expected a localizer that finds its place on the map, found one that "
            f"keeps what it is wrong by at the start, up to {wrong_m:.1f} m at the farthest {what}; take "
            "stack.localizer: laser, or a stack.initial of smaller variances"
        )


def check_keeps_time(parts: Parts, needed_by: str) -> None:
    """InputError for a controller that needs a local plan from the estimate: here the reference runs on."""
    if getattr(parts.controller, "NEEDS_LOCAL_PLAN", False):
        raise InputError(
            f"navigator '{needed_by}': expected a stack.controller that catches up with a moving reference "
            "(kanayama), found one that needs a local plan from where the robot is; take navigator goal"
        )


def check_for_centre(parts: Parts, needed_by: str) -> None:
    """InputError for a planner of outlines: here the robot is the disc around it, driven forwards."""
    if getattr(parts.planner, "FOR_OUTLINE", False):
        raise InputError(
            f"navigator '{needed_by}': expected a stack.planner for the disc around the robot (theta-star, "
            "rrt-star-dubins), found one for its outline, backwards too; take navigator maneuver for it"
        )


def unexplained_of(parts: Parts) -> UnexplainedReturns | None:
    """What the mapper makes of each scan, if it is one that does: nobody has to work it out again."""
    found: UnexplainedReturns | None = getattr(parts.mapper, "unexplained", None)
    return found
