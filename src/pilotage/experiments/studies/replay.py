"""One trial of a study again, alone: the same numbers, with trace and run folder."""

from __future__ import annotations

from pathlib import Path

from pilotage.core.errors import InputError
from pilotage.core.whole_number import whole_number
from pilotage.experiments.studies.database import DATABASE
from pilotage.experiments.studies.rows import read_essence
from pilotage.experiments.studies.study import Study, changes_told, is_made_from, load_study
from pilotage.experiments.studies.trial import TrialRunner
from pilotage.missions.mission import Mission

STUDIES = Path("studies")


def parse_row(text: str) -> tuple[Path, int]:
    """Folder and row of ``STUDY:ROW``; the study by its folder or its name under ``studies``.

    Raises
    ------
    InputError
        If the text is not of that form, or there is no such folder.
    """
    name, colon, row = text.rpartition(":")
    number = whole_number(row)
    if not colon or number is None or not name:
        raise InputError(f"--from '{text}': expected STUDY:ROW such as museum-noise:17")
    for folder in (Path(name), STUDIES / name):
        if folder.is_dir():
            return folder, number
    raise InputError(f"--from '{text}': expected a study's folder or its name under {STUDIES}, found neither")


def mission_of_row(study: Study, row: int) -> Mission:
    """The mission that a row ran.

    Raises
    ------
    InputError
        Where the study has no such row.
    """
    if not 0 <= row < study.rows:
        raise InputError(f"study '{study.name}': expected a row from 0 to {study.rows - 1}, found {row}")
    cell, _ = study.place(row)
    return TrialRunner(study.base).mission(study.cells[cell].overrides, study.seed(row))


def mission_from(text: str) -> Mission:
    """The mission of ``STUDY:ROW``, as the study that is there ran it.

    Raises
    ------
    InputError
        If there is no such study or row, or its files are not those that its rows were made from.
    """
    folder, row = parse_row(text)
    study = load_study(str(folder.resolve()))
    made_from = read_essence(folder / DATABASE)
    if made_from is not None and not is_made_from(study, made_from):
        raise InputError(
            f"--from '{text}': expected the files that the study was made from, found them changed "
            f"({changes_told(made_from, study)}); no row can be run again as it was"
        )
    return mission_of_row(study, row)
