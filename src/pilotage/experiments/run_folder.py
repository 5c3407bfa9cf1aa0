"""Writing a run folder: complete or not at all."""

from __future__ import annotations

from pathlib import Path

from pilotage.experiments.mission_kind import Kind, Record
from pilotage.experiments.resolve import resolved_yaml, run_name
from pilotage.records.events import write_events
from pilotage.records.metrics import clean, write_metrics
from pilotage.records.mission import write_mission
from pilotage.records.run_folder import draft_folder, replace_folder
from pilotage.records.trace import trace_of, write_trace

__all__ = ["clean", "replace_folder", "write_run_folder"]


def write_run_folder(out: Path, kind: Kind, record: Record, metrics: dict[str, object]) -> Path:
    """Write a run folder under ``out`` and return its path; see ``pilotage.records.run_folder``."""
    mission = record.mission
    final = out / run_name(mission)
    with draft_folder(final) as draft:
        write_mission(draft, resolved_yaml(mission, record))
        write_trace(draft, trace_of(record.trace))
        write_events(draft, record.events)
        kind.write_files(record, draft)
        write_metrics(draft, {**metrics, "run_dir": str(final)})
    return final
