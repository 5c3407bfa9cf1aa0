"""The angle between beams: what is told may be one beam off, which only closed loops can notice."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pilotage.logs.laser_log import LaserLog, is_built_step
from pilotage.stack.mapping.slam.back_end import LoopCloser, refined, weak_edges
from pilotage.stack.mapping.slam.clouds import Clouds, cloud_of
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.tracker import LocalTrack

SPACING_STEP, MOST_SPACING_OFF = 0.005, 0.015
LEAST_GAIN = 0.05
"""Share by which the objective must fall before another spacing of the beams is believed."""
TOWARDS_TOLD = 1.0 / 3.0
"""Where the objective is least, as a share of the way to the told spacing, from which that one is believed:
it lies nearer to the other one, with which the track was matched."""
MOST_PAIRS = 8000
"""Pairs of keyframes that tell: more of them tell it no better."""


def told_angles_fit(log: LaserLog, track: LocalTrack, closer: LoopCloser, config: SlamConfig) -> bool:
    """Whether the aligned keyframes contradict each other less with the angles that the log tells.

    Where a field of view was divided by one beam too few the reader takes the angle that scanners are built
    with. It is a guess; with closed loops the scans decide: by the parabola through the objectives of both
    and of a spacing as far off on the other side, for where few scans turn both fit almost as well.
    """
    if log.told_angles is None or not len(closer.closing):
        return False
    told = float(np.median(log.told_angles[:, 1] / log.angle_step_rad))
    objective = _objective(log, track, closer, config)
    below, here, above = objective(2.0 - told), objective(1.0), objective(told)
    curvature = below - 2.0 * here + above
    return 0.5 * (below - above) > TOWARDS_TOLD * max(curvature, 0.0)


def beam_spacing(log: LaserLog, track: LocalTrack, closer: LoopCloser, config: SlamConfig) -> float:
    """Estimate the angle between beams: the one with which the aligned keyframes contradict each other least.

    Some drivers and converters tell a field of view that is one beam off. Where the robot turns, half a per
    cent of wrong spacing turns the map by degrees, which no alignment of single scans can notice. An angle
    that scanners are built with is believed; without closed loops any is.
    """
    if is_built_step(log.angle_step_rad).all() or not len(closer.closing):
        return 1.0
    of = _objective(log, track, closer, config)
    objectives: dict[int, float] = {}

    def objective(steps: int) -> float:
        if steps not in objectives:
            objectives[steps] = of(1.0 + SPACING_STEP * steps)
        return objectives[steps]

    # Down to where both neighbours are higher: a parabola tells nothing of what lies beside its points.
    best, most = 0, round(MOST_SPACING_OFF / SPACING_STEP)
    while abs(best) < most:
        lower = min((best - 1, best, best + 1), key=objective)
        if lower == best:
            break
        best = lower
    if abs(best) == most:
        return 1.0
    below, here, above = objective(best - 1), objective(best), objective(best + 1)
    curvature = below - 2.0 * here + above
    off = 0.5 * (below - above) / curvature if curvature > 0.0 else 0.0
    expected = here - 0.5 * curvature * off * off
    return 1.0 + SPACING_STEP * (best + off) if expected < (1.0 - LEAST_GAIN) * objective(0) else 1.0


def _objective(
    log: LaserLog, track: LocalTrack, closer: LoopCloser, config: SlamConfig
) -> Callable[[float], float]:
    """Return what the refined graph's objective is with a spacing over that of the log."""
    own = weak_edges(track)
    closer.sure()  # before there are other points: what it needs is large as well

    def objective(spacing: float) -> float:
        clouds = keyframe_clouds(log, track, config, spacing)
        return refined(closer, clouds, own, rounds=2, most=MOST_PAIRS).objective

    return objective


def keyframe_clouds(log: LaserLog, track: LocalTrack, config: SlamConfig, spacing: float) -> Clouds:
    """Points of the keyframes with another spacing of the beams."""
    clouds = (cloud_of(log, int(k), config.max_range_m, spacing) for k in track.keyframes)
    return Clouds.filled(clouds, int(log.beams[track.keyframes].sum()))
