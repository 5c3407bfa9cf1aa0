"""Puts a study's page together: self-contained, with vector figures."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

import numpy as np

from pilotage.core.version import __version__
from pilotage.core.whole_file import write_whole
from pilotage.evaluation.judge import Judgement
from pilotage.experiments.studies.findings import Best, Finding
from pilotage.experiments.studies.study import study_yaml
from pilotage.experiments.studies.table import StudyTable
from pilotage.report.markup import REPORT_FILE, Section, escape, figure_sections, page, section
from pilotage.report.quantities import count
from pilotage.report.study.answer import answer, answers
from pilotage.report.study.comparisons import comparisons_table
from pilotage.report.study.effects_section import effects_section
from pilotage.report.study.examples import Example, examples_section
from pilotage.report.study.factor_figures import factor_figures
from pilotage.report.study.ranking import Module, ranking_answer, ranking_table
from pilotage.report.study.settings_figures import settings_figures
from pilotage.report.study.tables import (
    cells_table,
    consistency_table,
    endings_table,
    failures_table,
)
from pilotage.report.style import drawing_style


def study_page(
    table: StudyTable,
    examples: tuple[Example, ...] = (),
    ranking: Sequence[Module] | None = None,
    found: tuple[Sequence[Finding], Sequence[Best]] = ((), ()),
) -> str:
    """Return the page of a study as HTML; ``ranking`` is an attribution's, with the oracles' texts."""
    judgement, definition = table.judged(), table.study.definition
    mission = table.study.base.get("mission", definition.mission)
    question = definition.question or definition.description
    with drawing_style():
        figures = [*settings_figures(table, judgement), *factor_figures(table, judgement)]
    return page(
        [
            *(() if ranking is None else (ranking_table(ranking),)),
            effects_section(table, *found),
            _findings(table, judgement),
            *figure_sections(figures),
            cells_table(table, judgement),
            comparisons_table(table, judgement),
            consistency_table(table),
            endings_table(table),
            examples_section(examples),
            failures_table(table),
            _again(table),
        ],
        figures,
        title=f"{table.study.name}: study report",
        heading=table.study.name,
        eyebrow=f"pilotage study report · mission {mission} · {count(table.row.size)} trials",
        descriptions=[question] if question else (),
        headline=answer(table, judgement) if ranking is None else ranking_answer(ranking),
        tiles=_tiles(table),
        footer="Made by pilotage from the study's database. Settings are compared on "
        f"{'the same seeds' if table.same_seeds else 'seeds of their own'}; intervals are 95 %.",
    )


def write_page(
    table: StudyTable,
    folder: Path,
    examples: tuple[Example, ...] = (),
    ranking: Sequence[Module] | None = None,
    found: tuple[Sequence[Finding], Sequence[Best]] = ((), ()),
) -> Path:
    """Write ``report.html`` into the study's folder in one go and return its path."""
    path = folder / REPORT_FILE
    write_whole(path, study_page(table, examples, ranking, found))
    return path


def _findings(table: StudyTable, judgement: Judgement) -> Section:
    """What each group of settings says beyond the headline, and what one must know to read it."""
    parts = [
        f"{f'<h3>{escape(name)}</h3>' if len(table.groups) > 1 else ''}"
        f"<ul>{''.join(f'<li>{escape(text)}</li>' for text in texts)}</ul>"
        for name, texts in answers(table, judgement)
    ]
    text = table.study.definition.description if table.study.definition.question else ""
    note = f'<p class="note">{escape(text)}</p>' if text else ""
    return section("findings", "What else it says", *parts, note)


def _tiles(table: StudyTable) -> list[tuple[str, str]]:
    success = table.column("success")
    rated = int(np.isfinite(success).sum())
    entries = [
        ("trials", count(table.row.size)),
        ("settings × trials each", f"{count(len(table.cells))} × {count(table.study.definition.trials)}"),
        *([("succeeded", f"{count(float(np.nansum(success)))} of {count(rated)}")] if rated else []),
        ("broken trials", count(len(table.broken))),
    ]
    return [*entries, ("still to run", count(table.waiting))] if table.waiting else entries


def _again(table: StudyTable) -> Section:
    definition, first = escape(study_yaml(table.study)), table.study.definition.seeds.first
    last = first + table.study.definition.trials - 1
    return section(
        "again",
        "To run it again",
        f"<p>Seeds {first} to {last}, the same in every setting. The folder&#x27;s "
        "<code>study.yaml</code> holds everything that is needed: "
        "<code>pilotage study study.yaml</code>. Any single trial: "
        "<code>pilotage run --from STUDY:ROW</code>, in the folder that holds the study&#x27;s. "
        f"{escape(f'Made with {versions()}.')}</p>"
        f"<details><summary>Show the definition</summary><pre>{definition}</pre></details>",
    )


def versions() -> str:
    """What made the rows and the page: releases of pilotage and of what its numbers come from."""
    names = ("numpy", "scipy", "numba")
    parts = [f"pilotage {__version__}", f"Python {platform.python_version()}"]
    return ", ".join([*parts, *(f"{name} {metadata.version(name)}" for name in names)])
