"""Writing a run folder: complete or not at all."""

from __future__ import annotations

import json
import math
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.experiments.mission_kind import Kind, Record
from pilotage.experiments.resolve import resolved_yaml, run_name


def write_run_folder(out: Path, kind: Kind, record: Record, metrics: dict[str, object]) -> Path:
    """Write a run folder under ``out`` and return its path.

    Everything is written beside it first and moved into place at the end, so that two runs at once do
    not mix and an interrupted one leaves nothing half-written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    mission = record.mission
    out.mkdir(parents=True, exist_ok=True)
    final = out / run_name(mission)
    draft = Path(tempfile.mkdtemp(prefix=f".{final.name}-", dir=out))
    try:
        draft.chmod(0o777 & ~_umask())
        (draft / "mission.yaml").write_text(resolved_yaml(mission, record), encoding="utf-8")
        with (draft / "trace.parquet").open("wb") as file:  # Arrow takes no name whose bytes are no UTF-8
            pq.write_table(pa.table(dict(record.trace)), file)
        (draft / "events.jsonl").write_text(
            "".join(
                json.dumps({"t_s": event.t_s, "kind": event.kind, "text": event.text}) + "\n"
                for event in record.events
            ),
            encoding="utf-8",
        )
        kind.write_files(record, draft)
        metrics = {**metrics, "run_dir": str(final)}
        (draft / "metrics.json").write_text(json.dumps(clean(metrics), indent=2) + "\n", encoding="utf-8")
        replace_folder(draft, final)
    except BaseException:
        shutil.rmtree(draft, ignore_errors=True)
        raise
    return final


def clean(value: Any) -> Any:
    """Make a value fit for JSON: nan and infinities become null, numpy numbers plain ones."""
    if isinstance(value, dict):
        return {key: clean(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [clean(inner) for inner in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def replace_folder(draft: Path, final: Path) -> None:
    """Put ``draft`` in the place of ``final``, also where another process does the same at once."""
    for _ in range(100):
        if final.exists():
            old = Path(tempfile.mkdtemp(prefix=f".{final.name}-old-", dir=final.parent))
            try:
                final.rename(old / "run")
            except FileNotFoundError:  # another process was quicker
                pass
            finally:
                shutil.rmtree(old, ignore_errors=True)
        try:
            draft.rename(final)
            return
        except OSError:
            if not final.exists():
                raise
    raise OSError(f"could not put the run folder into place: {final}")
