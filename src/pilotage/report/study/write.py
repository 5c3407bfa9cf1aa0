"""From a study's folder to its page, with the worst and the median trial run again for their pictures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from pilotage.experiments.run import run_mission
from pilotage.experiments.studies.replay import mission_of_row
from pilotage.experiments.studies.study import study_yaml
from pilotage.experiments.studies.table import StudyTable, read_study
from pilotage.report.page import FIGURES, FLOOR_FIGURES
from pilotage.report.page import write_report as write_run_report
from pilotage.report.run_folder import read_run
from pilotage.report.study.examples import Example, describe, rows_to_show
from pilotage.report.study.page import write_page
from pilotage.report.study.view import Cell, Failure, StudyView
from pilotage.report.style import drawing_style

TRIALS = "trials"


def write_study_report(
    folder: Path, *, examples: bool = True, on_example: Callable[[str], None] | None = None
) -> Path:
    """Write ``report.html`` into a study's folder and return its path.

    Parameters
    ----------
    examples
        Whether the worst and the median trial are run again, into ``trials`` beside the page.

    Raises
    ------
    InputError
        Where the folder is no study's.
    """
    table = read_study(folder)
    view = view_of(table)
    shown: list[Example] = []
    for title, row in rows_to_show(view) if examples else ():
        if on_example is not None:
            on_example(f"{title.lower()}: row {row}, again for its picture")
        shown.append(_example(table, view, title, row))
    return write_page(view, folder, tuple(shown))


def view_of(table: StudyTable) -> StudyView:
    """The study as its page sees it."""
    study, definition = table.study, table.study.definition
    return StudyView(
        name=study.name,
        question=definition.question or definition.description,
        mission=str(study.base.get("mission", definition.mission)),
        cells=tuple(Cell(c.index, c.name, c.values, c.published) for c in study.cells),
        factors=definition.factor_names,
        metrics=table.metrics,
        primary=table.primary,
        lower_is_better=definition.lower_is_better,
        baseline=table.baseline,
        reference={
            key: (f"{entry.name}, {entry.value:g}", entry.value)
            for key, entry in definition.reference.items()
        },
        trials_per_cell=definition.trials,
        first_seed=definition.seeds.first,
        row=table.row,
        cell=table.cell,
        trial=table.trial,
        seed=table.seed,
        values=table.values,
        failures=tuple(Failure(*entry) for entry in table.broken),
        waiting=table.waiting,
        definition=study_yaml(study),
    )


def _example(table: StudyTable, view: StudyView, title: str, row: int) -> Example:
    result = run_mission(mission_of_row(table.study, row), out=table.folder / TRIALS)
    assert result.run_dir is not None
    page = write_run_report(result.run_dir)
    run = read_run(result.run_dir)
    with drawing_style():
        picture = FIGURES.get(run.kind, FLOOR_FIGURES)[0](run)
    return Example(
        title,
        row,
        describe(view, row),
        page.relative_to(table.folder).as_posix(),
        f"pilotage run --from {table.folder}:{row}",
        # Identifiers of two pictures of the same kind must not meet on one page.
        picture.svg.replace(f'"{picture.slug}-', f'"row{row}-{picture.slug}-').replace(
            f"#{picture.slug}-", f"#row{row}-{picture.slug}-"
        ),
    )
