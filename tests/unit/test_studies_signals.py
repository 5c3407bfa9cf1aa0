"""Studies that are ended from outside."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from pilotage.cli.main import main
from pilotage.experiments.studies.store import Store
from support import hostile_trials
from support.hostile_studies import expected, rows_of, study_of
from support.warm_commands import start


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
        ((signal.SIGHUP,), True, 129, "pilotage: ended by SIGHUP; go on with --resume, what is finished"),
        ((signal.SIGKILL,), False, -9, ""),
    ],
)
def test_a_signal_ends_it_without_orphans(
    order: Callable[..., None], tmp_path: Path, sent: tuple[int, ...], group: bool, code: int, told: str
) -> None:
    order("4:slow")
    workers = 2 if sent == (signal.SIGINT,) else 1
    process = start(tmp_path / "streams", hostile_trials.sweep, tmp_path, workers, folder=tmp_path)
    marks = tmp_path / "marks"
    while not list(marks.glob("4-*")):
        assert not process.over, process.ended()
        time.sleep(0.03)
    began = time.monotonic()
    for number in sent:
        with suppress(ProcessLookupError):  # it may have ended by the first before the second
            if group:
                os.killpg(process.pid, number)
            else:
                os.kill(process.pid, number)
        time.sleep(0.03)
    done = process.ended()
    err = done.stderr
    assert done.returncode == code
    assert err.splitlines()[-1:] == ([] if not told else err.splitlines()[:1])  # one line, no traceback
    assert err.startswith(told)
    # Its trial would sleep for ten minutes: what is gone by then was ended, however slow the machine is.
    while descendants(process.pid) and time.monotonic() < began + 300.0:
        time.sleep(0.03)
    assert not descendants(process.pid)
    rows = rows_of(tmp_path / "x")
    assert rows[4]["status"] == ("running" if code == -9 else "pending")
    if code != -9:
        assert {(row["status"], row["attempts"]) for row in rows} <= {("done", 1), ("pending", 0)}
    if len(sent) > 1 or sent[0] in {signal.SIGTERM, signal.SIGHUP}:
        return
    order()
    sweep = ["sweep", "museum-plan", "--vary", "stack.planner.turning_radius_m=0.3,0.5,0.8", "--trials", "6"]
    sweep += ["--name", "x", "--workers", "1", "--no-report", "--out", str(tmp_path), "--resume"]
    assert main([*sweep, "--quiet"]) == 0
    assert [row["metrics"] for row in rows_of(tmp_path / "x")] == [expected(row) for row in range(18)]
    assert {row["attempts"] for row in rows_of(tmp_path / "x")} == {1}


@contextmanager
def interrupted_at(step: int) -> Iterator[None]:
    """Ctrl-C at one step of the interpreter within a transaction of the store."""
    steps = 0

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        nonlocal steps
        if frame.f_code is not Store._transaction.__wrapped__.__code__:  # type: ignore[attr-defined]
            return trace if frame.f_code.co_name in {"claim", "_written", "__enter__", "__exit__"} else None
        frame.f_trace_opcodes = True
        steps += event == "opcode"
        if steps == step:
            steps += 1
            raise KeyboardInterrupt
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        yield
    finally:
        sys.settrace(before)


def test_an_interrupt_gives_claims_back_wherever_it_strikes(tmp_path: Path) -> None:
    struck, step = True, 0
    while struck:
        step += 1
        folder = tmp_path / str(step)
        store = Store(folder, study_of())
        store.claim(2)
        try:
            with interrupted_at(step):
                store.claim(1)
            struck = False
        except KeyboardInterrupt:
            pass
        store.close()
        assert {row["status"] for row in rows_of(folder)} == {"pending"}, step
    assert step > 10  # so many places there are at least
