"""Studies where everything goes wrong: workers killed, disks full, databases broken, files changed."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from pilotage.cli.main import main
from pilotage.core.config import validate
from pilotage.core.errors import InputError
from pilotage.experiments.studies import engine, local_workers, store
from pilotage.experiments.studies.database import DATABASE, StudyStoppedError
from pilotage.experiments.studies.definition import StudyDefinition
from pilotage.experiments.studies.engine import run_study
from pilotage.experiments.studies.rows import read_rows
from pilotage.experiments.studies.store import Store
from pilotage.experiments.studies.study import Study, make_study
from pilotage.experiments.studies.trial import Outcome
from support import hostile_trials

TESTS = Path(__file__).parents[1]
RADII = (0.3, 0.5, 0.8)


def study_of(**changes: Any) -> Study:
    """Three radii, some seeds; what its trials give is told by ``hostile_trials``."""
    values: dict[str, Any] = {
        "study": "hostile",
        "mission": "museum-plan",
        "factors": [{"key": "stack.planner.turning_radius_m", "values": list(RADII)}],
        "trials": 6,
    }
    return make_study(validate(StudyDefinition, values | changes, ""))


def expected(row: int) -> dict[str, float]:
    """What a row gives that was let alone."""
    return {"planned_length_m": 1000.0 * RADII[row % 3] + row // 3}


def rows_of(folder: Path) -> list[dict[str, Any]]:
    rows, trouble = read_rows(folder / DATABASE)
    assert not trouble
    return rows


@pytest.fixture
def order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Give rows their orders."""
    marks = tmp_path / "marks"
    marks.mkdir()
    monkeypatch.setenv(hostile_trials.MARKS, str(marks))
    monkeypatch.setattr(local_workers, "_work", hostile_trials.work)

    def give(*orders: str) -> None:
        monkeypatch.setenv(hostile_trials.ORDERS, ",".join(orders))

    give()
    return give


# --- workers and trials -----------------------------------------------------------------------------


def test_what_breaks_is_tried_once_more_then_failed_with_its_reason(
    order: Callable[..., None], tmp_path: Path
) -> None:
    order("0:kill", "2:segv", "5:sysexit", "6:memory", "8:full", "9:bug", "11:deep", "13:kill-once")
    told: list[str] = []
    folder = tmp_path / "study"
    counts = run_study(study_of(), folder, workers=2, on_trouble=told.append)
    assert (counts.total, counts.done, counts.failed) == (18, 11, 7)
    rows = rows_of(folder)
    reasons = {row["row"]: row["reason"] for row in rows if row["status"] == "failed"}
    assert reasons.pop(11).startswith("RecursionError: maximum recursion depth")
    assert reasons == {
        0: "its worker died (signal 9)",
        2: "its worker died (signal 11)",
        5: "its worker died (exit code 4)",
        6: "MemoryError",
        8: "disk full: /somewhere/trace.parquet",
        9: "ZeroDivisionError: a bug",
    }
    for row in rows:
        hit = row["row"] in {0, 2, 5, 6, 8, 9, 11, 13}
        assert row["attempts"] == (2 if hit else 1)
        if row["status"] == "done":
            assert row["metrics"] == expected(row["row"])
    ran = [name.name.split("-")[0] for name in (tmp_path / "marks").iterdir()]
    assert max(ran.count(str(row)) for row in range(18)) == 2
    assert "row 0: its worker died (signal 9); tried once more" in told
    assert "row 0: its worker died (signal 9); given up" in told
    assert sum(line.startswith("row 13:") for line in told) == 1


def test_workers_that_cannot_begin_stop_the_study_and_blame_no_trial(
    order: Callable[..., None], tmp_path: Path
) -> None:
    order("unborn")
    with pytest.raises(StudyStoppedError, match=r"exit code 7.*--resume"):
        run_study(study_of(), tmp_path / "study", workers=2)
    assert {(row["status"], row["attempts"]) for row in rows_of(tmp_path / "study")} == {("pending", 0)}
    order()
    assert run_study(study_of(), tmp_path / "study", workers=1, resume=True).done == 18


def test_a_trial_that_may_hang_is_told_with_what_ends_it(
    order: Callable[..., None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    order("4:slow")
    monkeypatch.setattr(engine, "HEAR_EVERY_S", 0.1)
    monkeypatch.setattr(engine, "LONG_S", 0.5)
    told: list[str] = []

    def tell(line: str) -> None:
        told.append(line)
        if "has run for" in line:
            os.kill(int(line.rsplit("kill -9 ", 1)[1].split("'")[0]), signal.SIGKILL)

    counts = run_study(study_of(), tmp_path / "study", workers=2, on_trouble=tell)
    assert (counts.done, counts.failed) == (17, 1)
    assert rows_of(tmp_path / "study")[4]["reason"] == "its worker died (signal 9)"
    assert sum(line.startswith("row 4 has run for ") for line in told) == 2


def test_the_command_says_how_many_failed(
    order: Callable[..., None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    order("1:kill", "3:bug")
    monkeypatch.chdir(tmp_path)
    sweep = ["sweep", "museum-plan", "--vary", "stack.planner.turning_radius_m=0.3,0.5", "--trials", "3"]
    assert main([*sweep, "--name", "x", "--workers", "1", "--no-report", "--json"]) == 1
    out, err = capsys.readouterr()
    assert json.loads(out)["failed"] == 2
    assert err.splitlines()[-1].startswith("pilotage: 2 of 6 trials failed; their reasons are in studies/x/")
    assert "ZeroDivisionError: a bug" in (tmp_path / "studies/x/trials.csv").read_text(encoding="utf-8")


def test_a_thousand_troubles_are_not_a_thousand_lines(
    order: Callable[..., None], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    order(*(f"{row}:bug" for row in range(40)))
    sweep = ["sweep", "museum-plan", "--vary", "stack.planner.turning_radius_m=0.3", "--trials", "40"]
    assert main([*sweep, "--name", "x", "--workers", "1", "--no-report", "--out", str(tmp_path)]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 22
    assert lines[-1].startswith("pilotage: 40 of 40 trials failed")


def test_every_trial_failed_is_still_a_study_with_a_page(
    order: Callable[..., None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    order("0:bug", "1:bug")
    monkeypatch.chdir(tmp_path)
    sweep = ["sweep", "museum-plan", "--vary", "stack.planner.turning_radius_m=0.3,0.5", "--trials", "1"]
    assert main([*sweep, "--name", "x", "--workers", "1"]) == 1
    page = tmp_path / "studies/x/report.html"
    assert "ZeroDivisionError: a bug" in page.read_text(encoding="utf-8")
    page.unlink()
    assert main(["report", "studies/x"]) == 0
    assert page.is_file()


class LostClient:
    """A Dask client whose scheduler is gone: it raises what the real one does, not even an Exception."""

    def nthreads(self) -> dict[str, int]:
        raise asyncio.CancelledError("scheduler-connection-lost")

    def submit(self, *_: Any, **__: Any) -> None:
        raise RuntimeError("Cannot schedule new futures after shutdown")

    def cancel(self, *_: Any) -> None:
        raise AssertionError("there is nobody to cancel anything")

    def close(self) -> None:
        raise OSError("closed")


def test_a_cluster_that_is_lost_stops_the_study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    distributed = pytest.importorskip("distributed", reason="needs the extra cluster")
    monkeypatch.setattr(distributed, "Client", lambda *_, **__: LostClient())
    sweep = ["sweep", "museum-plan", "--vary", "stack.planner.turning_radius_m=0.3", "--trials", "1"]
    assert main([*sweep, "--name", "x", "--out", str(tmp_path), "--dask", "tcp://host:1", "--quiet"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "--dask tcp://host:1: the cluster is lost (scheduler-connection-lost); go on with --resume" in line
    assert rows_of(tmp_path / "x")[0]["status"] == "pending"


# --- signals ----------------------------------------------------------------------------------------

SLOW = f"""
import sys
sys.path.insert(0, {str(TESTS)!r})
from support import hostile_trials
from pilotage.experiments.studies import local_workers
from pilotage.cli.main import main
if __name__ == "__main__":
    local_workers._work = hostile_trials.work
    sys.argv[1:] = ["sweep", "museum-plan", "--vary", "stack.planner.turning_radius_m=0.3,0.5,0.8",
                    "--trials", "6", "--name", "x", "--no-report", *sys.argv[1:]]
    sys.exit(main())
"""


def descendants(pid: int) -> set[int]:
    """All processes of a session but its leader that still run."""
    found = set()
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rsplit(")", 1)[1].split()
            except OSError:
                continue
            if int(fields[3]) == pid and fields[0] != "Z" and int(entry.name) != pid:
                found.add(int(entry.name))
    return found


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc to see what still runs")
@pytest.mark.parametrize(
    ("sent", "group", "code", "told"),
    [
        ((signal.SIGINT,), True, 130, "pilotage: stopped; go on with --resume, what is finished is in "),
        ((signal.SIGINT,), False, 130, "pilotage: stopped; go on with --resume, what is finished is in "),
        ((signal.SIGINT, signal.SIGINT), True, 130, "pilotage: stopped; go on with --resume, what is"),
        ((signal.SIGTERM,), True, 143, "pilotage: ended by SIGTERM; go on with --resume, what is finished"),
        ((signal.SIGKILL,), False, -9, ""),
    ],
)
def test_a_signal_ends_it_within_seconds_without_orphans(
    order: Callable[..., None], tmp_path: Path, sent: tuple[int, ...], group: bool, code: int, told: str
) -> None:
    order("4:slow")
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            SLOW,
            "--out",
            str(tmp_path),
            "--workers",
            "2" if sent[0] == signal.SIGINT else "1",
        ],
        start_new_session=True,
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    marks = tmp_path / "marks"
    until = time.monotonic() + 60.0
    while not list(marks.glob("4-*")):
        assert time.monotonic() < until
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)
    began = time.monotonic()
    for number in sent:
        if group:
            os.killpg(process.pid, number)
        else:
            os.kill(process.pid, number)
        time.sleep(0.01)
    _, err = process.communicate(timeout=30)
    assert process.returncode == code
    assert err.splitlines()[-1:] == ([] if not told else err.splitlines()[:1])  # one line, no traceback
    assert err.startswith(told)
    while descendants(process.pid) and time.monotonic() < began + 5.0:
        time.sleep(0.01)
    assert not descendants(process.pid)
    assert time.monotonic() < began + 5.0
    rows = rows_of(tmp_path / "x")
    assert rows[4]["status"] == ("running" if code == -9 else "pending")
    if code != -9:
        assert {(row["status"], row["attempts"]) for row in rows} <= {("done", 1), ("pending", 0)}
    if len(sent) > 1 or sent[0] == signal.SIGTERM:
        return
    order()
    sweep = ["sweep", "museum-plan", "--vary", "stack.planner.turning_radius_m=0.3,0.5,0.8", "--trials", "6"]
    sweep += ["--name", "x", "--workers", "1", "--no-report", "--out", str(tmp_path), "--resume"]
    assert main([*sweep, "--quiet"]) == 0
    assert [row["metrics"] for row in rows_of(tmp_path / "x")] == [expected(row) for row in range(18)]
    assert {row["attempts"] for row in rows_of(tmp_path / "x")} == {1}


# --- the disk ---------------------------------------------------------------------------------------


@pytest.fixture
def small_disk() -> Iterator[Callable[[str], Path]]:
    """Disks of their own, of some kilobytes."""
    made: list[Path] = []

    def mount(size: str) -> Path:
        place = Path(tempfile.mkdtemp(prefix="pilotage-disk-"))
        ran = subprocess.run(
            ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place)],
            capture_output=True,
            check=False,
        )
        if ran.returncode != 0:
            place.rmdir()
            pytest.skip("cannot mount a small disk here")
        made.append(place)
        return place

    if shutil.which("mount") is None:
        pytest.skip("no mount here")
    yield mount
    for place in made:
        subprocess.run(["umount", "-l", str(place)], check=True)
        place.rmdir()


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
    sweep += ["--name", "x", "--workers", "1", "--no-report", "--out", str(disk), "--resume"]
    assert main([*sweep, "--quiet"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "make room and go on with --resume" in line
    if (disk / "x" / DATABASE).is_file():
        rows = rows_of(disk / "x")
        assert {row["status"] for row in rows} <= {"pending", "running", "done"}
        assert all(row["metrics"] == expected(row["row"]) for row in rows if row["status"] == "done")
    more_room(disk)
    assert main(sweep) == 0
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

    assert run_study(study_of(trials=30), disk / "x", workers=1, on_trouble=tell).done == 90
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


# --- the database -----------------------------------------------------------------------------------


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
        ("header", 300),
        ("first page", 300),
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
    with sqlite3.connect(database) as connection:
        connection.execute("pragma wal_checkpoint(truncate)")
    connection.close()
    for suffix in ("-wal", "-shm"):
        database.with_name(DATABASE + suffix).unlink(missing_ok=True)
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


def test_the_database_of_something_else_is_left_alone(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / DATABASE) as other:
        other.execute("create table recipes (name text)")
    other.close()
    with pytest.raises(InputError, match="other tables"):
        run_study(study_of(), tmp_path)


def test_many_processes_that_begin_at_once_share_every_row_once(tmp_path: Path) -> None:
    script = f"""
import sys
sys.path.insert(0, {str(TESTS)!r})
from pathlib import Path
from unit.test_studies_hostile import study_of
from pilotage.experiments.studies.store import Store
from pilotage.experiments.studies.trial import Outcome
study = study_of()
sys.stdin.readline()
store = Store(Path({str(tmp_path)!r}) / "x", study)
while tasks := store.claim(1):
    print(tasks[0].row)
    store.finish(Outcome(tasks[0].row, {{"n": 1.0}}, {{}}))
store.close()
"""
    crew = [
        subprocess.Popen(
            [sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        for _ in range(3)
    ]
    for process in crew:
        assert process.stdin is not None
        process.stdin.write("go\n")
        process.stdin.flush()
    claimed = [int(line) for process in crew for line in process.communicate(timeout=60)[0].split()]
    assert [process.returncode for process in crew] == [0] * 3
    assert sorted(claimed) == list(range(18))
    assert [row["status"] for row in rows_of(tmp_path / "x")] == ["done"] * 18


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
        counts = run_study(study_of(trials=100), tmp_path / "x", workers=2)
    finally:
        done.set()
        for thread in asking:
            thread.join()
    assert counts.done == 300
    assert not errors
    assert set(counted) == {300}  # never half a database
    assert len(counted) > 50


def test_a_folder_that_cannot_be_written_is_one_line(
    order: Callable[..., None],
    small_disk: Callable[[str], Path],
    capsys: pytest.CaptureFixture[str],
) -> None:
    order()
    disk = small_disk("20m")
    sweep = ["sweep", "museum-plan", "--vary", "stack.planner.turning_radius_m=0.3,0.5", "--trials", "1"]
    sweep += ["--workers", "1", "--no-report", "--out", str(disk / "Übung mit Raum"), "--resume", "--quiet"]
    assert main([*sweep, "--name", "x"]) == 0
    subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
    for name in ("x", "y"):
        assert main([*sweep, "--name", name]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "read-only" in line or "readonly" in line or "cannot be written" in line or "Read-only" in line
    # What is in it can still be read and run again.
    assert len(rows_of(disk / "Übung mit Raum" / "x")) == 2
