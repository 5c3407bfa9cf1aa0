"""A localizer run over a recording, judged against its truth, and written into a run folder."""

from __future__ import annotations

import hashlib
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import STOP, BoolArray, Command, Event, FloatArray, Pose2
from pilotage.evaluation.log_metrics import log_metrics
from pilotage.experiments.build.charts import load_chart
from pilotage.experiments.leavings import drawn_grid, drawn_walls
from pilotage.experiments.mission import read_parameters
from pilotage.experiments.recorder import BELIEF_COLUMNS, TRUTH_COLUMNS
from pilotage.experiments.recordings.bag_drive import bag_drive
from pilotage.experiments.recordings.drive import (
    LIDAR,
    RecordedDrive,
    RecordedSource,
    aer1513_drive,
    mrclam_drive,
)
from pilotage.experiments.recordings.parameters import shipped_parameters
from pilotage.experiments.recordings.stops import localize_stops
from pilotage.experiments.sightings import Sightings
from pilotage.experiments.source import stepped
from pilotage.experiments.values import apply_override, merge
from pilotage.logs.bag_messages import is_bag
from pilotage.logs.trajectories import write_planar_tum
from pilotage.maps.landmark_table import read_landmark_table
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.records.run_folder import RobotFiles, RunFiles, write_run
from pilotage.records.trace import trace_of
from pilotage.records.world import RobotOutline, World, landmarks_of
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief, BeliefStatus, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.localizer import LOCALIZERS, Localizer

FORMATS = ("bag", "mrclam", "aer1513", "stops")
START_STDS = (0.05, 0.05, 0.03)
"""Metres, metres and radians of the start, whose mean is the true pose."""
DEFAULT, ON_WALLS, ON_LANDMARKS = "ekf-gauss-markov", "particle-filter", "ekf-landmarks"
"""Which localizer is taken: of robots with parameters learned, of a laser's recording, of one without."""
TRAJECTORY = "trajectory.tum"
SUMS = ("beacons_seen", "beacons_accepted", "nis", "nis_dof", "nis_expected")
"""Telemetry that adds up between scored steps; of the rest the last value is kept."""


@dataclass(frozen=True, slots=True)
class LocalizedLog:
    """Metrics by their JSON keys, the run folder, and a line for each row of the log that was left out."""

    metrics: dict[str, object]
    run_dir: Path
    left_out: list[str]


@dataclass(frozen=True, slots=True)
class Setting:
    """What a bag does not say of itself, by the options of ``pilotage localize``.

    Attributes
    ----------
    map
        A shipped map's name or a map file; None where landmarks are all that is known.
    landmarks
        A CSV table id, x_m, y_m; None: those of the map.
    start
        Where the robot was; None: where the truth says.
    topics, truth, from_s, to_s
        As ``bag_drive`` has them.
    """

    map: str | None = None
    landmarks: Path | None = None
    start: Pose2 | None = None
    topics: tuple[str, ...] = ()
    truth: str | None = None
    from_s: float = 0.0
    to_s: float = math.inf


UNSET = Setting()


def told_format(log: Path) -> str:
    """What a recording is, by what it holds.

    Raises
    ------
    InputError
        Where nothing is there.
    """
    if not log.exists():
        raise InputError(f"{log}: expected a recording, found nothing there")
    if log.is_dir():
        return "mrclam" if (log / "Barcodes.dat").exists() else "bag"
    if is_bag(log):
        return "bag"
    return {".mat": "aer1513", ".csv": "stops"}.get(log.suffix.lower(), "bag")


def read_drive(
    log: Path, form: str, robot: int | None, max_range_m: float | None = None, setting: Setting = UNSET
) -> RecordedDrive:
    """Read a recording.

    Raises
    ------
    InputError
        Where the options do not suit the format, or the recording is not what it should be.
    """
    if form != "bag" and setting != UNSET:
        raise InputError(
            "localize: --map, --landmarks, --start, --topic, --truth, --from and --to are for bags and laser "
            f"logs, found --format {form}"
        )
    if max_range_m is not None and form != "aer1513":
        raise InputError("localize: --max-range is for --format aer1513")
    if form == "mrclam":
        if robot is None:
            raise InputError("localize: expected --robot N for a MRCLAM data set, found none")
        return mrclam_drive(log, robot)
    if robot is not None:
        raise InputError(f"localize: --robot is for --format mrclam; '{log.name}' holds one robot")
    if form == "aer1513":
        return aer1513_drive(log, max_range_m)
    return bag_drive(
        log,
        _chart(log, setting),
        start=setting.start,
        topics=setting.topics,
        truth=setting.truth,
        from_s=setting.from_s,
        to_s=setting.to_s,
    )


def _chart(log: Path, setting: Setting) -> WorldMap:
    marks = None if setting.landmarks is None else read_landmark_table(setting.landmarks)
    if setting.map is not None:
        chart = load_chart(setting.map)
        return chart if marks is None else chart.with_landmarks(marks)
    if marks is None or not len(marks.ids):
        raise InputError(
            f"{log}: expected --map MAP (for scans) or --landmarks TABLE (for landmarks) to localize in, "
            "found neither; 'pilotage slam' makes a map"
        )
    (xmin, ymin), (xmax, ymax) = marks.points_xy_m.min(axis=0), marks.points_xy_m.max(axis=0)
    bounds = (float(xmin) - 0.5, float(ymin) - 0.5, float(xmax) + 0.5, float(ymax) + 0.5)
    return WorldMap("landmarks", bounds, landmarks=marks)


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
    scores, trace["nees"] = log_metrics(trace)
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


def with_overrides(localizer: str, parameters: dict[str, Any], overrides: Sequence[str]) -> dict[str, Any]:
    """Lay ``stack.localizer.key=value`` and ``@FILE`` over a localizer's parameters."""
    values: dict[str, Any] = {"stack": {"localizer": {"name": localizer, **parameters}}}
    for override in overrides:
        if override.startswith("@"):
            values = merge(values, _only_the_localizer(override[1:], read_parameters(override[1:])))
        elif override.startswith("stack.localizer.") and not override.startswith("stack.localizer.name"):
            apply_override(values, override)
        else:
            raise InputError(
                f"--set {override}: expected stack.localizer.KEY=VALUE; the rest is the recording's, "
                "the localizer's name comes by --localizer"
            )
    chosen = dict(values["stack"]["localizer"])
    if chosen.pop("name") != localizer:
        raise InputError(
            f"--set: the parameters are of another localizer than '{localizer}'; use --localizer"
        )
    return chosen


def _only_the_localizer(file: str, values: dict[str, Any]) -> dict[str, Any]:
    """Refuse parameters that a recording has no use for, and what is no mapping."""
    at: Any = values
    for key in ("stack", "localizer"):
        found = [str(name) for name in at] if isinstance(at, dict) else type(at).__name__
        if not isinstance(at, dict) or list(at) != [key]:
            raise InputError(f"{file}: expected parameters of stack.localizer and no others, found {found}")
        at = at[key]
    if not isinstance(at, dict):
        raise InputError(f"{file}: stack.localizer: expected a mapping of keys, found {at!r}")
    return values


def build_localizer(drive: RecordedDrive, name: str, config: Config) -> tuple[Localizer, Journal]:
    """The localizer with what the recorded robot knew before it started, and the journal that it writes."""
    start = drive.truth[0] if drive.start is None else drive.start.as_array()
    if not np.isfinite(start).all():
        raise InputError(
            f"{drive.name}: expected --start X,Y,TH or the truth at the begin, found neither"
            if drive.chart is not None
            else f"{drive.name}: expected the truth at the begin, found a gap there"
        )
    initial = Belief(Pose2.from_array(start), np.diag(np.square(START_STDS)))
    dt_s = float(np.median(np.diff(drive.t_s))) if drive.chart is not None else float(drive.t_s[1])
    robot = RobotKnowledge(Footprint.disc(0.2), drive.motion, drive.sensors, dt_s, RandomStreams(0))
    bounds_m = _bounds(drive)
    floor = SegmentMap(np.zeros((0, 4)), np.zeros((0, 3)), bounds_m)
    chart = drive.chart or WorldMap(drive.name, bounds_m, floor, landmarks=drive.landmarks)
    journal = Journal()
    return LOCALIZERS.entry(name).factory(config, robot, chart, initial, journal), journal


class _Listener:
    """A stack that localizes and commands nothing: the recorded robot was driven by somebody else.

    Attributes
    ----------
    took_s
        Wall time in the localizer.
    """

    def __init__(self, localizer: Localizer) -> None:
        self._localizer, self.took_s = localizer, 0.0
        self.status = (StackStatus.RUNNING, "")

    @property
    def belief(self) -> Belief:
        """The localizer's."""
        return self._localizer.belief

    def step(self, readings: Readings) -> Command:
        """Localize."""
        begin = time.perf_counter()
        self._localizer.step(readings)
        self.took_s += time.perf_counter() - begin
        return STOP


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """What a localizer made of a drive.

    Attributes
    ----------
    trace
        At the scored steps, by column.
    localized
        (N,) whether it held itself for localized, at the same steps.
    events, took_s
        What it told, and its wall time.
    seen
        Scans and landmarks, as a replay keeps them.
    """

    trace: dict[str, FloatArray]
    localized: BoolArray
    events: list[Event]
    took_s: float
    seen: Sightings


def follow(
    drive: RecordedDrive, localizer: Localizer, journal: Journal, steps: int | None = None
) -> Followed:
    """Step a localizer through a drive."""
    names = tuple(journal.units)
    told_recoveries = names.index("recoveries") if "recoveries" in names else None
    sums = [name in SUMS for name in names]
    rows: list[list[float]] = []
    events: list[Event] = []
    total = [math.nan] * len(names)
    recoveries = 0.0
    localized: list[bool] = []
    seen = Sightings(dict(drive.sensors))
    source, listener = RecordedSource(drive), _Listener(localizer)
    for (readings,), _ in stepped(source, [listener]):
        k = source.at
        for i, value in enumerate(journal.row):
            if not sums[i] or math.isnan(total[i]):
                total[i] = value
            elif not math.isnan(value):
                total[i] += value
        if told_recoveries is not None and journal.row[told_recoveries] > recoveries:
            recoveries = journal.row[told_recoveries]
            events.append(
                Event(
                    readings.t_s,
                    "recovery",
                    "several readings in a row were rejected: the pose is trusted less",
                )
            )
        if drive.scored[k]:
            pose, cov = listener.belief.pose, listener.belief.cov
            upper = (cov[0, 0], cov[0, 1], cov[1, 1], cov[0, 2], cov[1, 2], cov[2, 2])
            x, y, theta = drive.truth[k]
            heading = (theta + math.pi) % (2.0 * math.pi) - math.pi
            rows.append([readings.t_s, x, y, heading, *pose.as_array(), *upper, *total])
            localized.append(listener.belief.status is BeliefStatus.LOCALIZED)
            seen.record(readings)
            total = [math.nan] * len(names)
        if steps is not None and k >= steps:
            break
    columns = (*TRUTH_COLUMNS, *BELIEF_COLUMNS, *names)
    table = np.array(rows, dtype=np.float64).reshape(-1, len(columns))
    return Followed(
        {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(columns)},
        np.array(localized, dtype=np.bool_),
        events,
        listener.took_s,
        seen,
    )


def _bounds(drive: RecordedDrive) -> tuple[float, float, float, float]:
    if drive.chart is not None:
        return drive.chart.bounds_m
    known = drive.truth[np.isfinite(drive.truth).all(axis=1), :2]
    points = np.concatenate([drive.landmarks.points_xy_m, known])
    (xmin, ymin), (xmax, ymax) = points.min(axis=0) - 0.5, points.max(axis=0) + 0.5
    return float(xmin), float(ymin), float(xmax), float(ymax)


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
    x, y, theta = drive.truth[0].tolist() if drive.start is None else drive.start.as_array().tolist()
    world = World(
        segments_m=np.zeros((0, 4)) if chart is None else drawn_walls(chart),
        circles_m=np.zeros((0, 3)) if chart is None else chart.walls.circles_m,
        bounds_m=_bounds(drive),
        landmarks=landmarks_of(drive.landmarks.ids, drive.landmarks.points_xy_m),
        robots=(RobotOutline(start=(x, y, theta)),),
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
