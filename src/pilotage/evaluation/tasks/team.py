"""The metrics of a team from those of its robots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.stack.interface import StackStatus

SUMMED = frozenset(
    {
        "alarms",
        "gave_way",
        "charges",
        "collisions",
        "path_length_m",
        "attempts",
        "replans",
        "escapes",
        "waits",
        "people_collisions",
        "people_touches",
    }
)
LEAST = frozenset({"min_clearance_m", "people_closest_m"})
LARGEST = frozenset({"position_max_m", "silently_wrong_s"})


def verdict(each: Sequence[Verdict], run: FinishedRun) -> Verdict:
    """The team's verdict from those of its robots, in their order."""
    columns = tuple(column for one in each for column in one.columns)
    extras = {name: array for one in each for name, array in one.extras.items()}
    return Verdict(combined([one.metrics for one in each], run), columns, extras)


def combined(each: Sequence[dict[str, object]], run: FinishedRun) -> dict[str, object]:
    """One robot's metrics as they are; of several the sums, extremes and means, and each one's own by name.

    A team succeeds if every robot does; the reason is why the run ended where it is one's that did not, else
    that of the first that did not.
    """
    if len(each) == 1:
        return each[0]
    each = [entry | _own_reason(entry, robot, run) for entry, robot in zip(each, run.robots, strict=True)]
    losers = [entry for entry in each if not entry["success"]]
    failed = next((entry for entry in losers if entry["reason"] == run.ending), next(iter(losers), None))
    metrics: dict[str, object] = dict(each[0] if failed is None else failed)
    metrics["success"] = failed is None
    metrics.pop("final_error", None)  # of one robot, and no mean of several says anything
    names = [robot.name for robot in run.robots]
    if failed is not None and failed["reason"] != run.ending:
        metrics["reason"] = f"{names[each.index(failed)]}: {failed['reason']}"
    for key, value in list(metrics.items()):
        values = [entry.get(key) for entry in each]
        if isinstance(value, bool) or not isinstance(value, int | float) or key in ("seed", "steps"):
            continue
        numbers = np.array([x for x in values if isinstance(x, int | float)], dtype=np.float64)
        if key in SUMMED:
            metrics[key] = type(value)(numbers.sum())
        elif key in LEAST or key in LARGEST:
            metrics[key] = float(numbers.min() if key in LEAST else numbers.max())
        else:
            metrics[key] = float(numbers.mean())
    metrics["team_size"] = len(each)
    metrics["robots"] = {name: _own(entry) for name, entry in zip(names, each, strict=True)}
    return metrics


def _own_reason(entry: Mapping[str, object], robot: RobotRun, run: FinishedRun) -> dict[str, object]:
    """Who was done before the run ended, or gave up, has a reason of its own: not what happened to others."""
    done = bool(entry["success"]) and robot.arrived
    if entry["reason"] != run.ending or not (done or robot.status is StackStatus.FAILED):
        return {}
    return {"reason": robot.reason or str(robot.status)}


def _own(entry: Mapping[str, object]) -> dict[str, object]:
    """What is one robot's alone."""
    common = ("mission", "seed", "duration_s", "steps", "steps_per_s")
    return {key: value for key, value in entry.items() if key not in common}
