"""A localizer run over a recording, judged against its truth, and written into a run folder."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, Pose2
from pilotage.evaluation.log_metrics import log_metrics
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.leavings import drawn_grid, drawn_walls
from pilotage.experiments.recordings.drive import LIDAR, RecordedDrive
from pilotage.experiments.recordings.follow import Followed, bounds_of, build_localizer, follow
from pilotage.experiments.recordings.form import UNSET, Setting, told_format
from pilotage.experiments.recordings.parameters import shipped_parameters, with_overrides
from pilotage.experiments.recordings.reading import read_drive
from pilotage.experiments.recordings.stops import localize_stops
from pilotage.logs.trajectories import write_planar_tum
from pilotage.records.run_folder import RobotFiles, RunFiles, write_run
from pilotage.records.trace import trace_of
from pilotage.records.world import RobotOutline, World, landmarks_of
from pilotage.stack.localization.localizer import LOCALIZERS

DEFAULT, ON_WALLS, ON_LANDMARKS = "ekf-gauss-markov", "particle-filter", "ekf-landmarks"
"""Which localizer is taken: of robots with parameters learned, of a laser's recording, of one without."""
TRAJECTORY = "trajectory.tum"


@dataclass(frozen=True, slots=True)
class LocalizedLog:
    """Metrics by their JSON keys, the run folder, and a line for each row of the log that was left out."""

    metrics: dict[str, object]
    run_dir: Path
    left_out: list[str]


def localize_log(
    log: Path,
    out: Path,
    *,
    form: str | None = None,
    robot: int | None = None,
    localizer: str | None = None,
    overrides: Sequence[str] = (),
    max_range_m: float | None = None,
    setting: Setting = UNSET,
) -> LocalizedLog:
    """Run a localizer over a recording and write its run folder; a rover's stops have one of their own."""
    form = told_format(log) if form is None else form
    if form == "stops":
        chosen = robot, max_range_m, overrides or None, localizer, None if setting == UNSET else setting
        if any(value is not None for value in chosen):
            raise InputError(
                f"localize: '{log}' is read as a rover's stops (CSV), which takes no --robot, --localizer, "
                "--max-range, --set, --map and the like; scans and landmarks come in bags, MCAP files, "
                "MRCLAM folders and AER1513's .mat (--format)"
            )
        return LocalizedLog(*localize_stops(log, out), [])
    drive = read_drive(log, form, robot, max_range_m, setting)
    if localizer is None:
        localizer = DEFAULT if form != "bag" else ON_WALLS if LIDAR in drive.sensors else ON_LANDMARKS
    shipped, learned_from = shipped_parameters(drive, localizer, form)
    parameters = with_overrides(localizer, shipped, overrides)
    config = LOCALIZERS.configure(localizer, parameters, "stack.localizer")
    follow(drive, *build_localizer(drive, localizer, config), steps=50)  # compiles: not part of the speed
    followed = follow(drive, *build_localizer(drive, localizer, config))
    trace, loop_s = followed.trace, followed.took_s
    steps = drive.t_s.shape[0] - 1
    scores, trace["nees"] = log_metrics(trace, followed.localized, told=drive.start is not None)
    metrics: dict[str, object] = {
        "mission": f"localize-{drive.name}-{localizer}",
        **_verdict(scores, followed.localized),
        "format": form,
        "robot": robot,
        "localizer": localizer,
        "learned_from": learned_from,
        "overrides": list(overrides),
        **_gyroscope(drive, followed.trace),
        "duration_s": float(drive.t_s[-1]),
        "steps": steps,
        "wall_time_s": loop_s,
        "steps_per_s": steps / loop_s,
        **scores,
        "localized_share": float(np.mean(followed.localized)),
        "recoveries": sum(event.kind == "recovery" for event in followed.events),
        "truth_gaps": drive.truth_gaps,
        "odometry_gaps": drive.odometry_gaps,
        "misread_barcodes": len(drive.misread),
        "stale_odometry_rows": len(drive.stale),
    }
    metrics |= METRICS.computed("localize", trace, metrics)
    return _write(out, drive, metrics, followed, {"name": localizer, **config.model_dump(mode="json")})


def _gyroscope(drive: RecordedDrive, trace: Mapping[str, FloatArray]) -> dict[str, object]:
    """Which gyroscope the localizer made use of, and its bias at the end."""
    bias = trace.get("gyro_bias_rad_s")
    if drive.turning is None or bias is None or not len(bias):
        return {}
    return {"gyroscope": drive.turning[0], "gyro_bias_rad_s": float(bias[-1])}


def _verdict(scores: dict[str, object], localized: BoolArray) -> dict[str, object]:
    """Judged by the truth; where nobody knows it, by whether the localizer holds itself for lost."""
    if scores.get("scored_steps"):
        lost = bool(scores.get("lost", False))
        return {"success": not lost, "reason": "the localizer is lost at the end" if lost else ""}
    told = f"no truth is known; it held itself for localized {100.0 * np.mean(localized):.1f} % of the time"
    return {"success": bool(localized[-1]), "reason": told}


def _first_known(followed: Followed) -> FloatArray:
    """(3,) the first pose that the localizer was sure of, or its very first."""
    trace, at = followed.trace, int(np.argmax(followed.localized))
    return np.array([trace[f"est_{part}"][at] for part in ("x_m", "y_m", "theta_rad")])


def _write(
    out: Path,
    drive: RecordedDrive,
    metrics: dict[str, object],
    followed: Followed,
    localizer: dict[str, Any],
) -> LocalizedLog:
    """Write the run folder, complete or not at all; besides the path by the log's clock, while localized."""
    settings = yaml.safe_dump({"recording": drive.name, "stack": {"localizer": localizer}}, sort_keys=False)
    chart, trace = drive.chart, followed.trace
    digest = hashlib.sha256(f"{settings}{drive.begin_s}{len(drive.t_s)}".encode()).hexdigest()[:8]
    begin = drive.start or Pose2.from_array(_first_known(followed))
    world = World(
        segments_m=np.zeros((0, 4)) if chart is None else drawn_walls(chart),
        circles_m=np.zeros((0, 3)) if chart is None else chart.walls.circles_m,
        bounds_m=bounds_of(drive),
        landmarks=landmarks_of(drive.landmarks.ids, drive.landmarks.points_xy_m),
        robots=(RobotOutline(start=(begin.x_m, begin.y_m, begin.theta_rad)),),
    )
    files = RunFiles(
        trace_of(trace),
        metrics,
        tuple(followed.events),
        localizer_text=settings,
        world=world,
        grid=None if chart is None else drawn_grid(chart),
        robots=(RobotFiles(sightings=followed.seen.seen()),),
    )
    final = write_run(out, f"{metrics['mission']}-{digest}", files)
    poses = np.column_stack([trace[f"est_{part}"] for part in ("x_m", "y_m", "theta_rad")])
    known = followed.localized
    write_planar_tum(final / TRAJECTORY, drive.begin_s + trace["t_s"][known], poses[known])
    metrics = {**metrics, "run_dir": str(final)}
    left_out = [*drive.warnings]
    if drive.turning is not None and "gyroscope" not in metrics:
        left_out.append(f"'{metrics['localizer']}' makes no use of the gyroscope {drive.turning[0]}")
    left_out += [f"{place}: left out, its time lies after the next row's" for place in drive.stale]
    left_out += [f"{place}: left out, nobody wears this barcode" for place in drive.misread]
    return LocalizedLog(metrics, final, left_out)
