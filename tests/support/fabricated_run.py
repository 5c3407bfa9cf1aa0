"""A run folder made up for the report's tests: every file that a run on a floor leaves behind."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from pilotage.core.types import FloatArray


def fabricate_run(folder: Path, steps: int = 600, **changes: Any) -> Path:
    """Write a plausible run folder: a robot on its way through a door, around a box, to its goal.

    ``changes`` replaces whole parts: ``metrics``, ``events``, ``world``, ``plans``, ``mission`` (None leaves
    the file out), ``columns`` (merged; a value of None drops the column).
    """
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(7)
    columns = fabricate_columns(steps, rng)
    for name, values in (changes.get("columns") or {}).items():
        columns.pop(name, None)
        if values is not None:
            columns[name] = values
    pq.write_table(pa.table(columns), folder / "trace.parquet")
    mission = (
        "mission: two-rooms\ndescription: From one room to the other.\nrun: {dt_s: 0.1, settle_s: 1.0}\n"
    )
    _write(folder / "mission.yaml", changes.get("mission", mission))
    _write(folder / "metrics.json", _json(changes.get("metrics", fabricate_metrics(steps))))
    _write(folder / "world.json", _json(changes.get("world", fabricate_world())))
    events = changes.get("events", _events(steps))
    _write(folder / "events.jsonl", None if events is None else "".join(json.dumps(e) + "\n" for e in events))
    plans = changes.get("plans", fabricate_plans(rng))
    if plans is not None:
        np.savez(folder / "plans.npz", **plans)
    return folder


def _write(path: Path, text: str | None) -> None:
    if text is not None:
        path.write_text(text, encoding="utf-8")


def _json(content: object) -> str | None:
    return None if content is None else json.dumps(content)


def _route(share: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A curve from (1, 1) through the door at (6, 4) to (11, 7): x, y and heading."""
    x = 1.0 + 10.0 * share
    y = 1.0 + 6.0 * share + 0.8 * np.sin(2.0 * math.pi * share)
    theta = np.arctan2(6.0 + 1.6 * math.pi * np.cos(2.0 * math.pi * share), 10.0 + 0.0 * share)
    return x, y, theta


def fabricate_columns(steps: int, rng: np.random.Generator) -> dict[str, FloatArray]:
    t_s = 0.1 * np.arange(1, steps + 1)
    x, y, theta = _route(np.linspace(0.0, 1.0, steps))
    sigma = 0.004 + 0.1 * np.exp(-t_s / 0.2) + 0.002 * np.sin(t_s / 5.0) ** 2
    error = rng.normal(size=(3, steps)) * sigma
    dof = 2.0 * rng.integers(0, 5, steps)
    left = 1.5 + np.cos(t_s / 3.0)
    mode = np.zeros(steps)
    mode[steps // 3 : steps // 2] = 2.0
    mode[steps // 2 : steps // 2 + steps // 20] = 4.0
    mode[-1:] = 5.0
    turn = np.gradient(theta, 0.1) if steps > 1 else np.zeros(steps)
    return {
        "t_s": t_s,
        "true_x_m": x,
        "true_y_m": y,
        "true_theta_rad": theta,
        "est_x_m": x + error[0],
        "est_y_m": y + error[1],
        "est_theta_rad": theta + 0.5 * error[2],
        "cov_xx_m2": sigma**2,
        "cov_xy_m2": 0.3 * sigma**2,
        "cov_yy_m2": sigma**2,
        "cov_xt_m_rad": 0.0 * sigma,
        "cov_yt_m_rad": 0.0 * sigma,
        "cov_tt_rad2": 0.25 * sigma**2,
        "ref_x_m": x,
        "ref_y_m": y + 0.01,
        "ref_theta_rad": theta,
        "v_cmd_m_s": np.full(steps, 0.5),
        "w_cmd_rad_s": turn,
        "v_true_m_s": np.minimum(0.5, t_s),
        "w_true_rad_s": turn,
        "w_feedforward_rad_s": turn,
        "w_proportional_rad_s": 0.05 * np.sin(t_s),
        "w_integral_rad_s": 0.01 * np.cos(t_s / 7.0),
        "w_reactive_rad_s": np.where(mode == 2.0, 0.5, 0.0),
        "path_error_m": 0.01 * np.sin(t_s),
        "mode": mode,
        "distance_to_go_m": np.linspace(13.0, 0.2, steps),
        "nees": rng.chisquare(3.0, steps),
        "nis": np.where(dof > 0.0, rng.chisquare(np.maximum(dof, 1.0)), np.nan),
        "nis_dof": dof,
        "beacons_seen": dof / 2.0,
        "beacons_accepted": np.maximum(dof / 2.0 - (rng.random(steps) < 0.02), 0.0),
        "clearance_m": 0.4 + 0.3 * np.cos(t_s / 4.0),
        "collisions": np.zeros(steps),
        "us_front_m": np.where(np.sin(t_s / 4.0) > 0.2, 2.0 + np.sin(t_s), np.nan),
        "us_left_m": left,
        "us_right_m": np.full(steps, np.nan),
    }


def fabricate_metrics(steps: int) -> dict[str, Any]:
    return {
        "mission": "two-rooms",
        "seed": 3,
        "success": True,
        "reason": "arrived",
        "duration_s": 0.1 * steps,
        "steps": steps,
        "wall_time_s": 0.2,
        "steps_per_s": 8123.4,
        "path_length_m": 12.34,
        "planned_length_m": 12.3,
        "shortest_length_m": 12.1,
        "planning_time_s": 0.31,
        "first_solution_s": 0.012,
        "replans": 1,
        "collisions": 0,
        "attempts": 1,
        "min_clearance_m": 0.1,
        "position_rmse_m": 0.0056,
        "position_max_m": 0.0181,
        "heading_rmse_rad": 0.0021,
        "final_error": {"x_m": 0.002, "y_m": -0.001, "theta_rad": None},
        "goal_error_m": 0.12,
        "nees_mean": 2.96,
        "nees_low": 2.7,
        "nees_high": 3.2,
        "nis_mean": 1.01,
        "nis_low": 0.93,
        "nis_high": 1.08,
        "accepted_fraction": 0.98,
        "run_dir": "somewhere",
    }


def _events(steps: int) -> list[dict[str, Any]]:
    end = 0.1 * steps
    return [
        {"t_s": 0.0, "kind": "plan", "text": "planned 12.30 m in 0.31 s"},
        {"t_s": end / 3, "kind": "avoid-start", "text": "something 0.98 m ahead, turning left"},
        {"t_s": end / 2, "kind": "avoid-end", "text": "free again"},
        {"t_s": end / 2 + 0.1, "kind": "replan", "text": "planned 6.10 m from here"},
        {"t_s": end, "kind": "arrived", "text": "0.12 m from the goal"},
    ]


def fabricate_world() -> dict[str, Any]:
    walls = [[0, 0, 12, 0], [12, 0, 12, 8], [12, 8, 0, 8], [0, 8, 0, 0], [6, 0, 6, 3], [6, 5, 6, 8]]
    beacons = [(0.05, 0.05), (11.95, 0.05), (11.95, 7.95), (0.05, 7.95), (5.95, 3.0), (6.05, 5.0)]
    return {
        "segments_m": walls,
        "circles_m": [[9.0, 2.0, 0.4]],
        "bounds_m": [0, 0, 12, 8],
        "landmarks": [{"id": i, "x_m": x, "y_m": y} for i, (x, y) in enumerate(beacons, start=1)],
        "obstacle_segments_m": [],
        "obstacle_circles_m": [[3.0, 5.0, 0.3]],
        "obstacle_polygons_m": [[[4.0, 2.2], [4.6, 2.2], [4.6, 2.8], [4.0, 2.8]]],
        "robot_radius_m": 0.3,
        "start": [1.0, 1.0, 0.5],
        "goal": [11.0, 7.0, None],
    }


def fabricate_plans(rng: np.random.Generator) -> dict[str, FloatArray]:
    x, y, theta = _route(np.linspace(0.0, 1.0, 80))
    path = np.stack([x, y + 0.05, theta], axis=1)
    tree = np.concatenate([path[:-1, :2], path[1:, :2] + rng.normal(size=(79, 2)) * 0.4], axis=1)
    plans: dict[str, FloatArray] = {
        "mapped_points": np.array([[4.0, 2.2 + 0.05 * i] for i in range(12)]),
        "shortest_path": np.array([[1.0, 1.0], [6.0, 4.0], [11.0, 7.0]]),
    }
    for index, part in enumerate((path, path[40:])):
        plans |= {
            f"path_{index}": part,
            f"waypoints_{index}": part[::10],
            f"tree_{index}": tree,
            f"t_{index}": np.array(30.0 * index),
            f"length_{index}": np.array(12.3),
            f"planning_time_{index}": np.array(0.31),
        }
    return plans
