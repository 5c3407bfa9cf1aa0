"""From a recording to a map: front end, closures, refinement, covariances, grid."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.logs.laser_log import LaserLog
from pilotage.models.pose_graph import PoseGraph
from pilotage.stack.mapping.slam.back_end import (
    LoopCloser,
    beam_spacing,
    closed,
    keyframe_clouds,
    refined,
    track_edges,
)
from pilotage.stack.mapping.slam.closures import Verdict
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.drawing import drawn_map
from pilotage.stack.mapping.slam.odometry import scanner_odometry
from pilotage.stack.mapping.slam.result import SlamResult
from pilotage.stack.mapping.slam.scan_covariances import ScanCovariances
from pilotage.stack.mapping.slam.scan_poses import scan_poses
from pilotage.stack.mapping.slam.tracker import LocalTrack, track
from pilotage.stack.mapping.slam.uncertainty import relative_poses

LEAST_SCANS = 2
OnStage = Callable[[str, float], None]
"""Called with what is going on and the share of the recording that was matched."""


def map_log(log: LaserLog, config: SlamConfig, on_stage: OnStage | None = None) -> SlamResult:
    """Map a recording.

    Raises
    ------
    InputError
        Where the log has fewer than two scans or not one point to match.
    """
    say = on_stage or _silent
    if len(log) < LEAST_SCANS:
        raise InputError(f"{log.name}: expected at least {LEAST_SCANS} scans to map, found {len(log)}")
    count = len(log)
    local = track(log, config, lambda i: say("matching", (i + 1) / count))
    if local.clouds.points.shape[0] == 0:
        raise InputError(
            f"{log.name}: expected ranges up to max_range_m {config.max_range_m:g}, found not one"
        )
    if local.keyframes.size < 2:
        return _standing(log, config, local)
    closer = closed(local, config, lambda text: say(text, 1.0))
    state, closures, submaps = closer.state, closer.closures, closer.submaps
    say("refining", 1.0)
    spacing = 1.0
    clouds = local.clouds
    if config.calibrate_beam_spacing and any(state.edges.closes):
        spacing = beam_spacing(log, local, state, submaps, config)
        clouds = keyframe_clouds(log, local, config, spacing) if spacing != 1.0 else clouds
    state = refined(clouds, state, track_edges(local), submaps)
    poses = scan_poses(local, state.poses)
    say("drawing", 1.0)
    grid = drawn_map(log, poses, config.resolution_m, config.max_range_m, spacing)
    scale, turn = _odometry_scales(log, poses, config)
    known = ScanCovariances(state.edges.graph(state.poses), state.weights, local.owner, poses)
    return SlamResult(
        log.t_s,
        poses,
        local.poses,
        known,
        local.keyframes,
        tuple(closures),
        tuple(submaps.extents),
        clouds,
        grid,
        spacing,
        scale,
        turn,
        local.searched,
        local.lost,
        (*_warnings(log, local), *_torn(log, local, closer)),
    )


def _silent(text: str, share: float) -> None:
    """Nobody listens."""


def _standing(log: LaserLog, config: SlamConfig, local: LocalTrack) -> SlamResult:
    """A recording in which the robot never left its first keyframe."""
    none = np.zeros(0, np.int64)
    graph = PoseGraph(np.zeros((1, 3)), none, none, np.zeros((0, 3)), np.zeros((0, 3, 3)))
    return SlamResult(
        log.t_s,
        local.poses,
        local.poses,
        ScanCovariances(graph, np.zeros(0), local.owner, local.poses),
        local.keyframes,
        (),
        (),
        local.clouds,
        drawn_map(log, local.poses, config.resolution_m, config.max_range_m, 1.0),
        1.0,
        float("nan"),
        float("nan"),
        local.searched,
        local.lost,
        (*_warnings(log, local), "the robot hardly moved: one keyframe is all there is"),
    )


def _odometry_scales(log: LaserLog, poses: FloatArray, config: SlamConfig) -> tuple[float, float]:
    """Path and turn of the map over those of the odometry, as slopes through the origin, scan by scan."""
    odometry = scanner_odometry(log, config.use_odometry)
    if odometry is None:
        return float("nan"), float("nan")
    true, told = relative_poses(poses[:-1], poses[1:]), relative_poses(odometry[:-1], odometry[1:])
    sane = (np.hypot(*(true - told)[:, :2].T) < 0.1) & (np.abs(true - told)[:, 2] < 0.1)
    true, told = true[sane], told[sane]
    scales = []
    for axis in (0, 2):
        square = float(told[:, axis] @ told[:, axis])
        scales.append(float(true[:, axis] @ told[:, axis]) / square if square > 0.0 else float("nan"))
    return scales[0], scales[1]


def _torn(log: LaserLog, local: LocalTrack, closer: LoopCloser) -> list[str]:
    """Where the track broke for good, and whether closures join what follows to what was before."""
    extents = closer.submaps.extents
    pairs = [
        (extents[closure.candidate.earlier].piece, extents[closure.candidate.later].piece)
        for closure in closer.closures
        if closure.verdict is Verdict.ACCEPTED
    ]
    out = []
    for number, keyframe in enumerate(local.breaks.tolist(), start=1):
        count = sum(first < number <= second for first, second in pairs)
        told = f"{count} closures join it" if count else "nothing joins it, where it lies is a guess"
        t_s = float(log.t_s[local.keyframes[keyframe]])
        out.append(
            f"the track breaks at {t_s:.1f} s: the scan fits nowhere near (was the robot carried?); {told}"
        )
    return out


def _warnings(log: LaserLog, local: LocalTrack) -> tuple[str, ...]:
    """What the log said, and what the front end has to add."""
    out = list(log.warnings)
    if local.lost:
        out.append(f"{local.lost} of {len(log)} scans could not be matched; their poses are guesses")
    return tuple(out)


__all__ = ["SlamResult", "map_log"]
