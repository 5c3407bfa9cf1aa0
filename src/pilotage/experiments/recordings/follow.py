"""A localizer stepped through a recorded drive: what it held for true, beside the truth."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import STOP, BoolArray, Command, Event, FloatArray, Pose2
from pilotage.experiments.recorder import BELIEF_COLUMNS, TRUTH_COLUMNS
from pilotage.experiments.recordings.drive import RecordedDrive, RecordedSource
from pilotage.experiments.sightings import Sightings
from pilotage.experiments.source import stepped
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief, BeliefStatus, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.localizer import LOCALIZERS, Localizer, StartNeededError

START_STDS = (0.05, 0.05, 0.03)
"""Metres, metres and radians of the start, whose mean is the true pose."""
SUMS = ("beacons_seen", "beacons_accepted", "nis", "nis_dof", "nis_expected")
"""Telemetry that adds up between scored steps; of the rest the last value is kept."""


def build_localizer(drive: RecordedDrive, name: str, config: Config) -> tuple[Localizer, Journal]:
    """The localizer with what the recorded robot knew before it started, and the journal that it writes.

    Raises
    ------
    InputError
        Where nobody knows the start, and the localizer does not find itself.
    """
    bounds_m = bounds_of(drive)
    sure = np.diag(np.square(START_STDS))
    initial = Belief.anywhere(bounds_m) if drive.start is None else Belief(drive.start, sure)
    dt_s = float(np.median(np.diff(drive.t_s))) if drive.chart is not None else float(drive.t_s[1])
    robot = RobotKnowledge(Footprint.disc(0.2), drive.motion, drive.sensors, dt_s, RandomStreams(0))
    floor = SegmentMap(np.zeros((0, 4)), np.zeros((0, 3)), bounds_m)
    chart = drive.chart or WorldMap(drive.name, bounds_m, floor, landmarks=drive.landmarks)
    journal = Journal()
    try:
        return LOCALIZERS.entry(name).factory(config, robot, chart, initial, journal), journal
    except StartNeededError:
        raise InputError(
            f"{drive.name}: expected --start X,Y,TH or the truth at the begin, found neither; of a map with "
            "walls, and of scans, particle-filter needs none"
            if drive.chart is not None
            else f"{drive.name}: expected the truth at the begin, found a gap there"
        ) from None


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
    sums = [i for i, name in enumerate(names) if name in SUMS]
    rows: list[list[float]] = []
    events: list[Event] = []
    total = [math.nan] * len(names)
    recoveries = 0.0
    localized: list[bool] = []
    seen = Sightings(dict(drive.sensors))
    source, listener = RecordedSource(drive), _Listener(localizer)
    for (readings,), _ in stepped(source, [listener]):
        k = source.at
        for i in sums:
            value = journal.row[i]
            if math.isnan(total[i]):
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
            told = [*journal.row]
            for i in sums:
                told[i], total[i] = total[i], math.nan
            rows.append([readings.t_s, x, y, heading, *pose.as_array(), *upper, *told])
            localized.append(listener.belief.status is BeliefStatus.LOCALIZED)
            seen.record(readings, Pose2(x, y, theta) if math.isfinite(x + y + theta) else pose)
        else:
            seen.pass_over(readings)
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


def bounds_of(drive: RecordedDrive) -> tuple[float, float, float, float]:
    """Of the map; without one, of the landmarks and the true path."""
    if drive.chart is not None:
        return drive.chart.bounds_m
    known = drive.truth[np.isfinite(drive.truth).all(axis=1), :2]
    points = np.concatenate([drive.landmarks.points_xy_m, known])
    (xmin, ymin), (xmax, ymax) = points.min(axis=0) - 0.5, points.max(axis=0) + 0.5
    return float(xmin), float(ymin), float(xmax), float(ymax)
