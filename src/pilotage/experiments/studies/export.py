"""A study's rows for other programs: CSV and Parquet, and what can be saved of a broken database."""

from __future__ import annotations

import csv
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pilotage.core.whole_file import draft_of
from pilotage.evaluation.endings import ending_of
from pilotage.experiments.studies.database import DATABASE, CorruptDatabaseError
from pilotage.experiments.studies.rows import flat, read_rows, salvage
from pilotage.experiments.studies.study import Study, load_study

SALVAGED = "trials-salvaged.csv"


def export(folder: Path) -> list[Path]:
    """Write ``trials.csv`` and ``trials.parquet`` beside the database; return their paths.

    Raises
    ------
    CorruptDatabaseError
        Where not all rows can be read: what can be is then in ``trials-salvaged.csv``.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    study = load_study(str(folder))
    rows, trouble = read_rows(folder / DATABASE)
    if trouble:
        raise save_what_is_left(folder, study, trouble)
    csv_path, parquet_path = folder / "trials.csv", folder / "trials.parquet"
    write_csv(rows, study, csv_path)
    records = [_record(row, study) for row in rows]
    names = list(dict.fromkeys(name for record in records for name in record))
    columns = {name: [record.get(name) for record in records] for name in names}
    mixed = {
        name: [None if v is None else str(v) for v in values]
        for name, values in columns.items()
        if len({type(v) for v in values if v is not None}) > 1
        and not all(isinstance(v, int | float) for v in values if v is not None)
    }
    # A file that is open already: Arrow takes no path that is not text.
    with draft_of(parquet_path) as draft, draft.open("wb") as file:
        pq.write_table(pa.table({**columns, **mixed}), file)
    return [csv_path, parquet_path]


def write_csv(rows: Sequence[Mapping[str, Any]], study: Study, path: Path) -> None:
    """Write rows as CSV, one column a metric."""
    records = [_record(row, study) for row in rows]
    names = list(dict.fromkeys(name for record in records for name in record))
    with draft_of(path) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(records)


def save_what_is_left(folder: Path, study: Study, trouble: str) -> CorruptDatabaseError:
    """Write the rows that a broken database still gives, and return the error that says where they are.

    They go beside the database, or into a temporary folder where that cannot be written.
    """
    rows = salvage(folder / DATABASE)
    saved = folder / SALVAGED
    try:
        write_csv(rows, study, saved)
    except OSError:
        saved = Path(tempfile.mkdtemp(prefix="pilotage-")) / SALVAGED
        write_csv(rows, study, saved)
    finished = sum(row["status"] in ("done", "failed") for row in rows)
    return CorruptDatabaseError(
        folder / DATABASE,
        trouble,
        f"; {finished} of {study.rows} finished trials could be read and are in {saved}; "
        f"move {DATABASE} away to run the study anew",
    )


def _record(row: Mapping[str, Any], study: Study) -> dict[str, Any]:
    known = 0 <= row["cell"] < len(study.cells)
    cell = study.cells[row["cell"]] if known else None
    return {
        **{key: row[key] for key in ("row", "cell", "trial", "seed", "status", "reason", "seconds")},
        "setting": "" if cell is None else cell.name,
        **({} if cell is None else {f"factor.{name}": value for name, value in cell.values.items()}),
        **flat(row["metrics"]),
        **flat(row["timings"]),
        "ended": ending_of(row["metrics"]),
        "ended_because": str(row["metrics"].get("reason", "")),
        "seed": row["seed"],  # a whole number, also where the run's own metrics tell it as another
    }
