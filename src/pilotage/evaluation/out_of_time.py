"""What is known of a run that its time limit ended: a robot that is lost fails as one that is slow does."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pilotage.evaluation.driving import claimed_at, covariances, poses
from pilotage.evaluation.finished import FinishedRun, RobotRun, Verdict
from pilotage.evaluation.pose_errors import pose_errors
from pilotage.stack.interface import StackStatus

LEAST_SHARE, LEAST_S = 0.1, 5.0
"""Of the time, and at least: who was lost for less, or stood at the end for less, was not late by that."""
STOOD_M = 0.1
FAR_OFF_M = 0.5
"""A belief at the end that is farther off, or less certain, is told."""


def told_why(verdict: Verdict, run: FinishedRun) -> Verdict:
    """The verdict with what a robot's own trace says of why the time did not do, where that ended the run.

    Of several robots each reason says its own, and the team's that of the robot whose reason it was.
    """
    metrics = verdict.metrics
    if not run.ending.startswith("time limit") or metrics.get("success"):
        return verdict
    late = {robot.name: why_late(robot) for robot in run.robots if robot.status is StackStatus.RUNNING}
    told, robots = dict(metrics), metrics.get("robots")
    if isinstance(robots, Mapping):
        own = {name: _with(entry, run, "it", late.get(name, "")) for name, entry in robots.items()}
        told["robots"] = {name: entry | own[name] for name, entry in robots.items()}
    name, why = next(((name, why) for name, why in late.items() if why), ("", ""))
    told |= _with(metrics, run, name if len(run.robots) > 1 else "it", why)
    return replace(verdict, metrics=told)


def _with(metrics: Mapping[str, object], run: FinishedRun, who: str, why: str) -> dict[str, object]:
    late = why and not metrics.get("success") and metrics.get("reason") == run.ending
    return {"reason": f"{run.ending}; {who} {why}"} if late else {}


def why_late(robot: RobotRun) -> str:
    """In words that follow its name; nothing where it neither was lost nor stood."""
    trace = robot.trace
    t_s = trace["t_s"]
    if t_s.shape[0] < 2:
        return ""
    whole_s, claimed = float(t_s[-1]), claimed_at(trace)
    least_s = max(LEAST_SHARE * whole_s, LEAST_S)
    lost_s = float(np.diff(t_s)[~claimed[1:]].sum())
    words = []
    if not claimed.any():
        words.append("never knew where it was")
    elif lost_s > least_s:
        end = "" if claimed[-1] else ", and at the end"
        words.append(f"was lost for {lost_s:.0f} s of that{end}")
    if claimed[-1]:
        spread_m = math.sqrt(max(float(np.trace(covariances(trace)[-1][:2, :2])), 0.0))
        off_m = float(pose_errors(poses(trace, "true")[-1:], poses(trace, "est")[-1:]).distance_m[0])
        if max(spread_m, off_m) > FAR_OFF_M:
            words.append(f"was {off_m:.2f} m from where it believed, sure of that to {spread_m:.2f} m")
    away_m = np.hypot(trace["true_x_m"] - trace["true_x_m"][-1], trace["true_y_m"] - trace["true_y_m"][-1])
    moving = np.flatnonzero(away_m > STOOD_M)
    stood_s = whole_s - float(t_s[moving[-1]]) if moving.size else whole_s
    if stood_s > least_s:
        words.append(f"stood for the last {stood_s:.0f} s")
    return ", ".join(words)
