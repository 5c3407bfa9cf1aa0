"""Definitions and databases that hold what a file can hold: one line each, and no folder."""

from __future__ import annotations

import os
import shutil
import sqlite3
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import pytest

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.experiments.studies import engine
from pilotage.experiments.studies.database import DATABASE, CorruptDatabaseError
from pilotage.experiments.studies.engine import run_study
from pilotage.experiments.studies.options import StudyOptions
from pilotage.experiments.studies.rows import read_rows
from pilotage.experiments.studies.store import Store
from support.hostile_studies import study_of

HEAD = "study: x\nmission: museum-plan\n"
RADIUS = "{key: stack.planner.turning_radius_m, name: f%d, values: [0.%d]}"
BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{letter}: &{letter} [{', '.join([f'*{before}'] * 9)}]\n"
    for before, letter in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (HEAD + BOMB, "expected at most"),
        (f"{HEAD}set: {'{a: ' * 3000}1{'}' * 3000}\n", "deep inside one another"),
        (f"{HEAD}set: &a {{b: *a}}\n", "inside itself"),
        (f"{HEAD}factors: [{', '.join(RADIUS % (i, i + 1) for i in range(2000))}]\n", "found 2000"),
        (
            f"{HEAD}factors: [{{key: run.dt_s, values: [{', '.join(f'{i}.5' for i in range(20_000))}]}}]\n",
            "expected at most 10000 values, found 20000",
        ),
        (f"{HEAD}factors: [{{key: run.dt_s, range: {{start: 0, stop: 1, step: 1e-9}}}}]\n", "at most 10000"),
        (f"{HEAD}trials: 9999999\n", "rows"),
        ("study: x\nmission: one.yaml\n", "cannot extend itself"),
    ],
    ids=["bomb", "deep", "self", "factors", "values", "range", "rows", "extends"],
)
def test_a_definition_that_swells_is_one_line(
    text: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("one.yaml").write_text("extends: two.yaml\nmission: a\n")
    Path("two.yaml").write_text("extends: one.yaml\nmission: b\n")
    Path("study.yaml").write_text(text)
    assert main(["study", "study.yaml", "--out", "out"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert told in line
    assert len(line) < 1500
    assert not Path("out").exists()


@pytest.mark.parametrize("how", ["loop", "pipe", "device", "folder"])
def test_what_is_no_file_is_not_read(how: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for path in (tmp_path / "study.yaml", tmp_path / "x" / DATABASE):
        path.parent.mkdir(exist_ok=True)
        if how == "loop":
            path.symlink_to(path)
        elif how == "pipe":
            os.mkfifo(path)
        elif how == "device":
            path.symlink_to("/dev/zero")
        else:
            path.mkdir()
    assert main(["study", str(tmp_path / "study.yaml"), "--out", str(tmp_path)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    with pytest.raises(InputError, match="expected a study's database, found"):
        Store(tmp_path / "x", study_of())


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        ("update trials set status = 'weird' where row = 4", "row 4 neither waits nor runs nor is finished"),
        ("update trials set attempts = 'x', status = 'pending' where row = 4", "row 4 neither waits nor"),
        ("update trials set cell = 99, status = 'pending' where row = 4", "row 4 is not what was written"),
        ("update trials set seed = -1, status = 'pending' where row = 4", "row 4 is not what was written"),
        ("update trials set row = 99, status = 'pending' where row = 4", "row 99 is not what was written"),
        ("delete from trials where row = 4", "17 of 18 rows are there"),
    ],
)
def test_a_row_that_nobody_made_is_told_and_not_waited_for(
    damage: str,
    told: str,
    finished_study: Path,
    order: Callable[..., None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    order()
    shutil.copytree(finished_study, tmp_path / "study")
    _change(tmp_path / "study", damage)
    _never_waits(monkeypatch)
    before = {path.name for path in (tmp_path / "study").iterdir()}
    assert f"{DATABASE}-wal" not in before
    with pytest.raises(CorruptDatabaseError, match=told):
        run_study(study_of(), tmp_path / "study", StudyOptions(workers=1, resume=True))
    read_rows(tmp_path / "study" / DATABASE)
    assert {path.name for path in (tmp_path / "study").iterdir()} - before <= {"trials-salvaged.csv"}


@pytest.mark.parametrize(
    "owner",
    [
        "",
        "insert into owners values ('ghost', 'elsewhere', 7, 1e18)",
        "insert into owners values ('ghost', 'elsewhere', 'pid', 'soon')",
        "insert into owners select 'ghost', host, 1180591620717411303424, heard_s from owners union "
        "select 'ghost', 'elsewhere', 1e300, 1e300 limit 1",
    ],
    ids=["nobody", "from the future", "no numbers", "no process"],
)
def test_a_claim_of_nobody_is_free(
    owner: str,
    finished_study: Path,
    order: Callable[..., None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    order()
    shutil.copytree(finished_study, tmp_path / "study")
    _change(
        tmp_path / "study", f"update trials set status = 'running', owner = 'ghost' where row = 4; {owner}"
    )
    _never_waits(monkeypatch)
    counts = run_study(study_of(), tmp_path / "study", StudyOptions(workers=1, resume=True))
    assert (counts.done, counts.failed) == (18, 0)


def _change(folder: Path, statements: str) -> None:
    with closing(sqlite3.connect(folder / DATABASE)) as database:
        database.executescript(statements)


def _never_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody else is at work: to wait for another process would be without end."""

    def waits(_: float) -> None:
        raise AssertionError("it waits for nobody")

    monkeypatch.setattr(engine, "time", SimpleNamespace(monotonic=time.monotonic, sleep=waits))
