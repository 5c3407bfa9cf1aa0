"""The page itself: metric by controller, paired differences, difficulty, worst courses, others' results."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.core.whole_file import write_whole
from pilotage.evaluation.barn import BarnRun, summarize
from pilotage.evaluation.intervals import wilson
from pilotage.evaluation.paired import difference
from pilotage.report.barn.figure import difficulty_figure
from pilotage.report.markup import contents, document, escape, figure_section, layer_rules, tiles
from pilotage.report.style import drawing_style

REPORT_FILE = "report.html"
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
        (controller, run, link) of runs that have a page of their own.
    """

    runs: Runs
    published: Runs
    clearance_m: Mapping[int, float]
    without_way: Sequence[int] = ()
    replays: Sequence[tuple[str, BarnRun, str]] = field(default_factory=tuple)


def write_barn_report(folder: Path, page: BarnPage) -> Path:
    """Write ``report.html`` into a folder and return its path."""
    path = folder / REPORT_FILE
    write_whole(path, barn_page(page))
    return path


def barn_page(page: BarnPage) -> str:
    """Return the page as HTML."""
    best = max(page.runs, key=lambda name: summarize(page.runs[name]).metric)
    found = summarize(page.runs[best])
    with drawing_style():
        figure = difficulty_figure(page.runs, page.clearance_m)
    sections = [
        _controllers(page.runs),
        _pairs(page.runs),
        figure_section(1, figure),
        _worst(page),
        _published(page),
    ]
    entries = [
        ("controllers", "Controllers"),
        ("pairs", "On the same courses"),
        (figure.slug, figure.title),
        ("worst", "Worst courses"),
        ("published", "Published results"),
    ]
    skipped = (
        f" {len(page.without_way)} courses have no way for this robot and were not driven: "
        f"{', '.join(map(str, page.without_way))}."
        if page.without_way
        else ""
    )
    return document(
        title="BARN",
        layers=layer_rules(figure),
        eyebrow="pilotage bench barn",
        heading="Controllers on the BARN courses",
        description="",
        outcome="",
        headline=escape(
            f"{best}: metric {found.metric:.3f} (0.5 is the most there is) on {found.worlds} courses, "
            f"{found.trials} runs.{skipped}"
        ),
        tiles=tiles(
            [
                ("metric", f"{found.metric:.3f}"),
                ("success", percent(found.success)),
                ("collisions", percent(found.collision)),
                ("mean time", f"{found.time_s:.1f} s"),
            ]
        ),
        contents=contents(entries),
        body="\n".join(sections),
        footer="Made by pilotage.",
    )


def _controllers(runs: Runs) -> str:
    return section("controllers", "Controllers", table(HEAD, [_row(name, runs[name]) for name in runs]))


def _row(name: str, runs: Sequence[BarnRun]) -> list[str]:
    found = summarize(runs)
    low, high = wilson(sum(run.success for run in runs), len(runs))
    return [
        name,
        f"{found.metric:.4f}",
        f"{found.metric_low:.4f} to {found.metric_high:.4f}",
        percent(found.success),
        f"{percent(low)} to {percent(high)}",
        percent(found.collision),
        percent(found.timeout),
        f"{found.time_s:.2f} s",
        f"{found.over_bound:.3f}" if math.isfinite(found.over_bound) else "–",
        str(found.trials),
        str(found.worlds),
    ]


def by_world(runs: Sequence[BarnRun], worlds: Sequence[int], value: Callable[[BarnRun], float]) -> FloatArray:
    """(W,) mean of a value in each world; NaN where it was not driven or a run has none."""
    gathered: dict[int, list[float]] = {world: [] for world in worlds}
    for run in runs:
        if run.world in gathered:
            gathered[run.world].append(value(run))
    return np.array([np.mean(found) if found else np.nan for found in gathered.values()])


def _pairs(runs: Runs) -> str:
    names = list(runs)
    if len(names) < 2:
        text = '<p class="absent">One controller only; name several to compare them on the same courses.</p>'
        return section("pairs", "On the same courses", text)
    worlds = sorted({run.world for member in runs.values() for run in member})
    rows = []
    for name in names[1:]:
        for what, digits, value in COMPARED:
            one, other = (by_world(runs[member], worlds, value) for member in (names[0], name))
            found = difference(one, other)
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


def _worst(page: BarnPage) -> str:
    rows = []
    links = {(name, run.world, run.trial): link for name, run, link in page.replays}
    for name, runs in page.runs.items():
        for run in sorted(runs, key=lambda run: (run.metric, -run.time_s))[:WORST]:
            link = links.get((name, run.world, run.trial))
            word = "reached" if run.success else "collision" if run.collision else "timeout"
            cells = [name, str(run.world), str(run.trial), word, f"{run.time_s:.2f} s", f"{run.metric:.4f}"]
            replay = f'<a href="{escape(link)}">replay</a>' if link else ""
            rows.append("".join(_cell(text) for text in cells) + f"<td>{replay}</td>")
    head = ("controller", "course", "trial", "outcome", "time", "metric", "")
    body = "".join(f"<tr>{row}</tr>" for row in rows)
    return section(
        "worst", "Worst courses", f'<div class="wide"><table>{_head(head)}<tbody>{body}</tbody></table></div>'
    )


def _published(page: BarnPage) -> str:
    title = "Published results of another simulator"
    if not page.published:
        text = '<p class="absent">No published_*.csv lies beside the courses.</p>'
        return section("published", title, text)
    rows = []
    for name, runs in page.published.items():
        rows.append([f"{name} (Gazebo)", *_row(name, runs)[1:]])
        worlds = {run.world for run in runs}
        for own, ours in page.runs.items():
            same = [run for run in ours if run.world in worlds]
            if same:
                rows.append([f"{own} here, on the same courses", *_row(own, same)[1:]])
    note = (
        "<p>Driven in Gazebo by others, with robots set to their own speeds: a yardstick, not a victory. "
        "Another simulator has other noise, delays and contacts.</p>"
    )
    return section("published", title, note + table(HEAD, rows))


def section(slug: str, title: str, body: str) -> str:
    """One section with its heading."""
    return f'<section id="{slug}"><h2><a href="#{slug}">{escape(title)}</a></h2>{body}</section>'


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table of plain text."""
    body = "".join(f"<tr>{''.join(_cell(text) for text in row)}</tr>" for row in rows)
    return f'<div class="wide"><table>{_head(head)}<tbody>{body}</tbody></table></div>'


def _head(names: Sequence[str]) -> str:
    cells = "".join(f'<th scope="col">{escape(name)}</th>' for name in names)
    return f"<thead><tr>{cells}</tr></thead>"


def _cell(text: str) -> str:
    return f"<td>{escape(text)}</td>"


def percent(share: float) -> str:
    """A share in percent, one digit after the point."""
    return f"{100.0 * share:.1f} %"
