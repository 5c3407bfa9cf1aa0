"""Scan after scan placed by guesses of its motion; compiled code is left in doubt only."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.jit import kernel
from pilotage.kernels.slam.frames import between, composed
from pilotage.kernels.slam.local_map import add_to_map
from pilotage.kernels.slam.movers import MOST, add_view, without_movers
from pilotage.kernels.slam.neighbourhood import is_best_near
from pilotage.kernels.slam.placing import (
    CREDIBLE,
    CREDIBLE_OFF,
    LONG_M,
    POOR,
    POOR_AS_GUESSED,
    distance,
    guessed_motions,
    learn_motion,
    placed,
)
from pilotage.kernels.slam.recorded_motions import motion_of, move_anchor
from pilotage.kernels.slam.scan_lines import lines_of, rays_of, scan_points
from pilotage.kernels.slam.slips import add_slip
from pilotage.kernels.slam.track import Keyframes, Recording, Track, Tracked, has_room
from pilotage.kernels.slam.wheels import HELD, learn_wheels

SURE_GUESS = 0.035
"""Usual error of the guesses (a radian as half a metre) up to which people are told from walls by odometry:
wrong stamps, and constant velocity alone, make movers of walls."""
MOST_POINTS = 240
"""Of a scan of more points every second, third, ... is aligned: beams nearer together than their lines are
long tell little of their own."""
TRUSTED = 0.025
"""Usual error of guesses up to which a scan near any of them is in doubt below POOR_AS_GUESSED alone."""
STEADY = 5
"""So many scans after the last keyframe one that fits poorly becomes the next, where there is no odometry:
what it sees is not on the map, and the next ones would fit nowhere."""
ENDED, FULL, DOUBT = 0, 1, 2


@kernel
def _every(points: int) -> int:
    """Every how manieth of so many points is aligned."""
    return max(1, -(-points // MOST_POINTS))


@kernel
def thinned(cloud: FloatArray) -> FloatArray:
    """As many points of a scan (K, 6) as are worth while, evenly spread."""
    every = _every(cloud.shape[0])
    return cloud if every == 1 else cloud[::every].copy()


@kernel
def _walls(points: FloatArray, step: FloatArray, led: bool, dt_s: float, tracked: Tracked) -> IntArray:
    """Guess a scan's motion, into ``out``, and tell which of its points (K, 2 or more) are no people (N,)."""
    track, map_, views, out = tracked
    motions, credible = guessed_motions(track.errors, track.velocity, step, led, dt_s)
    out.motions[: motions.shape[0]] = motions
    out.counts[0], out.counts[1] = motions.shape[0], credible
    track.moving[1] = np.nan
    if not led or track.errors.min() >= SURE_GUESS:
        return np.arange(points.shape[0])
    rows, track.moving[1] = without_movers(points, composed(track.pose, motions[0]), map_, views)
    track.crowded[0] += track.moving[1] >= MOST
    return rows


@kernel
def _is_sure(light: FloatArray, led: bool, others: FloatArray, tracked: Tracked) -> bool:
    """Place a scan (K, 6) by the motions that were guessed, and tell whether there is no doubt of it."""
    track, map_, _, out = tracked
    error = track.errors.min()
    leads = led and track.errors[0] == error
    motions, credible = out.motions[: out.counts[0]], out.counts[1]
    pose, hessian, start, told, split = placed(
        light, track.pose, motions, credible, leads, others, error, track.usual[0], not led, map_
    )
    out.counts[2] = split
    out.pose[:], out.hessian[:], out.start[:], out.told[:] = pose, hessian, start, told
    if not led:
        return is_best_near(light, track.pose, motions[:credible], error, track.usual[0], map_, out)
    # Seldom does a scan that lies where a trusted odometry has it fit better anywhere else; but from a long
    # guess an alignment may end in a wrong fit that is not poor.
    long = leads and distance(motions[0], np.zeros(3)) > LONG_M
    as_guessed = leads and told[1] < error
    near = error < TRUSTED and told[1] < CREDIBLE * error + CREDIBLE_OFF
    least = POOR_AS_GUESSED if as_guessed or near else POOR
    return bool(led and (as_guessed or not long) and told[0] >= (POOR if long else least) * track.usual[0])


@kernel
def look(
    cloud: FloatArray, step: FloatArray, led: bool, others: FloatArray, dt_s: float, tracked: Tracked
) -> tuple[FloatArray, FloatArray, bool]:
    """Place a scan (K, 6) by the guesses of its motion.

    Returns
    -------
    The scan without people, as much of it as was aligned, and whether it lies where ``out`` has it without a
    doubt.
    """
    rows = _walls(cloud, step, led, dt_s, tracked)
    kept = cloud if rows.shape[0] == cloud.shape[0] else cloud[rows]
    light = thinned(kept)
    return kept, light, _is_sure(light, led, others, tracked)


@kernel
def holds_along(pose: FloatArray, hessian: FloatArray, weight: float) -> bool:
    """Whether an alignment at a pose (3,), by points of so much weight, holds it along its heading."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    holds = c * c * hessian[0, 0] + 2.0 * c * s * hessian[0, 1] + s * s * hessian[1, 1]
    return bool(holds > HELD * weight)


@kernel
def settle(
    pose: FloatArray,
    hessian: FloatArray,
    start: FloatArray,
    told: FloatArray,
    step: FloatArray,
    led: bool,
    dt_s: float,
    track: Track,
) -> None:
    """Let a track go on to where a scan was found to lie; ``told`` as of ``placed``."""
    error = track.errors.min()
    leads = led and track.errors[0] == error
    add_slip(track.slip, track.held, start, pose, hessian, told[3], error, leads)
    track.fitted[0] = told[0] / track.usual[0]
    track.usual[0] += 0.02 * (told[0] - track.usual[0])
    track.usual[1] += 0.05 * (told[2] - track.usual[1])
    track.residuals[0] += told[2]
    track.residuals[1] += 1.0
    track.since[0] += 1
    track.moving[0] = track.moving[1]
    motion = between(track.pose, pose)
    if led:
        learn_wheels(track.wheels, step, motion, holds_along(pose, hessian, told[3]))
    learn_motion(track.errors, track.velocity, step, led, motion, dt_s)
    track.pose[:] = pose


@kernel
def is_new(motion: FloatArray, distance_m: float, turn_rad: float) -> bool:
    """Whether a scan is far enough from the last keyframe to become one."""
    return math.hypot(motion[0], motion[1]) > distance_m or abs(motion[2]) > turn_rad


@kernel
def leaves(track: Track, value: float, led: bool) -> bool:
    """Whether a scan that was placed with a fit sees so much that is on no map that it is a keyframe."""
    return bool(not led and track.since[0] >= STEADY and value < POOR * track.usual[0])


@kernel
def keep(
    scan: int,
    cloud: FloatArray,
    kept: FloatArray,
    hessian: FloatArray,
    led: bool,
    local: int,
    tracked: Tracked,
    out: Keyframes,
) -> None:
    """Make the last scan a keyframe.

    Parameters
    ----------
    cloud, kept
        (K, 2 or more) all of it, and (K, 6) what is left without people.
    led, local
        Whether there is odometry, and how many keyframes lend their points to the scans that follow.
    """
    track, map_, views, _ = tracked
    number = out.added[0]
    end = out.starts[number] + kept.shape[0]
    out.points[out.starts[number] : end] = kept
    out.scans[number], out.starts[number + 1] = scan, end
    out.hessians[number], out.slips[number] = hessian, track.slip + track.held @ track.held.T
    out.added[0] += 1
    track.slip[:], track.held[:], track.keyframe[:], track.since[0] = 0.0, 0.0, track.pose, 0
    if kept.shape[0] == 0:
        # Where nothing is in sight what was seen last stays what the next scans are looked for in.
        return
    add_to_map(map_, thinned(kept), track.pose, local, led)
    add_view(views, cloud, track.pose)


@kernel
def follow(
    recording: Recording,
    first: int,
    end: int,
    limits: FloatArray,
    local: int,
    tracked: Tracked,
    keyframes: Keyframes,
    poses: FloatArray,
    owners: IntArray,
) -> tuple[int, int, FloatArray, FloatArray, FloatArray]:
    """Place scans from ``first`` on, up to the first doubt or before ``end``.

    Parameters
    ----------
    limits
        (4,) nearest and farthest hit that counts, and the distance and turn of a keyframe from the last.
    local
        As in ``keep``.
    poses, owners
        (N, 3) and (N,) which of the new keyframes is each scan's last, -1: none of them. Filled here.

    Returns
    -------
    The scan at which it stopped, ``DOUBT`` (it is not placed: ``out`` has what the guesses made of it),
    ``FULL`` (there is no room for another keyframe) or ``ENDED``, and of the last scan all points (K, 2),
    those without people (K, 6), of a doubt only, and those that are aligned (K, 6).
    """
    track, map_, views, out = tracked
    led = recording.at_scans.shape[0] > 0
    rays, seen_from = np.zeros((0, 2)), -1
    seen, kept, light = np.zeros((0, 2)), np.zeros((0, 6)), np.zeros((0, 6))
    for i in range(first, end):
        beams = recording.beams[i]
        if not has_room(beams, map_, views, keyframes):
            return i, FULL, seen, kept, light
        if (
            seen_from < 0
            or beams != rays.shape[0]
            or recording.first_rad[i] != recording.first_rad[seen_from]
            or recording.step_rad[i] != recording.step_rad[seen_from]
        ):
            rays, seen_from = rays_of(recording.first_rad[i], recording.step_rad[i], beams), i
        points, hit = scan_points(recording.ranges_m[i, :beams], rays, limits[0], limits[1])
        step, others = motion_of(recording, i, track.wheels)
        dt_s = recording.dt_s[i]
        walls = np.flatnonzero(hit)
        seen = points[walls]
        walls = walls[_walls(seen, step, led, dt_s, tracked)]
        # A line is fitted where it is asked for: of a keyframe through every point.
        every = _every(walls.shape[0])
        light = lines_of(points, hit, walls[::every].copy(), recording.step_rad[i])
        if not _is_sure(light, led, others, tracked):
            kept = light if every == 1 else lines_of(points, hit, walls, recording.step_rad[i])
            return i, DOUBT, seen, kept, light
        move_anchor(recording, i, step, others, between(track.pose, out.pose))
        settle(out.pose, out.hessian, out.start, out.told, step, led, dt_s, track)
        if is_new(between(track.keyframe, track.pose), limits[2], limits[3]) or leaves(
            track, out.told[0], led
        ):
            every_line = light if every == 1 else lines_of(points, hit, walls, recording.step_rad[i])
            keep(i, seen, every_line, out.hessian, led, local, tracked, keyframes)
        poses[i], owners[i] = out.pose, keyframes.added[0] - 1
    return end, ENDED, seen, kept, light
