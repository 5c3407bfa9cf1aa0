"""The median and the worst trial as pictures, each with what replays it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.studies.table import StudyTable
from pilotage.report import quantities
from pilotage.report.markup import Section, escape, section
from pilotage.report.replay.section import SLUG


@dataclass(frozen=True, slots=True)
class Example:
    """A trial that was run again for its picture.

    ``link`` is the page of that run, relative to the study's folder, ``replay`` whether it has one; ``svg``
    its map.
    """

    title: str
    row: int
    text: str
    link: str
    command: str
    svg: str
    replay: bool = True


def rows_to_show(table: StudyTable) -> list[tuple[str, int]]:
    """The worst and the median trial by the metric that answers the question: (what it is, row).

    A trial that failed in the field is worse than any that succeeded.
    """
    column = table.column(table.primary)
    success = table.column("success")
    badness = column if table.lower_is_better else -column
    badness = np.where(np.isfinite(badness), badness, np.inf)
    failed = np.where(np.isfinite(success) & (success < 0.5), 1.0, 0.0)
    if not table.row.size:
        return []
    order = np.lexsort((table.row, badness, failed))
    worst, median = int(table.row[order[-1]]), int(table.row[order[(len(order) - 1) // 2]])
    return [("The worst trial", worst)] + ([("The median trial", median)] if median != worst else [])


def describe(table: StudyTable, row: int) -> str:
    """Which setting, which seed, what it gave."""
    at = int(np.flatnonzero(table.row == row)[0])
    metric = METRICS.find(table.primary)
    value = quantities.measured(float(table.column(table.primary)[at]), metric.unit)
    ended = "" if table.column("success")[at] != 0.0 else "; it failed"
    cell = table.cells[int(table.cell[at])]
    setting = cell.text if len(table.groups) == 1 else cell.name
    return f"{setting}, seed {int(table.seed[at])}: {metric.name} {value}{ended}."


def examples_section(examples: Sequence[Example]) -> Section:
    """The section; left out without examples."""
    parts = []
    for example in examples:
        replay = f'<a href="{escape(example.link)}#{SLUG}">Replay it</a> · ' if example.replay else ""
        link = (
            f'<p>{replay}<a href="{escape(example.link)}">Its report</a> · '
            f"<code>{escape(example.command)}</code></p>"
        )
        parts.append(
            f'<figure class="example"><h3>{escape(example.title)}</h3><div class="plot" tabindex="0">'
            f"{example.svg}</div><figcaption>{escape(example.text)}</figcaption>{link}</figure>"
        )
    return section("trials", "The median and the worst trial", *parts)
