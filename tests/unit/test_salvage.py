"""What SQLite can still read of a broken database comes back, whole rows only."""

from __future__ import annotations

import random
import sqlite3
from pathlib import Path

import pytest

from pilotage.core.errors import InputError
from pilotage.experiments.studies.database import DATABASE
from pilotage.experiments.studies.rows import read_rows, salvage
from pilotage.experiments.studies.store import Store
from pilotage.experiments.studies.trial import Outcome
from support.hostile_studies import study_of

ROWS = 60
PAGE = 4096


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


def test_rows_beside_a_lost_page_come_back(written: tuple[bytes, int], tmp_path: Path) -> None:
    """Every page of the file but the first two is lost once; the table's own way to its rows is kept."""
    content, root = written
    whole = tmp_path / "whole.sqlite"
    whole.write_bytes(content)
    sound, trouble = read_rows(whole)
    assert not trouble
    kept = []
    for page in range(3, len(content) // PAGE + 1):
        if page == root:
            continue
        broken = bytearray(content)
        broken[(page - 1) * PAGE : page * PAGE] = b"\xaa" * PAGE
        (tmp_path / "broken.sqlite").write_bytes(broken)
        found = numbers(salvage(tmp_path / "broken.sqlite"))
        assert found.items() <= numbers(sound).items()
        kept.append(len(found))
    assert min(kept) >= ROWS - 30
    assert max(kept) == ROWS  # a page of the index holds no row


def test_without_a_way_to_its_rows_nothing_comes_back(written: tuple[bytes, int], tmp_path: Path) -> None:
    content, root = written
    broken = bytearray(content)
    broken[(root - 1) * PAGE : root * PAGE] = b"\xaa" * PAGE
    (tmp_path / "broken.sqlite").write_bytes(broken)
    found, trouble = read_rows(tmp_path / "broken.sqlite")
    assert "malformed" in trouble
    assert found == []


def test_whatever_is_spoilt_what_comes_back_was_written(written: tuple[bytes, int], tmp_path: Path) -> None:
    content, _ = written
    rng = random.Random(4)
    (tmp_path / "whole.sqlite").write_bytes(content)
    sound = {row["row"]: row["metrics"] for row in read_rows(tmp_path / "whole.sqlite")[0]}
    path = tmp_path / "broken.sqlite"
    for _ in range(25):
        begin, length = rng.randrange(len(content)), rng.randrange(1, 9000)
        broken = bytearray(content)
        broken[begin : begin + length] = rng.randbytes(len(broken[begin : begin + length]))
        path.write_bytes(broken)
        # Columns that no checksum covers may be spoilt; what a row measured is not.
        assert all(row["metrics"] == sound[row["row"]] for row in salvage(path))


@pytest.mark.parametrize(
    "spoil",
    [
        "create view more as with recursive c(x) as (values(1) union all select x+1 from c) select x from c",
        "drop table trials",
        "alter table trials add column extra text",
        "create trigger late after update on trials begin delete from trials; end",
    ],
)
def test_tables_that_are_no_studys_are_not_asked(
    written: tuple[bytes, int], tmp_path: Path, spoil: str
) -> None:
    path = tmp_path / DATABASE
    path.write_bytes(written[0])
    with sqlite3.connect(path) as database:
        database.execute(spoil)
    database.close()
    assert read_rows(path) == ([], "its tables are not a study's")
    with pytest.raises(InputError, match="other tables"):
        Store(tmp_path, study_of(trials=ROWS // 3))


@pytest.mark.parametrize(
    "metrics",
    ["[" * 100_000 + "]" * 100_000, "[1, 2]", '{"a": 1e999}', "nonsense", "9" * 5000],
    ids=["deep", "a list", "infinite", "no JSON", "long"],
)
def test_a_row_with_a_spoilt_text_is_left_out(
    written: tuple[bytes, int], tmp_path: Path, metrics: str
) -> None:
    path = tmp_path / DATABASE
    path.write_bytes(written[0])
    with sqlite3.connect(path) as database:
        database.execute("update trials set metrics = ?, crc = null where row = 7", (metrics,))
    database.close()
    found, trouble = read_rows(path)
    assert trouble
    assert [row["row"] for row in found] == [row for row in range(ROWS) if row != 7]
