"""Runs of local controllers on courses of many kinds: what a run is, and many of them put into numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.evaluation.intervals import bootstrap_mean, wilson


@dataclass(frozen=True, slots=True)
class CourseRun:
    """One run on one course; exactly one of success, collision and timeout is true.

    Attributes
    ----------
    family, course, trial
        Kind of the course, its number among these, and which run on it.
    bound_s
        Time that no robot of these limits undercuts, though it knew the course (``barn.time_bound``).
    empty_s
        Time of the same run without people; NaN where there are none, or it did not succeed.
    people_collisions, people_touches, closest_m, near_share
        As ``sim.people.crowd.Encounters``; 0 and NaN without people.
    """

    family: str
    course: int
    trial: int
    success: bool
    collision: bool
    timeout: bool
    time_s: float
    bound_s: float
    empty_s: float = math.nan
    people_collisions: int = 0
    people_touches: int = 0
    closest_m: float = math.nan
    near_share: float = math.nan


@dataclass(frozen=True, slots=True)
class CourseSummary:
    """Runs in numbers; NaN where no run gives a number.

    Attributes
    ----------
    success, success_low, success_high
        Share with its 95 % Wilson interval.
    time_s, over_bound, over_bound_low, over_bound_high
        Of the runs that succeeded: mean time; mean of time over bound with its 95 % interval over courses.
    time_lost
        Time of the runs that succeeded with people and without over the latter, less 1.
    """

    success: float
    success_low: float
    success_high: float
    collision: float
    timeout: float
    time_s: float
    over_bound: float
    over_bound_low: float
    over_bound_high: float
    time_lost: float
    people_collisions: int
    people_touches: int
    closest_m: float
    near_share: float
    trials: int
    courses: int


def summarize_courses(runs: Sequence[CourseRun]) -> CourseSummary:
    """Put runs into numbers.

    Raises
    ------
    InputError
        Without a run.
    """
    if not runs:
        raise InputError("courses: expected one run or more, found none")
    good = [run for run in runs if run.success]
    ratios = by_course(good, lambda run: run.time_s / run.bound_s)
    low, high = bootstrap_mean(ratios) if ratios.size > 1 else (math.nan, math.nan)
    both = [run for run in good if math.isfinite(run.empty_s)]
    empty_s = sum(run.empty_s for run in both)
    return CourseSummary(
        len(good) / len(runs),
        *wilson(len(good), len(runs)),
        float(np.mean([run.collision for run in runs])),
        float(np.mean([run.timeout for run in runs])),
        _mean([run.time_s for run in good]),
        _mean(ratios.tolist()),
        low,
        high,
        sum(run.time_s for run in both) / empty_s - 1.0 if both else math.nan,
        sum(run.people_collisions for run in runs),
        sum(run.people_touches for run in runs),
        min((run.closest_m for run in runs if math.isfinite(run.closest_m)), default=math.nan),
        _mean([run.near_share for run in runs]),
        len(runs),
        len({(run.family, run.course) for run in runs}),
    )


def by_course(runs: Sequence[CourseRun], value: Callable[[CourseRun], float]) -> FloatArray:
    """(C,) mean of a value in each course that was driven, in the order of families and numbers."""
    gathered: dict[tuple[str, int], list[float]] = {}
    for run in runs:
        gathered.setdefault((run.family, run.course), []).append(value(run))
    return np.array([np.mean(gathered[key]) for key in sorted(gathered)])


def _mean(values: Sequence[float]) -> float:
    finite = [value for value in values if math.isfinite(value)]
    return float(np.mean(finite)) if finite else math.nan
