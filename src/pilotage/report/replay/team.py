"""The scene of a run with several robots: all of them on one map, each in its colour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.records.run_data import RunData
from pilotage.report.replay.floor import floor_scene
from pilotage.report.replay.scene import Marks, PathTrack, PoseTrack, ReplayScene, Series, SightTrack
from pilotage.report.style import BLUE, GREEN
from pilotage.report.team import colour_of


def team_scene(team: Sequence[RunData]) -> ReplayScene | None:
    """Return what there is to replay; None where no robot left a path.

    All tracks share the frames of the robot that has most of them; another one is drawn as long as its own
    time lasts.
    """
    scenes = [(run, scene) for run in team if (scene := floor_scene(run)) is not None]
    if not scenes:
        return None
    _, main = max(scenes, key=lambda pair: len(pair[1].t_s))
    poses: list[PoseTrack] = []
    sights: list[SightTrack] = []
    scans, paths, goals = [], [], []
    marks = [mark for mark in main.marks if mark.name not in ("start", "goal")]
    starts = []
    for run, scene in scenes:
        colour, first = colour_of(run.robot), len(poses)
        poses += [_pose(run, track, scene.t_s, main.t_s, colour) for track in scene.poses[:2]]
        # Scans of many robots would be most of the page.
        scans += [
            replace(
                track,
                name="scans",
                t_s=track.t_s[:: len(scenes)],
                ranges_m=track.ranges_m[:: len(scenes)],
                poses=track.poses[:: len(scenes)],
                colour=colour,
            )
            for track in scene.scans
        ]
        if len(scene.t_s) == len(main.t_s):
            sights += [replace(track, seen_from=first) for track in scene.sights]
        paths += [PathTrack("plans", track.t_s, track.paths_m, colour) for track in scene.paths]
        if run.outline.start is not None:
            starts.append((run.outline.name, run.outline.start[:2]))
        goals += [(run.outline.name, goal[:2]) for goal in run.outline.goals]
    for name, places, look in (("starts", starts, "ring"), ("goals", goals, "cross")):
        if places:
            points = np.array([place for _, place in places], dtype=np.float64)
            marks.append(Marks(name, points, tuple(label for label, _ in places), "muted", look))
    return replace(
        main,
        poses=tuple(poses),
        scans=tuple(scans),
        sights=tuple(sights),
        paths=tuple(paths),
        marks=tuple(marks),
        lines=tuple(line for line in main.lines if line.name != "goal"),
        states=None,
        series=_series(scenes, main.t_s),
        breaks=np.unique(np.concatenate([scene.breaks for _, scene in scenes])),
    )


def _pose(run: RunData, track: PoseTrack, t_s: FloatArray, frames_s: FloatArray, colour: str) -> PoseTrack:
    """A robot's pose, or its estimate, at the frames of the team."""
    estimate = track.look == "outline"
    at = _rows(t_s, frames_s)

    def shown(values: FloatArray) -> FloatArray:
        out = np.full((len(frames_s), *values.shape[1:]), np.nan)
        out[at >= 0] = values[at[at >= 0]]
        return out

    return replace(
        track,
        name="estimates, 95 % ellipses" if estimate else run.outline.name or f"robot {run.robot}",
        x_m=shown(track.x_m),
        y_m=shown(track.y_m),
        theta_rad=shown(track.theta_rad),
        cov_m2=None if track.cov_m2 is None else shown(track.cov_m2),
        colour=colour,
        # Of several lost robots the map says enough.
        absent="",
    )


def _rows(t_s: FloatArray, frames_s: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """(F,) row of a robot's own frames that holds at each frame of the team; -1 outside its time."""
    rows = np.searchsorted(t_s, frames_s + 1e-9, side="right").astype(np.int64) - 1
    rows[frames_s > t_s[-1] + 1e-9] = -1
    return rows


def _series(scenes: Sequence[tuple[RunData, ReplayScene]], frames_s: FloatArray) -> tuple[Series, ...]:
    """The worst of the team at each frame."""
    out = []
    wanted = (
        ("position error", "worst position error", BLUE, np.fmax),
        ("clearance", "least clearance", GREEN, np.fmin),
    )
    for title, said, colour, worst in wanted:
        values = np.full(len(frames_s), np.nan)
        for _, scene in scenes:
            at = _rows(scene.t_s, frames_s)
            for own in scene.series:
                if own.title == title:
                    values[at >= 0] = worst(values[at >= 0], own.values[at[at >= 0]])
        if bool(np.isfinite(values).any()):
            out.append(Series(said, "m", values, colour))
    return tuple(out)
