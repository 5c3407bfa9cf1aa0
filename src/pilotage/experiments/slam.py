"""``pilotage slam``: a recording mapped, and all that is known about it in a folder."""

from __future__ import annotations

import json
import shutil
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from pilotage.core.config import validate
from pilotage.core.errors import InputError
from pilotage.core.files import read_yaml
from pilotage.core.types import FloatArray
from pilotage.logs.g2o import write_g2o
from pilotage.logs.laser_log import LaserLog
from pilotage.logs.laser_recordings import read_laser_log
from pilotage.maps.ros_map import RosMap, write_ros_map
from pilotage.records.metrics import clean
from pilotage.records.run_folder import replace_folder
from pilotage.stack.mapping.slam.closures import Closure, Verdict
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.mapper import map_log
from pilotage.stack.mapping.slam.result import SlamResult
from pilotage.stack.mapping.slam.uncertainty import relative_poses

OnStage = Callable[[str, float], None]


@dataclass(frozen=True, slots=True)
class SlamRun:
    """What ``slam_log`` leaves: the metrics, the folder, and what the user should know."""

    metrics: dict[str, object]
    run_dir: Path
    warnings: tuple[str, ...]


def read_recording(path: Path, topics: Sequence[str] = ()) -> LaserLog:
    """Read a bag or a CARMEN log; InputError also for a run folder, which holds no raw scans."""
    if (path / "mission.yaml").is_file():
        raise InputError(
            f"{path}: expected a bag or a CARMEN log, found a run folder, which holds no raw scans; "
            "export the run as a bag and map that"
        )
    return read_laser_log(path, topics=topics)


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
) -> SlamRun:
    """Map a recording and write its run folder under ``out``.

    Raises
    ------
    InputError
        What of the log cannot be used.
    """
    began = time.perf_counter()
    log = read_recording(path, topics)
    read = time.perf_counter()
    matched = [read]

    def stage(text: str, share: float) -> None:
        if text == "matching":
            matched[0] = time.perf_counter()
        if on_stage is not None:
            on_stage(text, share)

    result = map_log(log, config, stage)
    done = time.perf_counter()
    metrics = slam_metrics(log, result)
    duration_s = float(log.t_s[-1] - log.t_s[0])
    metrics |= {
        "reading_time_s": read - began,
        "front_end_time_s": matched[0] - read,
        "wall_time_s": done - began,
        "times_real_time": duration_s / (done - began),
        "front_end_times_real_time": duration_s / max(matched[0] - read, 1e-9),
    }
    run_dir = _write(out, path, log, config, result, metrics)
    return SlamRun(metrics, run_dir, result.warnings)


def slam_metrics(log: LaserLog, result: SlamResult) -> dict[str, object]:
    """Numbers of a mapped recording under their JSON keys."""
    verdicts = Counter(str(closure.verdict) for closure in result.closures)
    moved = relative_poses(result.poses[:-1], result.poses[1:])
    std = np.sqrt(np.linalg.eigvalsh(result.known.marginals()[:, :2, :2])[:, -1])
    return {
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


def _write(
    out: Path, path: Path, log: LaserLog, config: SlamConfig, result: SlamResult, metrics: dict[str, object]
) -> Path:
    """Write the folder, whole or not at all."""
    out.mkdir(parents=True, exist_ok=True)
    final = out / f"slam-{path.name.split('.')[0]}"
    draft = Path(tempfile.mkdtemp(prefix=f".{final.name}-", dir=out))
    try:
        draft.chmod(0o755)
        poses, before = _of_frame(log, config, result.poses), _of_frame(log, config, result.before)
        (draft / "config.yaml").write_text(
            yaml.safe_dump(config.model_dump(mode="json"), sort_keys=False), encoding="utf-8"
        )
        (draft / "trajectory.tum").write_text(_tum(log.t_s, poses), encoding="utf-8")
        (draft / "before.tum").write_text(_tum(log.t_s, before), encoding="utf-8")
        write_ros_map(draft / "map.yaml", RosMap.of(result.grid, "map.pgm"))
        write_g2o(draft / "graph.g2o", result.known.graph)
        _write_covariances(draft / "covariances.npz", log, result)
        np.savez_compressed(
            draft / "keyframes.npz",
            scans=result.keyframes,
            points_xy_m=result.clouds.points[:, :2].astype(np.float32),
            starts=result.clouds.starts,
            extents=np.array([(e.first, e.last, e.reference) for e in result.extents]).reshape(-1, 3),
        )
        closures = [_row(number, c, result) for number, c in enumerate(result.closures, start=1)]
        (draft / "closures.json").write_text(json.dumps(clean(closures), indent=1) + "\n", encoding="utf-8")
        metrics = metrics | {"run_dir": str(final)}
        (draft / "metrics.json").write_text(json.dumps(clean(metrics), indent=2) + "\n", encoding="utf-8")
        replace_folder(draft, final)
    except BaseException:
        shutil.rmtree(draft, ignore_errors=True)
        raise
    return final


def _of_frame(log: LaserLog, config: SlamConfig, poses: FloatArray) -> FloatArray:
    """Poses (N, 3) of the frame that the trajectory is asked for in: the scanner's or the robot's."""
    if config.trajectory == "scanner":
        return poses
    mount = log.mount.as_array()
    c, s = np.cos(mount[2]), np.sin(mount[2])
    back = np.array([-c * mount[0] - s * mount[1], s * mount[0] - c * mount[1], -mount[2]])
    c_all, s_all = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    return np.stack(
        [
            poses[:, 0] + c_all * back[0] - s_all * back[1],
            poses[:, 1] + s_all * back[0] + c_all * back[1],
            poses[:, 2] + back[2],
        ],
        axis=1,
    )


def _tum(t_s: FloatArray, poses: FloatArray) -> str:
    """Lines of TUM's format; two scans of one stamp keep theirs apart by a microsecond."""
    lines = []
    last = -np.inf
    for t, (x, y, theta) in zip(t_s.tolist(), poses.tolist(), strict=True):
        stamp = max(t, last + 1e-6)
        last = stamp
        lines.append(
            f"{stamp:.6f} {x:.6f} {y:.6f} 0 0 0 {np.sin(0.5 * theta):.9f} {np.cos(0.5 * theta):.9f}\n"
        )
    return "".join(lines)


def _write_covariances(path: Path, log: LaserLog, result: SlamResult) -> None:
    """Covariances of the poses, and what those between any two of them are computed from."""
    known = result.known
    np.savez_compressed(
        path,
        t_s=log.t_s,
        covariances=known.marginals(),
        poses=known.poses,
        owner=known.owner,
        graph_poses=known.graph.poses,
        graph_i=known.graph.i,
        graph_j=known.graph.j,
        graph_measurements=known.graph.measurements,
        graph_information=known.graph.information,
        graph_weights=known.weights,
    )


def _row(number: int, closure: Closure, result: SlamResult) -> dict[str, object]:
    """One closure for ``closures.json``."""
    c, m = closure.candidate, closure.match
    earlier, later = result.extents[c.earlier], result.extents[c.later]
    scans = int(result.keyframes[earlier.reference]), int(result.keyframes[later.reference])
    return {
        "number": number,
        "earlier_scan": scans[0],
        "later_scan": scans[1],
        "earlier_t_s": float(result.t_s[scans[0]]),
        "later_t_s": float(result.t_s[scans[1]]),
        "earlier_submap": c.earlier,
        "later_submap": c.later,
        "window_m": c.half_m,
        "window_rad": c.half_rad,
        "relative": [float(value) for value in m.relative],
        "score": m.score,
        "second_score": m.second,
        "agreement": m.agreement,
        "overlap": m.overlap,
        "chi_square": closure.chi_square,
        "support": closure.support,
        "accepted": closure.verdict is Verdict.ACCEPTED,
        "verdict": str(closure.verdict),
    }
