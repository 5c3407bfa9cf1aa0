"""Writing a run folder: complete or not at all."""

from __future__ import annotations

import hashlib
import json
import math
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from pilotage.experiments.recorder import RunRecord
from pilotage.experiments.roles import REGISTRIES
from pilotage.experiments.world_map import shipped_maps
from pilotage.missions.schema import Mission


def resolved_yaml(mission: Mission, record: RunRecord | None = None) -> str:
    """The mission in full, every component's defaults included; a map from a file is written into it."""
    values = mission.model_dump(mode="json")
    for role, choice in values["stack"].items():
        if role in REGISTRIES and choice is not None:
            values["stack"][role] = _resolved(role, choice, f"stack.{role}")
    for name, choice in values["robot"]["sensors"].items():
        values["robot"]["sensors"][name] = _resolved("sensor", choice, f"robot.sensors.{name}")
    source = mission.world.map
    if record is not None and isinstance(source, str) and source not in shipped_maps():
        floor = record.experiment.floor
        values["world"]["map"] = {
            "map": floor.name,
            "bounds_m": list(floor.walls.bounds_m),
            "walls_m": floor.walls.segments_m.tolist(),
            "circles_m": floor.walls.circles_m.tolist(),
            "landmarks": [
                {"id": int(i), "x_m": float(x), "y_m": float(y)}
                for i, (x, y) in zip(floor.landmarks.ids, floor.landmarks.points_xy_m, strict=True)
            ],
        }
    return yaml.safe_dump(values, sort_keys=False, allow_unicode=True)


def _resolved(role: str, choice: dict[str, Any], where: str) -> dict[str, Any]:
    """A component's name with all its parameters, those left to their defaults too."""
    parameters = {key: value for key, value in choice.items() if key != "name"}
    config = REGISTRIES[role].configure(choice["name"], parameters, where)
    return {"name": choice["name"], **config.model_dump(mode="json")}


def run_name(mission: Mission) -> str:
    """``<mission>-<seed>-<hash>``: the same mission and seed have the same name."""
    digest = hashlib.sha256(resolved_yaml(mission).encode()).hexdigest()[:8]
    return f"{_slug(mission.mission)}-{mission.run.seed}-{digest}"


def _slug(text: str) -> str:
    """A name fit for a folder."""
    return "".join(c if c.isalnum() or c in "-_." else "-" for c in text).strip(".") or "mission"


def write_run_folder(out: Path, record: RunRecord, metrics: dict[str, object]) -> Path:
    """Write a run folder under ``out`` and return its path.

    Everything is written beside it first and moved into place at the end, so that two runs at once do
    not mix and an interrupted one leaves nothing half-written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    mission = record.experiment.mission
    out.mkdir(parents=True, exist_ok=True)
    final = out / run_name(mission)
    draft = Path(tempfile.mkdtemp(prefix=f".{final.name}-", dir=out))
    try:
        draft.chmod(0o777 & ~_umask())
        (draft / "mission.yaml").write_text(resolved_yaml(mission, record), encoding="utf-8")
        pq.write_table(pa.table(record.trace), draft / "trace.parquet")
        (draft / "events.jsonl").write_text(
            "".join(
                json.dumps({"t_s": event.t_s, "kind": event.kind, "text": event.text}) + "\n"
                for event in record.events
            ),
            encoding="utf-8",
        )
        (draft / "world.json").write_text(json.dumps(_world(record)), encoding="utf-8")
        np.savez_compressed(draft / "plans.npz", allow_pickle=False, **_plans(record))
        metrics = {**metrics, "run_dir": str(final)}
        (draft / "metrics.json").write_text(json.dumps(clean(metrics), indent=2) + "\n", encoding="utf-8")
        _replace(draft, final)
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


def _replace(draft: Path, final: Path) -> None:
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


def _world(record: RunRecord) -> dict[str, Any]:
    experiment = record.experiment
    mission, world = experiment.mission, experiment.world
    start, goal = mission.world.start, mission.world.goal
    return {
        "segments_m": world.known.segments_m.tolist(),
        "circles_m": world.known.circles_m.tolist(),
        "bounds_m": list(world.known.bounds_m),
        "landmarks": [
            {"id": int(i), "x_m": float(x), "y_m": float(y)}
            for i, (x, y) in zip(world.landmarks.ids, world.landmarks.points_xy_m, strict=True)
        ],
        "obstacle_segments_m": world.obstacle_segments_m.tolist(),
        "obstacle_circles_m": world.obstacle_circles_m.tolist(),
        "obstacle_polygons_m": [polygon.tolist() for polygon in experiment.obstacles.polygons_m],
        "robot_radius_m": mission.robot.body.radius_m,
        "start": [start.x_m, start.y_m, start.theta_rad],
        "goal": None if goal is None else [goal.x_m, goal.y_m, goal.theta_rad],
    }


def _plans(record: RunRecord) -> dict[str, Any]:
    experiment = record.experiment
    arrays: dict[str, Any] = {"mapped_points": experiment.stack.mapped_circles_m[:, :2]}
    for i, plan in enumerate(experiment.stack.plans):
        arrays[f"path_{i}"] = plan.states
        arrays[f"waypoints_{i}"] = plan.waypoints
        arrays[f"tree_{i}"] = plan.tree_edges_m
        arrays[f"t_{i}"] = np.array(plan.t_s)
        arrays[f"length_{i}"] = np.array(plan.length_m)
        arrays[f"planning_time_{i}"] = np.array(plan.planning_time_s)
    shortest = record.outcome.shortest
    arrays["shortest_path"] = np.zeros((0, 2)) if shortest is None else shortest.points_xy_m
    return arrays
