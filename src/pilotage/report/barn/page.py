"""The page itself: metric by controller, paired differences, difficulty, worst courses, others' results."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pilotage.core.whole_file import write_whole
from pilotage.evaluation.barn import BarnRun, summarize
from pilotage.evaluation.intervals import wilson
from pilotage.report.barn.figure import difficulty_figure
from pilotage.report.barn.pairs import (
    interval,
    number,
    outcome,
    pairs_section,
    percent,
    plain_table,
    replay_link,
    seconds,
)
from pilotage.report.markup import REPORT_FILE, Section, figure_sections, page, section
from pilotage.report.quantities import counted
from pilotage.report.style import drawing_style

WORST = 6
"""Courses listed of each controller."""
HEAD = (
    "controller",
    "metric",
    "95 % over courses",
    "success",
    "95 %",
    "collision",
    "timeout",
    "time",
    "over bound",
    "runs",
    "courses",
)
COMPARED: tuple[tuple[str, int, Callable[[BarnRun], float]], ...] = (
    ("metric", 4, lambda run: run.metric),
    ("time (s)", 2, lambda run: run.time_s if run.success else math.nan),
)
"""What is compared course by course; the time where every run of both reached the goal."""
Runs = Mapping[str, Sequence[BarnRun]]


@dataclass(frozen=True, slots=True)
class BarnPage:
    """What the page shows.

    Attributes
    ----------
    runs, published
        By controller: ours, and those that others published of their simulator.
    clearance_m
        By world, the least distance between the organizers' reference path and a post.
    without_way
        Worlds that nobody drove because the robot does not fit through.
    replays
        Links of runs that have a page of their own, by controller, world and trial.
    """

    runs: Runs
    published: Runs
    clearance_m: Mapping[int, float]
    without_way: Sequence[int] = ()
    replays: Mapping[tuple[str, int, int], str] = field(default_factory=dict)


def write_barn_report(folder: Path, shown: BarnPage) -> Path:
    """Write ``report.html`` into a folder and return its path."""
    path = folder / REPORT_FILE
    write_whole(path, barn_page(shown))
    return path


def barn_page(shown: BarnPage) -> str:
    """Return the page as HTML."""
    best = max(shown.runs, key=lambda name: summarize(shown.runs[name]).metric)
    found = summarize(shown.runs[best])
    with drawing_style():
        figure = difficulty_figure(shown.runs, shown.clearance_m)
    skipped = (
        f" {counted(len(shown.without_way), 'course')} with no way for this robot, not driven: "
        f"{', '.join(map(str, shown.without_way))}."
        if shown.without_way
        else ""
    )
    rows = [_row(name, runs) for name, runs in shown.runs.items()]
    return page(
        [
            section("controllers", "Controllers", plain_table(HEAD, rows)),
            pairs_section(shown.runs, lambda run: ("", run.world), COMPARED),
            *figure_sections([figure]),
            _worst(shown),
            _published(shown),
        ],
        [figure],
        title="BARN",
        eyebrow="pilotage bench barn",
        heading="Controllers on the BARN courses",
        headline=f"{best}: metric {found.metric:.3f} (0.5 is the most there is) on "
        f"{counted(found.worlds, 'course')}, {counted(found.trials, 'run')}.{skipped}",
        tiles=[
            ("metric", f"{found.metric:.3f}"),
            ("success", percent(found.success)),
            ("collisions", percent(found.collision)),
            ("mean time", seconds(found.time_s, 1)),
        ],
        footer="Made by pilotage.",
    )


def _row(name: str, runs: Sequence[BarnRun]) -> list[str]:
    found = summarize(runs)
    low, high = wilson(sum(run.success for run in runs), len(runs))
    return [
        name,
        f"{found.metric:.4f}",
        interval(found.metric_low, found.metric_high, 4),
        percent(found.success),
        f"{percent(low)} to {percent(high)}",
        percent(found.collision),
        percent(found.timeout),
        seconds(found.time_s, 2),
        number(found.over_bound, 3),
        str(found.trials),
        str(found.worlds),
    ]


def _worst(shown: BarnPage) -> Section:
    rows = []
    for name, runs in shown.runs.items():
        for run in sorted(runs, key=lambda run: (run.metric, -run.time_s))[:WORST]:
            cells = [name, str(run.world), str(run.trial), outcome(run), f"{run.time_s:.2f} s"]
            link = replay_link(shown.replays.get((name, run.world, run.trial)))
            rows.append([*cells, f"{run.metric:.4f}", link])
    heads = ("controller", "course", "trial", "outcome", "time", "metric", "")
    return section("worst", "Worst courses", plain_table(heads, rows))


def _published(shown: BarnPage) -> Section:
    slug, title = "published", "Published results of another simulator"
    if not shown.published:
        return section(slug, title, '<p class="absent">No published_*.csv lies beside the courses.</p>')
    rows = []
    for name, runs in shown.published.items():
        rows.append([f"{name} (Gazebo)", *_row(name, runs)[1:]])
        worlds = {run.world for run in runs}
        for own, ours in shown.runs.items():
            same = [run for run in ours if run.world in worlds]
            if same:
                rows.append([f"{own} here, on the same courses", *_row(own, same)[1:]])
    note = (
        "<p>Driven in Gazebo by others, with robots set to their own speeds: a yardstick, not a victory. "
        "Another simulator has other noise, delays and contacts.</p>"
    )
    return section(slug, title, note, plain_table(HEAD, rows))
