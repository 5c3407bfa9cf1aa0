"""The answer in one sentence: did it work, how long did it take, how well did the robot know where it was."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pilotage.records.numbers import number
from pilotage.report import quantities


def outcome(metrics: Mapping[str, Any]) -> bool | None:
    """Return whether the task succeeded; None where the run does not say."""
    success = metrics.get("success")
    return success if isinstance(success, bool) else None


def own_metrics(metrics: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Each robot's own metrics by its name; none where there is one robot."""
    told = metrics.get("robots")
    if not isinstance(told, Mapping):
        return {}
    return {str(name): entry for name, entry in told.items() if isinstance(entry, Mapping)}


def succeeded(metrics: Mapping[str, Any]) -> tuple[int, int]:
    """How many robots succeeded, of how many."""
    each = own_metrics(metrics)
    return sum(entry.get("success") is True for entry in each.values()), len(each)


def headline(metrics: Mapping[str, Any]) -> str:
    """Return one sentence with the run's answer and its main numbers, those that there are."""
    if len(own_metrics(metrics)) > 1:
        return _team_headline(metrics)
    success = outcome(metrics)
    duration = number(metrics.get("duration_s"))
    # What was only planned took no time of the world's clock.
    after = f" after {quantities.duration(duration)}" if duration > 0.0 else ""
    if success is None:
        answer = f"Ended{after}"
    elif success and not duration > 0.0 and math.isfinite(number(metrics.get("planned_length_m"))):
        return f"Planned, and nobody drove: {_planned(metrics)}."
    elif success:
        goal = number(metrics.get("goal_error_m"))
        where = "Reached the goal" if math.isfinite(goal) else "Done"
        answer = f"{where}{after}"
        collisions = number(metrics.get("collisions"))
        if collisions == 0.0:
            answer += " without a collision"
        elif collisions > 0.0:
            answer += f" with {quantities.count(collisions)} collision{'s' if collisions > 1 else ''}"
        reason = str(metrics.get("reason") or "").strip().rstrip(".").removeprefix("done: ")
        if where == "Done" and " " in reason:
            answer += f": {reason}"
    else:
        reason = str(metrics.get("reason") or "no reason given").strip().rstrip(".")
        answer = f"Failed{after}: {reason}"
    details = []
    missed = number(metrics.get("goal_error_m"))
    if not success and math.isfinite(missed) and f"{missed:.2f} m" not in answer:
        details.append(f"{quantities.length(missed)} from the goal")
    details += _watched(metrics) + _charted(metrics)
    lost, found = number(metrics.get("lost_s")), number(metrics.get("found_after_s"))
    if lost > 0.0:
        how = "and found itself" if math.isfinite(found) else "and did not find itself"
        details.append(f"lost for {quantities.duration(lost)} {how}")
    rmse, worst = number(metrics.get("position_rmse_m")), number(metrics.get("position_max_m"))
    if math.isfinite(rmse):
        text = f"position known to {quantities.length(rmse)} (RMSE)"
        details.append(text + (f", at worst {quantities.length(worst)} off" if math.isfinite(worst) else ""))
    driven, planned = number(metrics.get("path_length_m")), number(metrics.get("planned_length_m"))
    shortest = number(metrics.get("shortest_length_m"))
    if math.isfinite(driven):
        text = f"{quantities.length(driven)} driven"
        several = number(metrics.get("goals_given"))
        if several > 1.0:
            visited = quantities.count(number(metrics.get("goals_visited")))
            text += f", {visited} of {quantities.count(several)} goals visited"
        elif math.isfinite(planned) and shortest > 0.0:
            text += (
                f" on a plan of {quantities.length(planned)}, "
                f"{quantities.significant(planned / shortest, 4)} times the shortest possible path "
                f"of {quantities.length(shortest)}"
            )
        details.append(text)
    return f"{answer}; {'; '.join(details)}." if details else f"{answer}."


def _team_headline(metrics: Mapping[str, Any]) -> str:
    """The same of several robots."""
    good, count = succeeded(metrics)
    duration = number(metrics.get("duration_s"))
    after = f" after {quantities.duration(duration)}" if math.isfinite(duration) else ""
    answer = (
        f"All {count} robots succeeded{after}"
        if good == count
        else f"{good} of {count} robots succeeded{after}"
    )
    if good < count:
        reason = str(metrics.get("reason") or "no reason given").strip().rstrip(".")
        answer += f" ({reason})"
    collisions, driven = number(metrics.get("collisions")), number(metrics.get("path_length_m"))
    details = _watched(metrics)
    if math.isfinite(collisions):
        text = "no collision" if collisions == 0.0 else f"{quantities.count(collisions)} collisions"
        details.append("1 collision" if collisions == 1.0 else text)
    if math.isfinite(driven):
        details.append(f"{quantities.length(driven)} driven in all")
    rmse = number(metrics.get("position_rmse_m"))
    if math.isfinite(rmse):
        details.append(f"positions known to {quantities.length(rmse)} (RMSE, mean of the robots)")
    return f"{answer}; {'; '.join(details)}." if details else f"{answer}."


def _watched(metrics: Mapping[str, Any]) -> list[str]:
    """Whether somebody who came in was seen."""
    detected = metrics.get("detected")
    if not isinstance(detected, bool):
        return []
    soon = f"{quantities.duration(number(metrics.get('detection_time_s')))} after he came in"
    return [f"the intruder was detected {soon}" if detected else "the intruder was not detected"]


def _charted(metrics: Mapping[str, Any]) -> list[str]:
    """What an explorer was sent for: how much of the floor its map shows, and how well."""
    told = []
    for key, what, right, how_right in (
        ("floor_mapped", "of the reachable floor mapped", "wall_rms_m", ", its walls {} off (RMS)"),
        (
            "coverage_reachable",
            "of the reachable cells visited",
            "feature_precision",
            ", {} of the features right",
        ),
        ("swept_fraction", "of the floor swept", "", ""),
    ):
        done, well = number(metrics.get(key)), number(metrics.get(right))
        if math.isfinite(done):
            write = quantities.length if right.endswith("_m") else quantities.share
            how = how_right.format(write(well)) if math.isfinite(well) else ""
            told.append(f"{quantities.share(done)} {what}{how}")
    return told


def _planned(metrics: Mapping[str, Any]) -> str:
    """A path that was planned and not driven."""
    planned, shortest = number(metrics.get("planned_length_m")), number(metrics.get("shortest_length_m"))
    took, travel = number(metrics.get("planning_time_s")), number(metrics.get("travel_time_s"))
    text = f"a path of {quantities.length(planned)}"
    if shortest > 0.0:
        text += (
            f", {quantities.significant(planned / shortest, 4)} times the shortest possible path of "
            f"{quantities.length(shortest)},"
        )
    if math.isfinite(took):
        text += f" found in {quantities.duration(took)}"
    return text + (f", {quantities.duration(travel)} of driving" if math.isfinite(travel) else "")
