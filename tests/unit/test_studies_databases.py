"""Studies whose databases are broken, shared or asked while they run."""

from __future__ import annotations

import os
import re
import shutil
import socket
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
import yaml

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.core.yaml_text import load_yaml
from pilotage.experiments.studies.database import DATABASE
from pilotage.experiments.studies.engine import run_study
from pilotage.experiments.studies.options import StudyOptions
from pilotage.experiments.studies.owners import is_gone
from pilotage.experiments.studies.store import Store
from pilotage.experiments.studies.trial import Outcome
from support.hostile_studies import expected, rows_of, share, study_of
from support.warm_commands import start


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study with every row written, without a run."""
    folder = tmp_path_factory.mktemp("finished") / "x"
    study = study_of(trials=100)
    made = Store(folder, study)
    for task in made.claim(300):
        made.finish(Outcome(task.row, expected(task.row) | {"words": "x" * 60}, {"wall_time_s": 0.1}))
    made.close()
    run_study(study, folder)
    return folder


def test_a_finished_study_leaves_one_file_of_its_rows(finished: Path) -> None:
    """Who copies it takes all of them along."""
    assert [path.name for path in finished.glob(f"{DATABASE}*")] == [DATABASE]


def spoil(how: str, content: bytearray) -> bytes:
    """Break a database's bytes."""
    middle = len(content) // 2
    if how == "truncated":
        return bytes(content[:middle])
    if how == "page":
        return bytes(content[: middle + 1] + os.urandom(4096) + content[middle + 4097 :])
    if how == "header":
        return os.urandom(100) + bytes(content[100:])
    if how == "first page":
        return bytes(4096) + bytes(content[4096:])
    if how == "digit":
        place = content.rindex(b"planned_length_m") + 19
        content[place] = ord("7") if content[place] != ord("7") else ord("8")
        return bytes(content)
    return b"" if how == "empty" else os.urandom(len(content))


@pytest.mark.parametrize(
    ("how", "at_least"),
    [
        ("truncated", 40),
        ("page", 200),
        ("header", 0),
        ("first page", 0),
        ("digit", 299),
        ("empty", 0),
        ("noise", 0),
    ],
)
def test_a_broken_database_is_told_in_one_line_and_what_is_left_is_exported(
    finished: Path, tmp_path: Path, how: str, at_least: int, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "x"
    shutil.copytree(finished, folder)
    database = folder / DATABASE
    database.write_bytes(spoil(how, bytearray(database.read_bytes())))
    broken = database.read_bytes()
    for _ in range(2):
        assert main(["study", str(folder), "--resume", "--no-report", "--workers", "1"]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert f"{DATABASE}: corrupt database (" in line
        assert "trials-salvaged.csv" in line
        saved = (folder / "trials-salvaged.csv").read_text(encoding="utf-8").splitlines()
        assert f"; {max(len(saved) - 1, 0)} of 300 finished trials could be read" in line
        assert at_least <= max(len(saved) - 1, 0) <= 300 - (how in {"truncated", "page", "digit"})
    assert database.read_bytes() == broken  # nothing was made worse
    if at_least:
        header = saved[0].split(",")
        for entry in saved[1:]:
            row = dict(zip(header, entry.split(","), strict=True))
            assert float(row["planned_length_m"]) == expected(int(row["row"]))["planned_length_m"]


def test_a_row_that_nothing_made_leaves_no_log(finished: Path, tmp_path: Path) -> None:
    """The error held a cursor on its way, that the database, and that its log until it was collected."""
    folder = tmp_path / "x"
    shutil.copytree(finished, folder)
    with closing(sqlite3.connect(folder / DATABASE)) as database:
        database.execute("update trials set status = 'x'")
        database.commit()
    before = {path.name for path in folder.iterdir()}
    with pytest.raises(InputError, match="row 0 neither waits nor runs"):
        run_study(study_of(trials=100), folder, StudyOptions(workers=1, resume=True))
    assert {path.name for path in folder.iterdir()} - before == {"trials-salvaged.csv"}


@pytest.mark.parametrize(
    ("essence", "told"),
    [
        ("1.5", "what its rows were made from is not told"),
        ("[]", "what its rows were made from is not told"),
        ("{", "JSON"),
        ('{"mission": {"plugins": [3, null]}, "files": {}}', "another definition|found them changed"),
    ],
)
def test_rows_that_were_made_from_nothing_are_told_in_one_line(
    finished: Path, tmp_path: Path, essence: str, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """``run --from`` and ``--resume`` ended in a traceback."""
    folder = tmp_path / "x"
    shutil.copytree(finished, folder)
    with closing(sqlite3.connect(folder / DATABASE)) as database:
        database.execute("update meta set value = ? where key = 'essence'", (essence,))
        database.execute("update meta set value = 'x' where key = 'digest'")
        database.commit()
    for words in (["run", "--from", f"{folder}:1"], ["study", str(folder), "--resume", "--no-report"]):
        assert main([*words, "--quiet"]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert re.search(told, line)


def test_a_definition_with_fewer_settings_than_its_trials_is_told_in_one_line(
    finished: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "x"
    shutil.copytree(finished, folder, ignore=shutil.ignore_patterns("report.html"))
    definition = folder / "study.yaml"
    tree = load_yaml(definition.read_text(encoding="utf-8"), "")
    del tree["factors"][0]["values"][1:]
    definition.write_text(yaml.safe_dump(tree), encoding="utf-8")
    assert main(["report", str(folder)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "expected trials of the 1 settings of study.yaml, found row 1 of setting 1" in line
    assert not (folder / "report.html").exists()


def test_the_database_of_something_else_is_left_alone(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / DATABASE) as other:
        other.execute("create table recipes (name text)")
    other.close()
    with pytest.raises(InputError, match="other tables"):
        run_study(study_of(), tmp_path)


def test_many_processes_that_begin_at_once_share_every_row_once(tmp_path: Path) -> None:
    go = tmp_path / "go"
    crew = [start(tmp_path / f"{k}", share, tmp_path / "x", go, folder=tmp_path) for k in range(3)]
    for process in crew:
        assert process.line(0) == "here\n"
    go.touch()
    done = [process.ended() for process in crew]
    assert [(process.returncode, process.stderr) for process in done] == [(0, "")] * 3
    claimed = [int(line) for process in done for line in process.stdout.split()[1:]]
    assert sorted(claimed) == list(range(18))
    assert [row["status"] for row in rows_of(tmp_path / "x")] == ["done"] * 18


def test_a_slow_process_of_this_machine_keeps_its_rows() -> None:
    here, now_s = socket.gethostname(), time.time()
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    assert not is_gone(here, os.getpid(), now_s - 120.0), "it may be starved or suspended"
    assert is_gone(here, ended.pid, now_s)
    assert is_gone(here, os.getpid(), now_s - 3600.0), "a number that another process has by now"
    assert is_gone("elsewhere", os.getpid(), now_s - 120.0)
    assert not is_gone("elsewhere", ended.pid, now_s)


def test_it_can_be_queried_while_it_runs(order: Callable[..., None], tmp_path: Path) -> None:
    order()
    database, errors, counted, done = tmp_path / "x" / DATABASE, [], [], threading.Event()

    def ask() -> None:
        while not done.is_set():
            if database.exists():
                try:
                    with sqlite3.connect(database) as connection:
                        counted.append(connection.execute("select count(*) from trials").fetchone()[0])
                    connection.close()
                except sqlite3.Error as error:
                    errors.append(error)

    asking = [threading.Thread(target=ask) for _ in range(2)]
    for thread in asking:
        thread.start()
    try:
        counts = run_study(study_of(trials=100), tmp_path / "x", StudyOptions(workers=2))
    finally:
        done.set()
        for thread in asking:
            thread.join()
    assert counts.done == 300
    assert not errors
    assert set(counted) == {300}  # never half a database
    assert len(counted) > 50
