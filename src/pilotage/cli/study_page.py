"""A study's page from its folder: its table, the worst and the median trial run again for pictures."""

from __future__ import annotations

import platform
from collections.abc import Callable
from importlib import metadata
from pathlib import Path

from pilotage import __version__
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.run import run_mission
from pilotage.experiments.studies.attribution import attribution_of, is_attribution
from pilotage.experiments.studies.cells import show
from pilotage.experiments.studies.definition import CONFIGURATION
from pilotage.experiments.studies.factors import Factor
from pilotage.experiments.studies.replay import mission_of_row
from pilotage.experiments.studies.study import study_yaml
from pilotage.experiments.studies.table import StudyTable, read_study
from pilotage.records.run_data import read_run
from pilotage.report.drawn import map_of
from pilotage.report.page import write_report as write_run_report
from pilotage.report.study.examples import Example, describe, rows_to_show
from pilotage.report.study.page import write_page
from pilotage.report.study.scales import key_and_unit
from pilotage.report.study.view import Cell, Failure, Group, StudyView
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
    ranking = attribution_of(folder)["modules"] if is_attribution(table.study) else None
    return write_page(view, folder, tuple(shown), ranking)


def view_of(table: StudyTable) -> StudyView:
    """The study as its page sees it."""
    study, definition = table.study, table.study.definition
    return StudyView(
        name=study.name,
        question=definition.question or definition.description,
        note=definition.description if definition.question else "",
        mission=str(study.base.get("mission", definition.mission)),
        cells=tuple(
            Cell(c.index, c.name, c.values, c.published, label)
            for c, label in zip(study.cells, labels(table), strict=True)
        ),
        factors=definition.factor_names,
        metrics=table.metrics,
        primary=table.primary,
        lower_is_better=METRICS.find(table.primary).less_is_better is not False
        if definition.lower_is_better is None
        else definition.lower_is_better,
        asked=bool(definition.metrics),
        same_seeds=table.same_seeds,
        groups=tuple(Group(group.name, group.cells, group.baselines) for group in table.groups),
        contrasts=table.contrasts,
        units={factor.title: unit_of(factor) for factor in definition.factors},
        versions=versions(),
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


def unit_of(factor: Factor) -> str:
    """The unit of a factor's values; none where they multiply, or are of several kinds."""
    found = {key_and_unit(key)[1] for key in factor.keys}
    return found.pop() if len(found) == 1 and not factor.multiply else ""


def labels(table: StudyTable) -> list[str]:
    """How each cell is called on the page: values with their units, what a whole group shares left out."""
    study = table.study
    factors = {factor.title: factor for factor in study.definition.factors}
    out = []
    for cell in study.cells:
        words = [str(cell.values[CONFIGURATION])] if CONFIGURATION in cell.values else []
        for title, value in cell.values.items():
            if title not in factors:
                continue
            unit = unit_of(factors[title])
            after = f"\u00a0{unit}" if unit else ""
            named = factors[title].levels is not None or isinstance(value, str)
            words.append(str(value) if named else f"{key_and_unit(title)[0]} {show(value)}{after}")
        out.append(", ".join(words) or cell.name)
    for group in table.groups:
        parts = [out[index].split(", ") for index in group.cells]
        while min(map(len, parts)) >= 1 and max(map(len, parts)) > 1 and len({p[0] for p in parts}) == 1:
            if min(map(len, parts)) == 1:
                # The one that is nothing but what all share keeps its name.
                parts = [p if len(p) == 1 else p[1:] for p in parts]
                break
            parts = [p[1:] for p in parts]
        for index, part in zip(group.cells, parts, strict=True):
            out[index] = ", ".join(part)
    return out


def versions() -> str:
    """What made the rows and the page: releases of pilotage and of what its numbers come from."""
    names = ("numpy", "scipy", "numba")
    parts = [f"pilotage {__version__}", f"Python {platform.python_version()}"]
    return ", ".join([*parts, *(f"{name} {metadata.version(name)}" for name in names)])


def _example(table: StudyTable, view: StudyView, title: str, row: int) -> Example:
    result = run_mission(mission_of_row(table.study, row), out=table.folder / TRIALS)
    assert result.run_dir is not None
    page = write_run_report(result.run_dir)
    run = read_run(result.run_dir)
    with drawing_style():
        picture = map_of(run)
    return Example(
        title,
        row,
        describe(view, row),
        page.relative_to(table.folder).as_posix(),
        f"pilotage run --from {table.folder.resolve().name}:{row}",
        # Identifiers of two pictures of the same kind must not meet on one page.
        picture.svg.replace(f'"{picture.slug}-', f'"row{row}-{picture.slug}-').replace(
            f"#{picture.slug}-", f"#row{row}-{picture.slug}-"
        ),
        "replay-player" in page.read_text("utf-8"),
    )
