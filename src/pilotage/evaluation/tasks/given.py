"""What a task of somebody's keeps and gives, where it is none of a task's."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pilotage.core.misfit import kept, told, unfit_number
from pilotage.evaluation.finished import FinishedRun, Verdict
from pilotage.missions.places import GoalConfig


def unfit_ending(given: object, *_: object) -> str:
    """Why it is neither a reason to end, nor None."""
    return "" if given is None or isinstance(given, str) else told(given)


def unfit_kept(task: object) -> str:
    """Why its columns, events, goals and whether it drives are none."""
    columns, events, goals = (kept(task, name) for name in ("columns", "events", "goals"))
    if not isinstance(columns, Mapping):
        return f"columns {told(columns)}"
    for name, unit in columns.items():
        if not isinstance(name, str) or not isinstance(unit, str):
            return f"columns with {told(name)}: {told(unit)}"
    if not isinstance(events, list):
        return f"events {told(events)}"
    if not isinstance(goals, tuple) or not all(isinstance(goal, GoalConfig) for goal in goals):
        return f"goals {told(goals)}"
    drives = kept(task, "drives")
    return "" if isinstance(drives, bool) else f"drives {told(drives)}"


def unfit_row(given: object, task: object, *_: object) -> str:
    """Why it is no tuple of numbers, one a column."""
    if not isinstance(given, tuple) or len(given) != len(kept(task, "columns")):
        return told(given)
    return next((wrong for x in given if (wrong := unfit_number(x, unlimited=True, untold=True))), "")


def unfit_progress(given: object, *_: object) -> str:
    """Why it is no tuple of labels and texts."""
    if not isinstance(given, tuple):
        return told(given)
    fits = (isinstance(pair, tuple) and [type(text) for text in pair] == [str, str] for pair in given)
    return "" if all(fits) else told(given)


def unfit_verdict(given: object, _: object, run: FinishedRun) -> str:
    """Why the run's records cannot hold it."""
    if not isinstance(given, Verdict):
        return told(given)
    if not isinstance(given.metrics, dict):
        return f"metrics {told(given.metrics)}"
    success, reason = (given.metrics.get(key) for key in ("success", "reason"))
    if not isinstance(success, bool | np.bool_):
        return f"success {told(success)}"
    if not isinstance(reason, str):
        return f"reason {told(reason)}"
    for key, value in given.metrics.items():
        wrong = _unfit_in_json(value) if isinstance(key, str) else f"under {told(key)}"
        if wrong:
            return f"{key} {wrong}"
    return _unfit_columns(given.columns, run)


def _unfit_in_json(value: object) -> str:
    """Why the run's object cannot hold a value; numbers that are none become null there."""
    if value is None or isinstance(value, str | bool | np.bool_):
        return ""
    if isinstance(value, dict):
        pairs = ((key, _unfit_in_json(inner)) for key, inner in value.items())
        return next((f"{key} {wrong}" for key, wrong in pairs if wrong), "")
    if isinstance(value, list | tuple):
        return next((wrong for inner in value if (wrong := _unfit_in_json(inner))), "")
    return unfit_number(value, unlimited=True, untold=True)


def _unfit_columns(columns: object, run: FinishedRun) -> str:
    if not isinstance(columns, tuple) or len(columns) != len(run.robots):
        return f"columns {told(columns)} of {len(run.robots)} robots"
    for robot, own in zip(run.robots, columns, strict=True):
        if not isinstance(own, Mapping):
            return f"columns {told(own)}"
        rows = len(robot.trace["t_s"])
        for name, column in own.items():
            if not isinstance(column, np.ndarray) or column.shape[:1] != (rows,):
                return f"column {name} {told(column)} of {rows} rows"
    return ""
