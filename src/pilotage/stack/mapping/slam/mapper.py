"""From a recording to a map: front end, closures, refinement, covariances, grid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.memory import give_back
from pilotage.core.types import FloatArray
from pilotage.kernels.slam.frames import between_all, placed_all
from pilotage.kernels.slam.placing import START_REACH_M
from pilotage.logs.laser_log import LaserLog
from pilotage.models.pose_graph import PoseGraph
from pilotage.stack.mapping.slam.back_end import (
    LoopCloser,
    Solved,
    closed,
    refined,
    weak_edges,
)
from pilotage.stack.mapping.slam.beam_spacing import beam_spacing, keyframe_clouds, told_angles_fit
from pilotage.stack.mapping.slam.closures import Verdict, moved
from pilotage.stack.mapping.slam.clouds import Clouds
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.drawing import drawn_map
from pilotage.stack.mapping.slam.earlier_map import keyframe_scans
from pilotage.stack.mapping.slam.odometry import scanner_odometry
from pilotage.stack.mapping.slam.result import Joined, SlamResult
from pilotage.stack.mapping.slam.scan_covariances import ScanCovariances
from pilotage.stack.mapping.slam.scan_poses import aligned_scans, scan_poses
from pilotage.stack.mapping.slam.tracker import LocalTrack, track
from pilotage.stack.mapping.slam.uncertainty import relative_poses

LEAST_SCANS = 2
MOST_CROWDED, MOST_FAR, FAR_S = 0.02, 0.1, 1.0
"""Shares of the scans from which it is told that much seemed to move, and that they are far apart."""
LEAST_TURNED_RAD, MIRRORED = 3.0, -0.5
"""After so many turns by the odometry it is told where scans turn the other way."""
OnStage = Callable[[str, float], None]
"""Called with what is going on and the share of the recording that was matched."""


@dataclass(frozen=True, slots=True)
class Mapped:
    """A recording whose graph is closed and refined: track, its closer, points, graph, spacing of beams."""

    log: LaserLog
    local: LocalTrack
    closer: LoopCloser
    clouds: Clouds
    state: Solved
    spacing: float


def map_log(log: LaserLog, config: SlamConfig, on_stage: OnStage | None = None) -> SlamResult:
    """Map a recording.

    Raises
    ------
    InputError
        Where the log has fewer than two scans or not one point to match.
    """
    say = on_stage or _silent
    local = tracked(log, config, say)
    if local.keyframes.size < 2:
        return _standing(log, config, local)
    done = mapped(log, local, config, say)
    give_back()
    say("drawing", 1.0)
    return result_of(config, done, done.state)


def tracked(log: LaserLog, config: SlamConfig, say: OnStage) -> LocalTrack:
    """Run the front end, or say why it cannot (InputError)."""
    if len(log) < LEAST_SCANS:
        raise InputError(f"{log.name}: expected at least {LEAST_SCANS} scans to map, found {len(log)}")
    count = len(log)
    give_back()
    local = track(log, config, lambda i: say("matching", (i + 1) / count))
    give_back()
    if local.clouds.points.shape[0] == 0:
        raise InputError(
            f"{log.name}: expected ranges up to max_range_m {config.max_range_m:g}, found not one"
        )
    return local


def mapped(log: LaserLog, local: LocalTrack, config: SlamConfig, say: OnStage) -> Mapped:
    """Close the loops of a track of two keyframes or more, and refine its graph."""
    closer = closed(local, config, lambda text: say(text, 1.0))
    say("refining", 1.0)
    spacing = 1.0
    clouds = local.clouds
    if config.calibrate_beam_spacing and told_angles_fit(log, local, closer, config):
        log = log.as_told()
        local = tracked(log, config, say)
        closer = closed(local, config, lambda text: say(text, 1.0))
        clouds = local.clouds
    elif config.calibrate_beam_spacing:
        spacing = beam_spacing(log, local, closer, config)
        clouds = keyframe_clouds(log, local, config, spacing) if spacing != 1.0 else clouds
    return Mapped(log, local, closer, clouds, refined(closer, clouds, weak_edges(local)), spacing)


def result_of(config: SlamConfig, done: Mapped, state: Solved, joined: Joined | None = None) -> SlamResult:
    """Return everything that is known of a mapped recording.

    Parameters
    ----------
    state, joined
        The graph in the end; where it extends an earlier map that one's keyframes are its first.
    """
    log, local, closer = done.log, done.local, done.closer
    since = 0 if joined is None else len(joined.earlier)
    own = state.poses[since:]
    hung = scan_poses(local, own)
    poses, sure = aligned_scans(log, local, done.clouds, own, hung, config, done.spacing)
    scans = keyframe_scans(log, slice(None), done.spacing)
    drawn_from, drawn_at = scans, poses
    extents, closures = tuple(closer.submaps.extents), closer.closures
    clouds, before = done.clouds, local.poses
    warnings = (*_warnings(log, local, config), *_torn(log, local, closer))
    if joined is not None:
        drawn_from = joined.earlier.scans.and_more(scans)
        drawn_at = np.concatenate([state.poses[:since], poses])
        extents, clouds = joined.extents, joined.earlier.clouds.and_more(clouds)
        closures = [*(moved(closure, joined.submaps) for closure in closures), *joined.closures]
        before = placed_all(poses[0], between_all(before[0], before))
        warnings += joined.warnings
    scale, turn = _odometry_scales(log, poses, config)
    graph, owner = state.edges.graph(state.poses), since + local.owner
    known = ScanCovariances(graph, state.weights, owner, poses, sure, _mount_m(log), local.residual_m)
    result = SlamResult(
        log.t_s,
        poses,
        before,
        known,
        local.keyframes,
        tuple(closures),
        extents,
        clouds,
        scans.chosen(local.keyframes),
        drawn_map(drawn_from, drawn_at, config.resolution_m, config.max_range_m),
        done.spacing,
        scale,
        turn,
        local.searched,
        local.lost,
        warnings,
        joined,
    )
    return result if log.stamps_s is None else by_stamps(result, log.stamps_s)


def by_stamps(result: SlamResult, stamps_s: FloatArray) -> SlamResult:
    """Return the scans with the stamps (N,) that the log gives them, in their order."""
    order = np.argsort(stamps_s, kind="stable")
    rank = np.argsort(order, kind="stable")
    known = replace(
        result.known,
        owner=result.known.owner[order],
        poses=result.poses[order],
        own=result.known.own[order],
    )
    return replace(
        result,
        t_s=stamps_s[order],
        poses=result.poses[order],
        before=result.before[order],
        known=known,
        keyframes=rank[result.keyframes],
    )


def _mount_m(log: LaserLog) -> float:
    return float(np.hypot(log.mount.x_m, log.mount.y_m))


def _silent(text: str, share: float) -> None:
    """Nobody listens."""


def _standing(log: LaserLog, config: SlamConfig, local: LocalTrack) -> SlamResult:
    """A recording in which the robot never left its first keyframe."""
    none = np.zeros(0, np.int64)
    scans = keyframe_scans(log, slice(None), 1.0)
    graph = PoseGraph(np.zeros((1, 3)), none, none, np.zeros((0, 3)), np.zeros((0, 3, 3)))
    result = SlamResult(
        log.t_s,
        local.poses,
        local.poses,
        ScanCovariances(
            graph,
            np.zeros(0),
            local.owner,
            local.poses,
            np.zeros((len(log), 3, 3)),
            _mount_m(log),
            local.residual_m,
        ),
        local.keyframes,
        (),
        (),
        local.clouds,
        scans.chosen(local.keyframes),
        drawn_map(scans, local.poses, config.resolution_m, config.max_range_m),
        1.0,
        float("nan"),
        float("nan"),
        local.searched,
        local.lost,
        (*_warnings(log, local, config), "the robot hardly moved: one keyframe is all there is"),
    )
    return result if log.stamps_s is None else by_stamps(result, log.stamps_s)


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


def _warnings(log: LaserLog, local: LocalTrack, config: SlamConfig) -> tuple[str, ...]:
    """What the log said, and what the front end has to add."""
    out = list(log.warnings)
    if local.lost:
        out.append(f"{local.lost} of {len(log)} scans could not be matched; their poses are guesses")
    if local.crowded > MOST_CROWDED * len(log):
        out.append(
            f"in {local.crowded} of {len(log)} scans 40 % and more seemed to move: where people fill the "
            "view the map may follow them and not know it"
        )
    moved = relative_poses(local.poses[:-1], local.poses[1:])
    far = (np.hypot(moved[:, 0], moved[:, 1]) > START_REACH_M) | (np.diff(log.t_s) > FAR_S)
    if far.mean() > MOST_FAR and scanner_odometry(log, config.use_odometry) is None:
        out.append(
            f"no odometry, and {far.mean():.0%} of the scans lie more than {START_REACH_M:g} m or "
            f"{FAR_S:g} s behind the one before: where places look alike the track may be wrong, and "
            "the covariances do not count that"
        )
    share, turned_rad = _turns_against_odometry(log, local, config)
    if turned_rad > LEAST_TURNED_RAD and share < MIRRORED:
        out.append(
            f"scans turn against the odometry ({share:.2f} times its turns, over {turned_rad:.0f} rad): the "
            "map is mirrored. The scanner hangs upside down, or counts its beams clockwise, and the log does "
            "not say so; or it is the odometry that counts turns clockwise"
        )
    return tuple(out)


def _turns_against_odometry(log: LaserLog, local: LocalTrack, config: SlamConfig) -> tuple[float, float]:
    """Turns from keyframe to keyframe over the odometry's, as a slope through the origin, and all of these.

    The slope is 0 where the two do not go together: a correlation of less than a half tells nothing.
    """
    odometry = scanner_odometry(log, config.use_odometry)
    if odometry is None or len(local.keyframes) < LEAST_SCANS:
        return 0.0, 0.0
    turns = [
        relative_poses(poses[:-1], poses[1:])[:, 2]
        for poses in (local.poses[local.keyframes], odometry[local.keyframes])
    ]
    true, told = (np.where(np.isin(np.arange(1, len(turns[0]) + 1), local.breaks), 0.0, t) for t in turns)
    both, square = float(true @ told), float(told @ told)
    if abs(both) <= 0.5 * float(np.linalg.norm(true) * np.linalg.norm(told)):
        return 0.0, 0.0
    return both / square, float(np.abs(told).sum())


__all__ = ["SlamResult", "map_log"]
