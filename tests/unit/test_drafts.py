"""What killed processes left half written goes with the next one that writes there, and nothing else."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from pilotage.core.drafts import draft_prefix
from pilotage.core.whole_file import draft_of, write_whole
from pilotage.records.run_folder import draft_folder


def gone() -> int:
    """The number of a process that was there once."""
    with subprocess.Popen([sys.executable, "-c", ""]) as child:
        return child.pid


def left(path: Path, pid: int) -> Path:
    """A draft of ``path`` as another process names it."""
    return path.with_name(draft_prefix(path).replace(f"-{os.getpid()}-", f"-{pid}-") + "x")


def test_drafts_of_dead_writers_go_with_the_next_write(tmp_path: Path) -> None:
    """A killed export left a hidden folder that stayed for ever."""
    table, run = tmp_path / "a.csv", tmp_path / "run"
    dead = gone()
    left(table, dead).write_text("half")
    left(run, dead).mkdir()
    (left(run, dead) / "trace.parquet").write_text("half")
    living = [left(table, os.getppid()), left(tmp_path / "b.csv", dead), tmp_path / ".a.csv-notes"]
    living.append(left(table, dead).with_name(f".a.csv-00000000-{dead}-x"))  # another machine's
    for path in living:
        path.write_text("mine")
    write_whole(table, "whole")
    with draft_folder(run) as draft:
        (draft / "metrics.json").write_text("{}")
    assert {path.name for path in tmp_path.iterdir()} == {"a.csv", "run", *(path.name for path in living)}
    assert table.read_text() == "whole"
    assert [path.name for path in run.iterdir()] == ["metrics.json"]


def test_a_draft_is_not_found_by_the_end_of_its_name(tmp_path: Path) -> None:
    """Folders of logs are looked through for ``*.csv``, hidden ones too."""
    with draft_of(tmp_path / "a.csv") as draft:
        draft.write_text("half")
        assert list(tmp_path.glob("*.csv")) == []
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]
