"""The page of controllers on courses of many kinds: by family, paired, by bottleneck, and the worst runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from matplotlib.figure import Figure

from pilotage.core.whole_file import write_whole
from pilotage.evaluation.courses import CourseRun, CourseSummary, by_course, summarize_courses
from pilotage.evaluation.paired import difference
from pilotage.report.barn.figure import COLOURS, HEIGHT_PT, MARKS
from pilotage.report.barn.page import REPORT_FILE, percent, section, table
from pilotage.report.markup import contents, document, escape, figure_section, layer_rules, tiles
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


def write_controllers_report(folder: Path, page: ControllersPage) -> Path:
    """Write ``report.html`` into a folder and return its path."""
    path = folder / REPORT_FILE
    write_whole(path, controllers_page(page))
    return path


def controllers_page(page: ControllersPage) -> str:
    """Return the page as HTML."""
    families = list(dict.fromkeys(run.family for runs in page.runs.values() for run in runs))
    best = max(page.runs, key=lambda name: summarize_courses(page.runs[name]).success)
    found = summarize_courses(page.runs[best])
    sections = [
        section("all", "All courses", table(HEAD, [_row(name, runs) for name, runs in page.runs.items()]))
    ]
    entries = [("all", "All courses")]
    for number, family in enumerate(families):
        slug, title = f"family-{number}", Path(family).stem if "/" in family else family
        parts = {name: [run for run in runs if run.family == family] for name, runs in page.runs.items()}
        body = table(HEAD, [_row(name, runs) for name, runs in parts.items()])
        if any(math.isfinite(run.near_share) for runs in parts.values() for run in runs):
            body += table(PEOPLE_HEAD, [_people_row(name, runs) for name, runs in parts.items()])
        if family in page.without_way:
            body += (
                f"<p>{page.without_way[family]} courses have no way for this robot and were not driven.</p>"
            )
        sections.append(section(slug, title, body))
        entries.append((slug, title))
    figures = []
    if any(family.startswith(BOTTLENECK) for family in families):
        with drawing_style():
            figures = [_bottlenecks(page)]
        sections.append(figure_section(1, figures[0]))
        entries.append((figures[0].slug, figures[0].title))
    sections += [_pairs(page.runs), _worst(page)]
    entries += [("pairs", "On the same courses"), ("worst", "Worst runs")]
    return document(
        title="Controllers",
        layers="".join(layer_rules(figure) for figure in figures),
        eyebrow="pilotage bench controllers",
        heading="Local controllers on courses of many kinds",
        description="",
        outcome="",
        headline=escape(
            f"{best}: {percent(found.success)} of {found.trials} runs on {found.courses} courses arrive."
        ),
        tiles=tiles(
            [
                ("success", percent(found.success)),
                ("collisions", percent(found.collision)),
                ("time over bound", _number(found.over_bound, 3)),
                ("people hit", str(found.people_collisions)),
            ]
        ),
        contents=contents(entries),
        body="\n".join(sections),
        footer="Made by pilotage.",
    )


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
        f"{_number(found.time_s, 2)} s",
        _number(found.over_bound, 3),
        f"{_number(found.over_bound_low, 3)} to {_number(found.over_bound_high, 3)}",
        str(found.trials),
        str(found.courses),
    ]


def _people_row(name: str, runs: Sequence[CourseRun]) -> list[str]:
    found: CourseSummary = summarize_courses(runs)
    return [
        name,
        str(found.people_collisions),
        str(found.people_touches),
        f"{_number(found.closest_m, 2)} m",
        percent(found.near_share),
        percent(found.time_lost) if math.isfinite(found.time_lost) else "–",
        str(found.trials),
    ]


def _bottlenecks(page: ControllersPage) -> Illustration:
    """Success over the width of the openings."""
    figure = Figure(figsize=(WIDTH_PT / 72.0, HEIGHT_PT / 72.0))
    axes = figure.add_axes((0.08, 0.17, 0.9, 0.78))
    keys = []
    for number, (name, runs) in enumerate(page.runs.items()):
        by_width: dict[float, list[CourseRun]] = {}
        for run in runs:
            if run.family.startswith(BOTTLENECK):
                by_width.setdefault(float(run.family.removeprefix(BOTTLENECK)), []).append(run)
        widths = sorted(by_width)
        found = [summarize_courses(by_width[width]) for width in widths]
        colour = COLOURS[number % len(COLOURS)]
        axes.plot(widths, [s.success for s in found], MARKS[number % len(MARKS)] + "-", color=colour)
        axes.fill_between(
            widths, [s.success_low for s in found], [s.success_high for s in found], color=colour, alpha=0.15
        )
        keys.append(Key(name, colour, "spot"))
    axes.set_xlabel("width of the openings (m)")
    axes.set_ylabel("success")
    axes.set_ylim(-0.03, 1.03)
    slug, title = "bottleneck", "Success against the bottleneck"
    alt = "Share of runs that reach the goal over the width of the narrowest opening"
    shut = {f: n for f, n in page.without_way.items() if f.startswith(BOTTLENECK)}
    said = ", ".join(f"{n} of {f.removeprefix(BOTTLENECK)} m" for f, n in shut.items())
    caption = "Courses that a search over all poses finds a way through, with 95 % Wilson bands." + (
        f" Without a way, and not driven: {said}." if said else ""
    )
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), tuple(keys))


def _pairs(runs: Mapping[str, Sequence[CourseRun]]) -> str:
    names = list(runs)
    if len(names) < 2:
        text = '<p class="absent">One controller only; name several to compare them on the same courses.</p>'
        return section("pairs", "On the same courses", text)
    rows = []
    for name in names[1:]:
        for what, digits, value in COMPARED:
            found = difference(by_course(runs[names[0]], value), by_course(runs[name], value))
            rows.append(
                [
                    f"{what}: {name} minus {names[0]}",
                    f"{found.mean:+.{digits}f}",
                    f"{found.low:+.{digits}f} to {found.high:+.{digits}f}",
                    f"{found.p_value:.2g}" if math.isfinite(found.p_value) else "–",
                    str(found.n),
                ]
            )
    head = ("what", "mean difference", "95 %", "p (Wilcoxon)", "courses")
    return section("pairs", "On the same courses", table(head, rows))


def _worst(page: ControllersPage) -> str:
    rows = []
    for name, runs in page.runs.items():
        ordered = sorted(runs, key=lambda run: (not run.collision, run.success, -run.time_s / run.bound_s))
        for run in ordered[:WORST]:
            word = "reached" if run.success else "collision" if run.collision else "timeout"
            link = page.replays.get((name, run.family, run.course, run.trial))
            replay = f'<a href="{escape(link)}">replay</a>' if link else ""
            cells = [
                name,
                Path(run.family).name,
                str(run.course),
                str(run.trial),
                word,
                f"{run.time_s:.2f} s",
            ]
            rows.append("".join(f"<td>{escape(cell)}</td>" for cell in cells) + f"<td>{replay}</td>")
    head = "".join(
        f'<th scope="col">{name}</th>'
        for name in ("controller", "family", "course", "trial", "outcome", "time", "")
    )
    body = "".join(f"<tr>{row}</tr>" for row in rows)
    return section(
        "worst",
        "Worst runs",
        f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>',
    )


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "–"
