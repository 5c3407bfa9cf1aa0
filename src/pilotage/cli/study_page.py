"""A study's page from its folder: its table, the worst and the median trial run again for pictures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from pilotage.core.whole_file import require_place
from pilotage.experiments.run import run_mission
from pilotage.experiments.studies.attribution import attribution_of, is_attribution
from pilotage.experiments.studies.findings import best_settings, findings_of
from pilotage.experiments.studies.replay import mission_of_row
from pilotage.experiments.studies.table import StudyTable, read_study
from pilotage.report.drawn import picture_of
from pilotage.report.markup import REPORT_FILE
from pilotage.report.page import write_report as write_run_report
from pilotage.report.study.examples import Example, describe, rows_to_show
from pilotage.report.study.page import write_page

TRIALS = "trials"


def write_study_report(
    folder: Path,
    *,
    examples: bool = True,
    on_example: Callable[[str], None] | None = None,
    on_left_out: Callable[[str], None] | None = None,
) -> Path:
    """Write ``report.html`` into a study's folder and return its path.

    Parameters
    ----------
    examples
        Whether the worst and the median trial are run again, into ``trials`` beside the page.
    on_left_out
        Told, a line, of what the page is without, as where the study's plugins are gone.

    Raises
    ------
    InputError
        Where the folder is no study's, or no page can stand there: then no trial is run either.
    """
    table = read_study(folder)
    require_place(folder / REPORT_FILE)
    shown: list[Example] = []
    if table.without and on_left_out is not None:
        on_left_out(f"pictures of trials, and what metrics of plugins mean ({table.without})")
    for title, row in rows_to_show(table) if examples and not table.without else ():
        if on_example is not None:
            on_example(f"{title.lower()}: row {row}, again for its picture")
        shown.append(_example(table, title, row))
    ranking = attribution_of(folder)["modules"] if is_attribution(table.study) else None
    found = ((), ()) if ranking is not None else (findings_of(table), best_settings(table, table.judged()))
    return write_page(table, folder, tuple(shown), ranking, found)


def _example(table: StudyTable, title: str, row: int) -> Example:
    result = run_mission(mission_of_row(table.study, row), out=table.folder / TRIALS)
    assert result.run_dir is not None
    page = write_run_report(result.run_dir)
    picture = picture_of(result.run_dir)
    return Example(
        title,
        row,
        describe(table, row),
        page.relative_to(table.folder).as_posix(),
        f"pilotage run --from {table.folder.resolve().name}:{row}",
        # Identifiers of two pictures of the same kind must not meet on one page.
        picture.svg.replace(f'"{picture.slug}-', f'"row{row}-{picture.slug}-').replace(
            f"#{picture.slug}-", f"#row{row}-{picture.slug}-"
        ),
        "replay-player" in page.read_text("utf-8"),
    )
