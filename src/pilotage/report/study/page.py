"""Puts a study's page together: self-contained, with vector figures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pilotage.core.whole_file import write_whole
from pilotage.evaluation.judge import Judgement, judge
from pilotage.experiments.studies.findings import Best, Finding
from pilotage.report.markup import contents, document, escape, figure_section, layer_rules, tiles
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
    failures_table,
)
from pilotage.report.study.view import StudyView
from pilotage.report.style import drawing_style

REPORT_FILE = "report.html"


def study_page(
    view: StudyView,
    examples: tuple[Example, ...] = (),
    ranking: Sequence[Module] | None = None,
    found: tuple[Sequence[Finding], Sequence[Best]] = ((), ()),
) -> str:
    """Return the page of a study as HTML; ``ranking`` is an attribution's, with the oracles' texts."""
    judgement = judge_view(view)
    with drawing_style():
        figures = [*settings_figures(view, judgement), *factor_figures(view, judgement)]
    sections = [
        ("ranking", "What each module costs", "" if ranking is None else ranking_table(ranking)),
        ("effects", "Findings", effects_section(view, *found)),
        ("findings", "What it says", _findings(view, judgement)),
        *((f.slug, f.title, figure_section(number, f)) for number, f in enumerate(figures, start=1)),
        ("cells", "Every setting", cells_table(view, judgement)),
        ("comparisons", "Comparisons", comparisons_table(view, judgement)),
        ("consistency", "Consistency", consistency_table(view)),
        ("trials", "The median and the worst trial", examples_section(examples)),
        ("failures", "Trials that broke", failures_table(view)),
        ("again", "To run it again", _again(view)),
    ]
    present = [entry for entry in sections if entry[2]]
    return document(
        title=escape(f"{view.name}: study report"),
        layers="".join(layer_rules(figure) for figure in figures),
        eyebrow=escape(f"pilotage study report · mission {view.mission} · {count(view.row.size)} trials"),
        heading=escape(view.name),
        description=f'<p class="description">{escape(view.question)}</p>' if view.question else "",
        outcome="",
        headline=escape(answer(view, judgement) if ranking is None else ranking_answer(ranking)),
        tiles=tiles(_tiles(view)),
        contents=contents([(slug, title) for slug, title, _ in present]),
        body="\n".join(section for _, _, section in present),
        footer=escape(
            "Made by pilotage from the study's database. Settings are compared on "
            f"{'the same seeds' if view.same_seeds else 'seeds of their own'}; intervals are 95 %."
        ),
    )


def write_page(
    view: StudyView,
    folder: Path,
    examples: tuple[Example, ...] = (),
    ranking: Sequence[Module] | None = None,
    found: tuple[Sequence[Finding], Sequence[Best]] = ((), ()),
) -> Path:
    """Write ``report.html`` into the study's folder in one go and return its path."""
    path = folder / REPORT_FILE
    write_whole(path, study_page(view, examples, ranking, found))
    return path


def judge_view(view: StudyView) -> Judgement:
    """Judge all that the page shows."""
    names = dict.fromkeys([*view.metrics, view.primary, "success"])
    values = {name: view.column(name) for name in names if name in view.values or name in view.metrics}
    values.setdefault(view.primary, view.column(view.primary))
    return judge(view.cell, view.trial, values, view.baselines, view.contrasts, same_seeds=view.same_seeds)


def _findings(view: StudyView, judgement: Judgement) -> str:
    """What each group of settings says beyond the headline, and what one must know to read it."""
    parts = [
        f"{f'<h3>{escape(name)}</h3>' if len(view.groups) > 1 else ''}"
        f"<ul>{''.join(f'<li>{escape(text)}</li>' for text in texts)}</ul>"
        for name, texts in answers(view, judgement)
    ]
    note = f'<p class="note">{escape(view.note)}</p>' if view.note else ""
    if not parts and not note:
        return ""
    head = '<section id="findings"><h2><a href="#findings">What it says</a></h2>'
    return f"{head}{''.join(parts)}{note}</section>"


def _tiles(view: StudyView) -> list[tuple[str, str]]:
    success = view.column("success")
    rated = int(np.isfinite(success).sum())
    entries = [
        ("trials", count(view.row.size)),
        ("settings × trials each", f"{count(len(view.cells))} × {count(view.trials_per_cell)}"),
        *([("succeeded", f"{count(float(np.nansum(success)))} of {count(rated)}")] if rated else []),
        ("broken trials", count(len(view.failures))),
    ]
    return [*entries, ("still to run", count(view.waiting))] if view.waiting else entries


def _again(view: StudyView) -> str:
    last = view.first_seed + view.trials_per_cell - 1
    return (
        '<section id="again"><h2><a href="#again">To run it again</a></h2>'
        f"<p>Seeds {view.first_seed} to {last}, the same in every setting. The folder&#x27;s "
        "<code>study.yaml</code> holds everything that is needed: "
        "<code>pilotage study study.yaml</code>. Any single trial: "
        "<code>pilotage run --from STUDY:ROW</code>, in the folder that holds the study&#x27;s. "
        f"{escape(f'Made with {view.versions}.') if view.versions else ''}</p>"
        f"<details><summary>Show the definition</summary><pre>{escape(view.definition)}</pre></details>"
        "</section>"
    )
