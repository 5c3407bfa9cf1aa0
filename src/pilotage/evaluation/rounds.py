"""How well one robot made its rounds: which goals it truly came to and when, and how good their order is."""

from __future__ import annotations

import numpy as np

from pilotage.evaluation.driving import poses
from pilotage.evaluation.finished import RobotRun
from pilotage.evaluation.visits import visited_in_order


def visited_steps(robot: RobotRun) -> list[int]:
    """The first step at each of its goals, in its order; shorter where one was missed."""
    places = np.array([(goal.x_m, goal.y_m) for goal in robot.goals])
    truth = poses(robot.trace, "true")
    return visited_in_order(truth[:, :2], places, [goal.tolerance_m for goal in robot.goals])


def rounds_metrics(robot: RobotRun) -> dict[str, object]:
    """Goals visited of those it was to visit, in its order; lengths of the rounds where it chose that."""
    places = np.array([(goal.x_m, goal.y_m) for goal in robot.goals])
    steps = visited_steps(robot)
    at_s: list[float | None] = [float(robot.trace["t_s"][step]) for step in steps]
    metrics: dict[str, object] = {
        "goals_visited": len(steps),
        "goals_given": len(places),
        "goals_m": places.tolist(),
        "goals_reached_at_s": at_s + [None] * (len(places) - len(steps)),
    }
    rounds = robot.rounds
    if rounds is not None:
        metrics |= {
            "rounds_length_m": rounds.length_m,
            "rounds_given_m": rounds.given_m,
            "rounds_bound_m": rounds.bound_m,
            "rounds_gap": rounds.length_m / rounds.bound_m - 1.0 if rounds.bound_m > 0.0 else 0.0,
        }
    return metrics
