"""What is left of a broken database comes back, whole rows only, whichever page is lost."""

from __future__ import annotations

import random
import sqlite3
from pathlib import Path

import pytest

from pilotage.experiments.studies.database import DATABASE
from pilotage.experiments.studies.rows import PAGE, read_rows, salvage
from pilotage.experiments.studies.store import Store
from pilotage.experiments.studies.trial import Outcome
from support.hostile_studies import study_of

ROWS = 60


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, int]:
    """A database of finished rows, some longer than a page; and its table's first page."""
    folder = tmp_path_factory.mktemp("studies") / "s"
    study = study_of(trials=ROWS // 3)
    assert study.rows == ROWS
    store = Store(folder, study)
    for task in store.claim(ROWS):
        metrics = {"a": task.row / 7.0, "text": "ü" * (5000 if task.row % 9 == 0 else 200)}
        store.finish(Outcome(task.row, metrics, {"wall_time_s": 0.1}, seconds=0.1))
    store.close()
    database = sqlite3.connect(folder / DATABASE)
    database.execute("pragma wal_checkpoint(truncate)")
    (root,) = database.execute("select rootpage from sqlite_master where name = 'trials'").fetchone()
    database.close()
    return (folder / DATABASE).read_bytes(), root


def numbers(rows: list[dict[str, object]]) -> dict[object, object]:
    return {row["row"]: (row["seed"], row["status"], row["metrics"], row["seconds"]) for row in rows}


def test_no_row_is_lost_with_the_page_that_leads_to_them(written: tuple[bytes, int], tmp_path: Path) -> None:
    content, root = written
    (tmp_path / "whole.sqlite").write_bytes(content)
    sound, trouble = read_rows(tmp_path / "whole.sqlite")
    assert not trouble
    broken = bytearray(content)
    broken[(root - 1) * PAGE : root * PAGE] = b"\xaa" * PAGE
    (tmp_path / "broken.sqlite").write_bytes(broken)
    found, trouble = read_rows(tmp_path / "broken.sqlite")
    assert trouble
    assert numbers(found) == numbers(sound)
    assert len(found) == ROWS


def test_whatever_is_spoilt_what_comes_back_was_written(written: tuple[bytes, int], tmp_path: Path) -> None:
    content, _ = written
    rng = random.Random(4)
    (tmp_path / "whole.sqlite").write_bytes(content)
    sound = numbers(read_rows(tmp_path / "whole.sqlite")[0])
    path = tmp_path / "broken.sqlite"
    for _ in range(25):
        begin, length = rng.randrange(len(content)), rng.randrange(1, 9000)
        broken = bytearray(content)
        broken[begin : begin + length] = rng.randbytes(len(broken[begin : begin + length]))
        path.write_bytes(broken)
        found = numbers(salvage(path))
        # Columns that no checksum covers may be spoilt; what a row measured is not.
        assert all(found[row][2] == sound[row][2] for row in found)  # type: ignore[index]
        assert len(found) >= ROWS - 30
