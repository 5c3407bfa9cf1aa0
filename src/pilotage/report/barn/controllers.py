"""The page of controllers on courses of many kinds: by family, paired, by bottleneck, and the worst runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from pilotage.core.whole_file import write_whole
from pilotage.evaluation.courses import CourseRun, CourseSummary, summarize_courses
from pilotage.report.barn.figure import COLOURS, HEIGHT_PT, MARKS
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
from pilotage.report.style import WIDTH_PT, Illustration, Key, drawing_style, render

HEAD = (
    "controller",
    "success",
    "95 %",
    "collision",
    "timeout",
    "time",
    "over bound",
    "95 % over courses",
    "runs",
    "courses",
)
PEOPLE_HEAD = (
    "controller",
    "hit people",
    "walked into it",
    "closest",
    "time within 0.5 m",
    "time lost",
    "runs",
)
HOW = (
    "Success with its 95 % Wilson interval over the runs. Over bound: time over the least that any robot of "
    "the same limits needs though it knows the course, with its 95 % interval over the courses; 1 is out of "
    "reach, less is better."
)
MOST_TOLD = 4
WORST = 8
BOTTLENECK = "bottleneck-"
COMPARED: tuple[tuple[str, int, Callable[[CourseRun], float]], ...] = (
    ("success", 3, lambda run: float(run.success)),
    ("time (s)", 2, lambda run: run.time_s if run.success else math.nan),
)


@dataclass(frozen=True, slots=True)
class ControllersPage:
    """Runs by controller, how many courses of a family have no way, and links to the replays of runs."""

    runs: Mapping[str, Sequence[CourseRun]]
    without_way: Mapping[str, int]
    replays: Mapping[tuple[str, str, int, int], str] = field(default_factory=dict)


def write_controllers_report(folder: Path, shown: ControllersPage) -> Path:
    """Write ``report.html`` into a folder and return its path."""
    path = folder / REPORT_FILE
    write_whole(path, controllers_page(shown))
    return path


def controllers_page(shown: ControllersPage) -> str:
    """Return the page as HTML."""
    families = list(dict.fromkeys(run.family for runs in shown.runs.values() for run in runs))
    summaries = {name: summarize_courses(runs) for name, runs in shown.runs.items()}
    # Where nobody arrives there is no time, and nan has no order.
    ranked = sorted(
        summaries,
        key=lambda name: (-summaries[name].success, np.nan_to_num(summaries[name].over_bound, nan=np.inf)),
    )
    best = ranked[0]
    found = summaries[best]
    figures = []
    if any(family.startswith(BOTTLENECK) for family in families):
        with drawing_style():
            figures = [_bottlenecks(shown)]
    all_rows = [_row(name, runs) for name, runs in shown.runs.items()]
    return page(
        [
            section("all", "All courses", f"<p>{HOW}</p>", plain_table(HEAD, all_rows)),
            *(_family(shown, position, family) for position, family in enumerate(families)),
            *figure_sections(figures),
            pairs_section(shown.runs, lambda run: (run.family, run.course), COMPARED),
            _worst(shown),
        ],
        figures,
        title="Controllers",
        eyebrow="pilotage bench controllers",
        heading="Local controllers on courses of many kinds",
        headline="; ".join(_told(name, summaries[name]) for name in ranked[:MOST_TOLD]) + ".",
        tiles=[
            *([("best controller", best)] if len(ranked) > 1 else []),
            ("success", percent(found.success)),
            ("collisions", percent(found.collision)),
            ("time over bound", number(found.over_bound, 3)),
            ("people hit", str(found.people_collisions)),
        ],
        footer="Made by pilotage.",
    )


def _told(name: str, found: CourseSummary) -> str:
    """How often a controller arrived, and how fast."""
    runs = f"{counted(found.trials, 'run')} on {counted(found.courses, 'course')}"
    fast = f" at {number(found.over_bound, 3)} times the bound" if math.isfinite(found.over_bound) else ""
    return f"{name}: {percent(found.success)} of {runs} arrive{fast}"


def _family(shown: ControllersPage, position: int, family: str) -> Section:
    """The runs on courses of one kind."""
    parts = {name: [run for run in runs if run.family == family] for name, runs in shown.runs.items()}
    body = plain_table(HEAD, [_row(name, runs) for name, runs in parts.items()])
    if any(math.isfinite(run.near_share) for runs in parts.values() for run in runs):
        body += plain_table(PEOPLE_HEAD, [_people_row(name, runs) for name, runs in parts.items()])
    if family in shown.without_way:
        body += (
            f"<p>{counted(shown.without_way[family], 'course')} with no way for this robot, not driven.</p>"
        )
    return section(f"family-{position}", Path(family).stem if "/" in family else family, body)


def _row(name: str, runs: Sequence[CourseRun]) -> list[str]:
    if not runs:
        return [name, *["–"] * (len(HEAD) - 1)]
    found = summarize_courses(runs)
    return [
        name,
        percent(found.success),
        f"{percent(found.success_low)} to {percent(found.success_high)}",
        percent(found.collision),
        percent(found.timeout),
        seconds(found.time_s, 2),
        number(found.over_bound, 3),
        interval(found.over_bound_low, found.over_bound_high, 3),
        str(found.trials),
        str(found.courses),
    ]


def _people_row(name: str, runs: Sequence[CourseRun]) -> list[str]:
    found: CourseSummary = summarize_courses(runs)
    return [
        name,
        str(found.people_collisions),
        str(found.people_touches),
        f"{found.closest_m:.2f} m" if math.isfinite(found.closest_m) else "–",
        percent(found.near_share),
        percent(found.time_lost) if math.isfinite(found.time_lost) else "–",
        str(found.trials),
    ]


def _bottlenecks(shown: ControllersPage) -> Illustration:
    """Success over the width of the openings."""
    figure = Figure(figsize=(WIDTH_PT / 72.0, HEIGHT_PT / 72.0))
    axes = figure.add_axes((0.08, 0.17, 0.9, 0.78))
    keys = []
    for k, (name, runs) in enumerate(shown.runs.items()):
        by_width: dict[float, list[CourseRun]] = {}
        for run in runs:
            if run.family.startswith(BOTTLENECK):
                by_width.setdefault(float(run.family.removeprefix(BOTTLENECK)), []).append(run)
        widths = sorted(by_width)
        found = [summarize_courses(by_width[width]) for width in widths]
        colour = COLOURS[k % len(COLOURS)]
        axes.plot(widths, [s.success for s in found], MARKS[k % len(MARKS)] + "-", color=colour)
        axes.fill_between(
            widths, [s.success_low for s in found], [s.success_high for s in found], color=colour, alpha=0.15
        )
        keys.append(Key(name, colour, "spot"))
    axes.set_xlabel("width of the openings (m)")
    axes.set_ylabel("success")
    axes.set_ylim(-0.03, 1.03)
    slug, title = "bottleneck", "Success against the bottleneck"
    alt = "Share of runs that reach the goal over the width of the narrowest opening"
    shut = {f: n for f, n in shown.without_way.items() if f.startswith(BOTTLENECK)}
    said = ", ".join(f"{n} of {f.removeprefix(BOTTLENECK)} m" for f, n in shut.items())
    caption = "Courses that a search over all poses finds a way through, with 95 % Wilson bands." + (
        f" Without a way, and not driven: {said}." if said else ""
    )
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), tuple(keys))


def _worst(shown: ControllersPage) -> Section:
    rows = []
    for name, runs in shown.runs.items():
        ordered = sorted(runs, key=lambda run: (not run.collision, run.success, -run.time_s / run.bound_s))
        for run in ordered[:WORST]:
            cells = [name, Path(run.family).name, str(run.course), str(run.trial), outcome(run)]
            link = replay_link(shown.replays.get((name, run.family, run.course, run.trial)))
            rows.append([*cells, f"{run.time_s:.2f} s", link])
    heads = ("controller", "family", "course", "trial", "outcome", "time", "")
    return section("worst", "Worst runs", plain_table(heads, rows))
