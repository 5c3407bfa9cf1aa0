"""What a folder is, told by the names in it alone: cheap, so that a wrong one is refused before all else."""

from __future__ import annotations

from pathlib import Path

from pilotage.core.errors import InputError

STUDY_FILE = "study.yaml"


def is_study_folder(name_or_path: str) -> bool:
    """Whether that is the folder of a study that was begun."""
    return (Path(name_or_path) / STUDY_FILE).is_file()


def check_folder(folder: Path) -> None:
    """Whether there is a folder at all.

    Raises
    ------
    InputError
        Where there is a file, or nothing.
    """
    if not folder.is_dir():
        raise InputError(
            f"{folder}: expected a run folder, found {'a file' if folder.exists() else 'nothing'}"
        )
