"""A localizer run over a recording, judged against its truth, and written into a run folder."""

from __future__ import annotations

import hashlib
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import STOP, Command, Event, FloatArray, Pose2
from pilotage.evaluation.log_metrics import log_metrics
from pilotage.experiments.mission import read_parameters
from pilotage.experiments.recorder import BELIEF_COLUMNS, TRUTH_COLUMNS
from pilotage.experiments.recordings.drive import RecordedDrive, RecordedSource, aer1513_drive, mrclam_drive
from pilotage.experiments.recordings.parameters import shipped_parameters
from pilotage.experiments.recordings.stops import localize_stops
from pilotage.experiments.source import stepped
from pilotage.experiments.values import apply_override, merge
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.records.run_folder import RunFiles, write_run
from pilotage.records.trace import trace_of
from pilotage.records.world import RobotOutline, World, landmarks_of
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.localizer import LOCALIZERS, Localizer

FORMATS = ("mrclam", "aer1513", "stops")
START_STDS = (0.05, 0.05, 0.03)
"""Metres, metres and radians of the start, whose mean is the true pose."""
DEFAULT = "ekf-gauss-markov"
SUMS = ("beacons_seen", "beacons_accepted", "nis", "nis_dof", "nis_expected")
"""Telemetry that adds up between scored steps; of the rest the last value is kept."""


@dataclass(frozen=True, slots=True)
class LocalizedLog:
    """Metrics by their JSON keys, the run folder, and a line for each row of the log that was left out."""

    metrics: dict[str, object]
    run_dir: Path
    left_out: list[str]


def read_drive(log: Path, form: str, robot: int | None, max_range_m: float | None = None) -> RecordedDrive:
    """Read a recording.

    Raises
    ------
    InputError
        Where the options do not suit the format, or the recording is not what it should be.
    """
    if form == "mrclam":
        if robot is None:
            raise InputError("localize: expected --robot N for a MRCLAM data set, found none")
        if max_range_m is not None:
            raise InputError("localize: --max-range is for --format aer1513")
        return mrclam_drive(log, robot)
    if robot is not None:
        raise InputError("localize: --robot is for --format mrclam; an AER1513 file holds one robot")
    return aer1513_drive(log, max_range_m)


def localize_log(
    log: Path,
    out: Path,
    *,
    form: str,
    robot: int | None = None,
    localizer: str = DEFAULT,
    overrides: Sequence[str] = (),
    max_range_m: float | None = None,
) -> LocalizedLog:
    """Run a localizer over a recording and write its run folder; a rover's stops have one of their own."""
    if form == "stops":
        if robot is not None or max_range_m is not None or overrides or localizer != DEFAULT:
            raise InputError(
                "localize: --format stops takes no --robot, --localizer, --max-range or --set: it learns "
                "from the log itself"
            )
        return LocalizedLog(*localize_stops(log, out), [])
    drive = read_drive(log, form, robot, max_range_m)
    shipped, learned_from = shipped_parameters(drive, localizer, form)
    parameters = with_overrides(localizer, shipped, overrides)
    config = LOCALIZERS.configure(localizer, parameters, "stack.localizer")
    follow(drive, *build_localizer(drive, localizer, config), steps=50)  # compiles: not part of the speed
    trace, events, loop_s = follow(drive, *build_localizer(drive, localizer, config))
    steps = drive.t_s.shape[0] - 1
    scores, trace["nees"] = log_metrics(trace)
    success = bool(scores.get("scored_steps")) and not scores.get("lost", False)
    metrics: dict[str, object] = {
        "mission": f"localize-{drive.name}-{localizer}",
        "success": success,
        "reason": "" if success else "the localizer is lost at the end, or no truth is known to tell",
        "format": form,
        "robot": robot,
        "localizer": localizer,
        "learned_from": learned_from,
        "overrides": list(overrides),
        "duration_s": float(drive.t_s[-1]),
        "steps": steps,
        "wall_time_s": loop_s,
        "steps_per_s": steps / loop_s,
        **scores,
        "recoveries": sum(event.kind == "recovery" for event in events),
        "truth_gaps": drive.truth_gaps,
        "odometry_gaps": drive.odometry_gaps,
        "misread_barcodes": len(drive.misread),
        "stale_odometry_rows": len(drive.stale),
    }
    return _write(out, drive, metrics, trace, events, {"name": localizer, **config.model_dump(mode="json")})


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
    start = drive.truth[0]
    if not np.isfinite(start).all():
        raise InputError(f"{drive.name}: expected the truth at the begin, found a gap there")
    initial = Belief(Pose2.from_array(start), np.diag(np.square(START_STDS)))
    dt_s = float(drive.t_s[1] - drive.t_s[0])
    robot = RobotKnowledge(
        Footprint.disc(0.2), DifferentialDriveConfig(), drive.sensors, dt_s, RandomStreams(0)
    )
    bounds_m = _bounds(drive)
    floor = SegmentMap(np.zeros((0, 4)), np.zeros((0, 3)), bounds_m)
    chart = WorldMap(drive.name, bounds_m, floor, landmarks=drive.landmarks)
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


def follow(
    drive: RecordedDrive, localizer: Localizer, journal: Journal, steps: int | None = None
) -> tuple[dict[str, FloatArray], list[Event], float]:
    """Step a localizer through a drive; returns the trace at the scored steps, events and wall time."""
    names = tuple(journal.units)
    told_recoveries = names.index("recoveries") if "recoveries" in names else None
    sums = [name in SUMS for name in names]
    rows: list[list[float]] = []
    events: list[Event] = []
    total = [math.nan] * len(names)
    recoveries = 0.0
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
            total = [math.nan] * len(names)
        if steps is not None and k >= steps:
            break
    columns = (*TRUTH_COLUMNS, *BELIEF_COLUMNS, *names)
    table = np.array(rows, dtype=np.float64).reshape(-1, len(columns))
    return (
        {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(columns)},
        events,
        listener.took_s,
    )


def _bounds(drive: RecordedDrive) -> tuple[float, float, float, float]:
    known = drive.truth[np.isfinite(drive.truth).all(axis=1), :2]
    points = np.concatenate([drive.landmarks.points_xy_m, known])
    (xmin, ymin), (xmax, ymax) = points.min(axis=0) - 0.5, points.max(axis=0) + 0.5
    return float(xmin), float(ymin), float(xmax), float(ymax)


def _write(
    out: Path,
    drive: RecordedDrive,
    metrics: dict[str, object],
    trace: dict[str, FloatArray],
    events: list[Event],
    localizer: dict[str, Any],
) -> LocalizedLog:
    """Write the run folder, complete or not at all."""
    settings = yaml.safe_dump({"recording": drive.name, "stack": {"localizer": localizer}}, sort_keys=False)
    digest = hashlib.sha256(settings.encode()).hexdigest()[:8]
    x, y, theta = (float(value) for value in drive.truth[0])
    world = World(
        bounds_m=_bounds(drive),
        landmarks=landmarks_of(drive.landmarks.ids, drive.landmarks.points_xy_m),
        robots=(RobotOutline(start=(x, y, theta)),),
    )
    files = RunFiles(trace_of(trace), metrics, tuple(events), localizer_text=settings, world=world)
    final = write_run(out, f"{metrics['mission']}-{digest}", files)
    metrics = {**metrics, "run_dir": str(final)}
    left_out = [f"{place}: left out, its time lies after the next row's" for place in drive.stale]
    left_out += [f"{place}: left out, nobody wears this barcode" for place in drive.misread]
    return LocalizedLog(metrics, final, left_out)
