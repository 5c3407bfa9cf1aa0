"""The folder of ``pilotage slam``: written whole, and read again where a later recording extends its map."""

from __future__ import annotations

import json
from decimal import Decimal
from pathlib import Path

import numpy as np
import yaml

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.evaluation.slam_consistency import COVARIANCES_FILE, read_scan_covariances
from pilotage.logs.g2o import write_g2o
from pilotage.logs.laser_log import LaserLog
from pilotage.maps.ros_map import RosMap, write_ros_map
from pilotage.records.metrics import clean
from pilotage.records.run_folder import draft_folder
from pilotage.records.slam_keyframes import KEYFRAMES_FILE, Keyframes, read_keyframes, write_keyframes
from pilotage.stack.mapping.slam.closures import Closure, Verdict
from pilotage.stack.mapping.slam.clouds import Clouds, cloud_of_beams
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.earlier_map import EarlierMap, KeyframeScans
from pilotage.stack.mapping.slam.result import SlamResult
from pilotage.stack.mapping.slam.uncertainty import Edges


def read_earlier_map(folder: Path, config: SlamConfig) -> EarlierMap:
    """Read the map of a folder of ``pilotage slam``, to be extended.

    Raises
    ------
    InputError
        Where it is no such folder, or files are damaged, do not belong together or are of an older pilotage.
    """
    path = folder / KEYFRAMES_FILE
    if not path.is_file() or not (folder / COVARIANCES_FILE).is_file():
        raise InputError(f"{folder}: expected a folder of 'pilotage slam', found no {KEYFRAMES_FILE}")
    known = read_scan_covariances(folder / COVARIANCES_FILE)
    try:
        keyframes = read_keyframes(path, len(known.graph))
    except ValueError as error:
        raise InputError(f"{path}: {error}; map the recording anew with this pilotage") from None
    beams = keyframes.beams
    scans = KeyframeScans(
        keyframes.t_s,
        keyframes.ranges_m.astype(np.float64),
        beams,
        keyframes.first_angle_rad,
        keyframes.angle_step_rad,
    )
    clouds = [
        cloud_of_beams(
            scans.ranges_m[k, : beams[k]],
            scans.first_angle_rad[k] + scans.angle_step_rad[k] * np.arange(beams[k]),
            float(scans.angle_step_rad[k]),
            config.max_range_m,
        )
        for k in range(len(keyframes))
    ]
    graph = known.graph
    weighted = graph.information * known.weights[:, None, None]
    edges = Edges(graph.i, graph.j, graph.measurements, weighted, np.zeros(graph.i.size, np.bool_))
    return EarlierMap(graph.poses, Clouds.of(clouds), scans, edges, keyframes.breaks, keyframes.since)


def write_slam_folder(
    final: Path, log: LaserLog, config: SlamConfig, result: SlamResult, metrics: dict[str, object]
) -> None:
    """Write the folder, whole or not at all."""
    with draft_folder(final) as draft:
        poses, before = _of_frame(log, config, result.poses), _of_frame(log, config, result.before)
        (draft / "config.yaml").write_text(
            yaml.safe_dump(config.model_dump(mode="json"), sort_keys=False), encoding="utf-8"
        )
        (draft / "trajectory.tum").write_text(_tum(result.t_s, poses), encoding="utf-8")
        (draft / "before.tum").write_text(_tum(result.t_s, before), encoding="utf-8")
        write_ros_map(draft / "map.yaml", RosMap.of(result.grid, "map.pgm"))
        write_g2o(draft / "graph.g2o", result.known.graph)
        _write_covariances(draft / COVARIANCES_FILE, result)
        write_keyframes(draft / KEYFRAMES_FILE, _keyframes(result))
        t_s = result.keyframe_scans().t_s
        closures = [_row(number, c, result, t_s) for number, c in enumerate(result.closures, start=1)]
        (draft / "closures.json").write_text(json.dumps(clean(closures), indent=1) + "\n", encoding="utf-8")
        metrics = metrics | {"run_dir": str(final)}
        (draft / "metrics.json").write_text(json.dumps(clean(metrics), indent=2) + "\n", encoding="utf-8")


def _of_frame(log: LaserLog, config: SlamConfig, poses: FloatArray) -> FloatArray:
    """Poses (N, 3) of the frame that the trajectory is asked for in: the scanner's or the robot's."""
    if config.trajectory == "scanner":
        return poses
    back = log.mount.inverse()
    return np.array([Pose2.from_array(pose).compose(back).as_array() for pose in poses])


def _tum(t_s: FloatArray, poses: FloatArray) -> str:
    """Lines of TUM's format; two scans of one stamp keep theirs apart by a microsecond."""
    lines = []
    last: int | None = None
    for t, (x, y, theta) in zip(t_s.tolist(), poses.tolist(), strict=True):
        # As whole numbers: added to a time of day a microsecond is rounded to less than one.
        stamp_us = round(Decimal(t).scaleb(6))
        last = stamp_us = stamp_us if last is None else max(stamp_us, last + 1)
        stamp = Decimal(stamp_us).scaleb(-6)
        lines.append(
            f"{stamp:.6f} {x:.6f} {y:.6f} 0 0 0 {np.sin(0.5 * theta):.9f} {np.cos(0.5 * theta):.9f}\n"
        )
    return "".join(lines)


def _write_covariances(path: Path, result: SlamResult) -> None:
    """Covariances of the poses, and what those between any two of them are computed from."""
    known = result.known
    np.savez_compressed(
        path,
        t_s=result.t_s,
        covariances=known.marginals(),
        poses=known.poses,
        owner=known.owner,
        own=known.own,
        mount_m=np.array([known.mount_m]),
        residual_m=np.array([known.residual_m]),
        graph_poses=known.graph.poses,
        graph_i=known.graph.i,
        graph_j=known.graph.j,
        graph_measurements=known.graph.measurements,
        graph_information=known.graph.information,
        graph_weights=known.weights,
    )


def _keyframes(result: SlamResult) -> Keyframes:
    """Keyframes of the graph: points, submaps, and what a later recording needs to extend the map."""
    scans = result.keyframe_scans()
    since = len(result.known.graph) - result.keyframes.size
    before = result.known.graph.poses.copy()
    before[since:] = result.before[result.keyframes]
    return Keyframes(
        scans=np.concatenate([np.full(since, -1), result.keyframes]),
        t_s=scans.t_s,
        before=before,
        points_xy_m=result.clouds.points[:, :2].astype(np.float32),
        starts=result.clouds.starts,
        ranges_m=scans.ranges_m.astype(np.float32),
        beams=scans.beams,
        first_angle_rad=scans.first_angle_rad,
        angle_step_rad=scans.angle_step_rad,
        extents=np.array([(e.first, e.last, e.reference) for e in result.extents], np.int64).reshape(-1, 3),
        breaks=result.breaks(),
    )


def _row(number: int, closure: Closure, result: SlamResult, t_s: FloatArray) -> dict[str, object]:
    """One closure for ``closures.json``; ``t_s`` (K,) of all keyframes."""
    c, m = closure.candidate, closure.match
    earlier, later = result.extents[c.earlier], result.extents[c.later]
    since = len(result.known.graph) - result.keyframes.size
    own = earlier.reference >= since
    return {
        "number": number,
        "earlier_scan": int(result.keyframes[earlier.reference - since]) if own else None,
        "later_scan": int(result.keyframes[later.reference - since]),
        "earlier_t_s": float(t_s[earlier.reference]),
        "later_t_s": float(t_s[later.reference]),
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
