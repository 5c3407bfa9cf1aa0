"""What pages of controllers on courses share: pairs on the same courses, and the worst runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol, TypeVar

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.evaluation.paired import difference
from pilotage.report.markup import Html, Section, escape, section, table


class Run(Protocol):
    """What of a run on a course both pages tell."""

    @property
    def success(self) -> bool: ...
    @property
    def collision(self) -> bool: ...
    @property
    def time_s(self) -> float: ...


R = TypeVar("R", bound=Run)
Compared = Sequence[tuple[str, int, Callable[[R], float]]]
"""What is compared course by course: its name, its digits, and how a run gives it."""


def pairs_section(
    runs: Mapping[str, Sequence[R]], course: Callable[[R], tuple[str, int]], compared: Compared[R]
) -> Section:
    """Every controller against the first one, on the courses that both drove."""
    slug, title = "pairs", "On the same courses"
    first, *others = runs
    if not others:
        text = '<p class="absent">One controller only; name several to compare them on the same courses.</p>'
        return section(slug, title, text)
    courses = sorted({course(run) for member in runs.values() for run in member})
    rows = []
    for name in others:
        for what, digits, value in compared:
            one, other = (_means(runs[member], courses, course, value) for member in (first, name))
            found = difference(one, other)
            rows.append(
                [
                    f"{what}: {name} minus {first}",
                    number(found.mean, digits, "+"),
                    interval(found.low, found.high, digits, "+"),
                    f"{found.p_value:.2g}" if math.isfinite(found.p_value) else "–",
                    str(found.n),
                ]
            )
    heads = ("what", "mean difference", "95 %", "p (Wilcoxon)", "courses")
    return section(slug, title, plain_table(heads, rows))


def _means(
    runs: Sequence[R],
    courses: Sequence[tuple[str, int]],
    course: Callable[[R], tuple[str, int]],
    value: Callable[[R], float],
) -> FloatArray:
    """(C,) mean of a value on each course; NaN where it was not driven or a run has none."""
    gathered: dict[tuple[str, int], list[float]] = {key: [] for key in courses}
    for run in runs:
        gathered[course(run)].append(value(run))
    return np.array([np.mean(found) if found else np.nan for found in gathered.values()])


def plain_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table whose columns all are text."""
    return table([(name, "") for name in heads], rows, box="wide")


def outcome(run: Run) -> str:
    """How a run ended, in a word."""
    return "reached" if run.success else "collision" if run.collision else "timeout"


def replay_link(link: str | None) -> Html:
    """Where a run's own page is, if it has one."""
    return Html(f'<a href="{escape(link)}">replay</a>' if link else "")


def percent(share: float) -> str:
    """A share in percent, one digit after the point."""
    return f"{100.0 * share:.1f}\u00a0%"


def number(value: float, digits: int, sign: str = "") -> str:
    """So many digits after the point; a dash for none; ``sign="+"`` writes that as well."""
    return f"{value:{sign}.{digits}f}".replace("-", "−") if math.isfinite(value) else "–"


def interval(low: float, high: float, digits: int, sign: str = "") -> str:
    """From where to where; a dash for none, as of a single course."""
    known = math.isfinite(low) and math.isfinite(high)
    return f"{number(low, digits, sign)} to {number(high, digits, sign)}" if known else "–"


def seconds(value: float, digits: int) -> str:
    """A time with its unit; a dash for none, as where nobody arrived."""
    return f"{value:.{digits}f}\u00a0s" if math.isfinite(value) else "–"
