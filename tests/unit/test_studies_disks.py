"""Studies on disks that are full."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from pilotage.cli.main import main
from pilotage.experiments.studies import store
from pilotage.experiments.studies.database import DATABASE
from pilotage.experiments.studies.engine import Listener, run_study
from pilotage.experiments.studies.options import StudyOptions
from support.hostile_studies import expected, rows_of, study_of


def more_room(place: Path) -> None:
    subprocess.run(["mount", "-o", "remount,size=20m", str(place)], check=True)


@pytest.mark.parametrize("size", ["40k", "140k"])
def test_a_full_disk_stops_it_in_one_line_and_resume_finishes(
    order: Callable[..., None],
    small_disk: Callable[[str], Path],
    size: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Full while it is begun, and later."""
    order()
    monkeypatch.setattr(store, "FULL_PAUSE_S", 0.05)
    disk = small_disk(size)
    sweep = ["sweep", "museum-plan", "--vary", "stack.planner.turning_radius_m=0.3,0.5,0.8", "--trials", "30"]
    sweep += ["--name", "x", "--workers", "1", "--no-report", "--out", str(disk)]
    assert main([*sweep, "--quiet"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "make room and go on with --resume" in line
    if (disk / "x" / DATABASE).is_file():
        rows = rows_of(disk / "x")
        assert {row["status"] for row in rows} <= {"pending", "running", "done"}
        assert all(row["metrics"] == expected(row["row"]) for row in rows if row["status"] == "done")
    more_room(disk)
    assert main([*sweep, "--resume"]) == 0
    rows = rows_of(disk / "x")
    assert [row["metrics"] for row in rows] == [expected(row) for row in range(90)]
    assert {row["attempts"] for row in rows} == {1}


def test_a_disk_that_is_full_for_a_moment_is_tried_once_more(
    order: Callable[..., None], small_disk: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    order()
    monkeypatch.setattr(store, "FULL_PAUSE_S", 0.3)
    disk = small_disk("140k")
    told: list[str] = []

    def tell(line: str) -> None:
        told.append(line)
        more_room(disk)

    assert (
        run_study(study_of(trials=30), disk / "x", StudyOptions(workers=1), Listener(trouble=tell)).done == 90
    )
    assert len(told) == 1
    assert "(database or disk is full); trying once more" in told[0]


def test_finished_trials_whose_exports_find_no_room_are_told(
    order: Callable[..., None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def no_room(folder: Path) -> list[Path]:
        raise OSError(28, "No space left on device", str(folder))

    order()
    monkeypatch.setattr("pilotage.experiments.studies.export.export", no_room)
    sweep = ["sweep", "museum-plan", "--vary", "stack.planner.turning_radius_m=0.3", "--trials", "1"]
    assert main([*sweep, "--name", "x", "--workers", "1", "--out", str(tmp_path), "--quiet"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "all trials are finished, but their exports cannot be written (No space left on device)" in line


def test_a_folder_that_cannot_be_written_is_one_line(
    order: Callable[..., None],
    small_disk: Callable[[str], Path],
    capsys: pytest.CaptureFixture[str],
) -> None:
    order()
    disk = small_disk("20m")
    sweep = ["sweep", "museum-plan", "--vary", "stack.planner.turning_radius_m=0.3,0.5", "--trials", "1"]
    sweep += ["--workers", "1", "--no-report", "--out", str(disk / "Übung mit Raum"), "--quiet"]
    assert main([*sweep, "--name", "x"]) == 0
    subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
    for name in ("x", "y"):
        assert main([*sweep, "--name", name]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "read-only" in line or "readonly" in line or "cannot be written" in line or "Read-only" in line
    # What is in it can still be read and run again.
    assert len(rows_of(disk / "Übung mit Raum" / "x")) == 2
