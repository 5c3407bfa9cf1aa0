"""Studies whose trials break and whose workers die."""

from __future__ import annotations

import asyncio
import gc
import json
import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from pilotage.cli.main import main
from pilotage.experiments.studies import engine
from pilotage.experiments.studies.database import StudyStoppedError
from pilotage.experiments.studies.engine import run_study
from support.hostile_studies import expected, rows_of, study_of


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
        # On a busy machine a trial that is well may take as long and be told, too.
        if line.startswith("row 4 has run for "):
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
    assert (
        main([*sweep, "--name", "x", "--out", str(tmp_path), "--dask", "tcp://127.0.0.1:1", "--quiet"]) == 1
    )
    (line,) = capsys.readouterr().err.splitlines()
    assert (
        "--dask tcp://127.0.0.1:1: the cluster is lost (scheduler-connection-lost); go on with --resume"
        in line
    )
    assert rows_of(tmp_path / "x")[0]["status"] == "pending"


@pytest.mark.parametrize("address", ["nonsense", "tcp://127.0.0.1", "foo://x:1", "tcp://a:b"])
def test_an_address_that_is_none_leaves_nothing_behind(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line, from a client that was never made, and no folder."""
    pytest.importorskip("distributed")
    monkeypatch.chdir(tmp_path)
    sweep = ["sweep", "museum-plan", "--vary", "stack.planner.turning_radius_m=0.3", "--dask", address]
    assert main(sweep) == 2
    gc.collect()
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"pilotage: --dask {address}: expected a scheduler there, found: ")
    assert not list(tmp_path.iterdir())
