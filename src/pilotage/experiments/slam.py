"""``pilotage slam``: a recording mapped, and all that is known about it in a folder."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.core.config import validate
from pilotage.core.errors import InputError
from pilotage.core.files import read_yaml
from pilotage.core.memory import give_back
from pilotage.experiments.recordings.run_scans import read_run_scans
from pilotage.experiments.slam_folder import read_earlier_map, write_slam_folder
from pilotage.logs.laser_log import LaserLog
from pilotage.logs.laser_recordings import read_laser_log
from pilotage.stack.mapping.slam.closures import Verdict
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.extension import extend_map
from pilotage.stack.mapping.slam.mapper import map_log
from pilotage.stack.mapping.slam.result import NotJoined, SlamResult
from pilotage.stack.mapping.slam.uncertainty import relative_poses

OnStage = Callable[[str, float], None]


@dataclass(frozen=True, slots=True)
class SlamRun:
    """What ``slam_log`` leaves: the metrics, the folder (None: nothing joined), and what one should know."""

    metrics: dict[str, object]
    run_dir: Path | None
    warnings: tuple[str, ...]


def read_recording(path: Path, topics: Sequence[str] = ()) -> LaserLog:
    """Read a bag, a CARMEN log or the folder of a run with a LiDAR."""
    if not (path / "mission.yaml").is_file():
        return read_laser_log(path, topics=topics)
    if topics:
        raise InputError(f"{path}: expected a bag where topics are named, found a run folder")
    return read_run_scans(path)


def read_slam_config(path: Path | None) -> SlamConfig:
    """Read a configuration file, or the shipped configuration without one.

    Raises
    ------
    InputError
        File and key of what is wrong.
    """
    if path is None:
        return SlamConfig()
    return validate(SlamConfig, read_yaml(path, "a YAML file of SLAM's settings") or {}, str(path))


def slam_log(
    path: Path,
    out: Path,
    config: SlamConfig,
    on_stage: OnStage | None = None,
    topics: Sequence[str] = (),
    extend: Path | None = None,
) -> SlamRun:
    """Map a recording and write its run folder under ``out``.

    Parameters
    ----------
    extend
        Folder of an earlier run whose map is extended. Where nothing joins the recording to it, nothing is
        written and the metrics say why.

    Raises
    ------
    InputError
        What of the log or of the earlier run cannot be used.
    """
    began = time.perf_counter()
    final = out / f"slam-{path.name.split('.')[0]}{'' if extend is None else '-extended'}"
    if extend is not None and final.resolve() == extend.resolve():
        raise InputError(f"--extend {extend}: expected another folder than the one written; give --out too")
    earlier = None if extend is None else read_earlier_map(extend, config)
    log = read_recording(path, topics)
    read = time.perf_counter()
    matched = [read]

    def stage(text: str, share: float) -> None:
        if text == "matching":
            matched[0] = time.perf_counter()
        if on_stage is not None:
            on_stage(text, share)

    if earlier is None:
        result: SlamResult | NotJoined = map_log(log, config, stage)
    else:
        result = extend_map(log, config, earlier, stage)
    done = time.perf_counter()
    if isinstance(result, NotJoined):
        return SlamRun(_not_joined(log, result, extend), None, log.warnings)
    metrics = slam_metrics(log, result)
    if result.joined is not None:
        metrics |= {"extends": str(extend)}
    duration_s = float(log.t_s[-1] - log.t_s[0])
    metrics |= {
        "reading_time_s": read - began,
        "front_end_time_s": matched[0] - read,
        "wall_time_s": done - began,
        "times_real_time": duration_s / (done - began),
        "front_end_times_real_time": duration_s / max(matched[0] - read, 1e-9),
    }
    give_back()
    write_slam_folder(final, log, config, result, metrics)
    return SlamRun(metrics, final, result.warnings)


def _not_joined(log: LaserLog, result: NotJoined, extend: Path | None) -> dict[str, object]:
    """Numbers of a recording that was not found in the map it should extend."""
    return {
        "log": log.name,
        "success": False,
        "reason": result.reason,
        "extends": str(extend),
        "scans": len(log),
        "duration_s": float(log.t_s[-1] - log.t_s[0]),
        "stretches": result.stretches,
        "stretches_agreeing": result.agreeing,
        "warnings": list(log.warnings),
    }


def slam_metrics(log: LaserLog, result: SlamResult) -> dict[str, object]:
    """Numbers of a mapped recording under their JSON keys."""
    verdicts = Counter(str(closure.verdict) for closure in result.closures)
    # Along the order in which the scans were taken: that of stamps which go back leads to and fro.
    taken = slice(None) if log.stamps_s is None else np.argsort(np.argsort(log.stamps_s, kind="stable"))
    poses = result.poses[taken]
    moved = relative_poses(poses[:-1], poses[1:])
    std = np.sqrt(np.linalg.eigvalsh(result.known.marginals()[:, :2, :2])[:, -1])
    told = {
        "log": log.name,
        "success": True,
        "reason": "mapped",
        "scans": len(log),
        "keyframes": int(result.keyframes.size),
        "duration_s": float(log.t_s[-1] - log.t_s[0]),
        "path_length_m": float(np.hypot(moved[:, 0], moved[:, 1]).sum()),
        "closures_searched": len(result.closures),
        "closures_accepted": verdicts.get(str(Verdict.ACCEPTED), 0),
        "closures_by_verdict": {str(v): verdicts.get(str(v), 0) for v in Verdict},
        "edges": int(result.known.graph.i.size),
        "position_std_max_m": float(std.max()),
        "map_rows": result.grid.rows,
        "map_columns": result.grid.columns,
        "resolution_m": result.grid.resolution_m,
        "beam_spacing": result.beam_spacing,
        "odometry_scale": result.odometry_scale,
        "odometry_turn_scale": result.odometry_turn_scale,
        "scans_searched": result.searched,
        "scans_lost": result.lost,
        "warnings": list(result.warnings),
    }
    if result.joined is not None:
        joined = result.joined
        told |= {
            "reason": "mapped and joined",
            "stretches": joined.stretches,
            "stretches_agreeing": joined.agreeing,
            "closures_joining": sum(c.verdict is Verdict.ACCEPTED for c in joined.closures),
            "walls_agreement": joined.walls,
            "keyframes_kept": len(joined.earlier),
            "keyframes_dropped": joined.dropped,
        }
    return told
