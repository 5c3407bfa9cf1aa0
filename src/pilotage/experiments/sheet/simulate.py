"""Stepping a mission on a sheet to its end."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import STANDSTILL, BoolArray, Event, FloatArray
from pilotage.evaluation.sheet_visits import VisitedCells
from pilotage.experiments.progress import EVERY_S, OnProgress, Progress, metres
from pilotage.experiments.sheet.build import SheetExperiment, build
from pilotage.missions.sheet import SheetMission
from pilotage.stack.interface import StackStatus

RECORD_EVERY_S = 0.05
"""A row of the trace for every sensing period."""
BLOCKED_S = 5.0
"""A robot that a box holds for so long is blocked."""
COLUMNS = (
    "t_s",
    "true_x_m",
    "true_y_m",
    "true_theta_rad",
    "est_x_m",
    "est_y_m",
    "est_theta_rad",
    "cov_xx_m2",
    "cov_xy_m2",
    "cov_yy_m2",
    "cov_xt_m_rad",
    "cov_yt_m_rad",
    "cov_tt_rad2",
    "left_cmd_rad_s",
    "right_cmd_rad_s",
    "clearance_m",
    "overhang_m",
    "contacts",
    "visited_cells",
)


@dataclass(frozen=True, slots=True)
class SheetOutcome:
    """How a run ended, as seen from outside.

    Attributes
    ----------
    visited
        (rows, columns) cells that the robot's centre truly was in.
    first_visit_s
        (rows, columns) when it first was; nan where it never was.
    """

    done: bool
    reason: str
    loop_s: float
    visited: BoolArray
    first_visit_s: FloatArray
    way_m: float
    contacts: int


@dataclass(frozen=True, slots=True)
class SheetRecord:
    """A finished run in memory."""

    experiment: SheetExperiment
    trace: dict[str, FloatArray]
    outcome: SheetOutcome
    events: list[Event]

    @property
    def mission(self) -> SheetMission:
        """The mission as it ran."""
        return self.experiment.mission


def simulate(mission: SheetMission, on_progress: OnProgress | None = None) -> SheetRecord:
    """Build a mission and step it to its end: done, given up, blocked, off the sheet, or out of time."""
    experiment = build(mission)
    simulator, explorer, world = experiment.simulator, experiment.explorer, experiment.world
    radius, dt_s = mission.robot.body.radius_m, mission.run.dt_s
    visits = VisitedCells(experiment.sheet.size_m, experiment.sheet.cells)
    events = explorer.drain_events()
    telemetry = tuple(explorer.telemetry())
    rows: list[tuple[float, ...]] = []
    every = max(1, round(RECORD_EVERY_S / dt_s))
    command, status, reason = STANDSTILL, *explorer.status
    held_steps, contacts = 0, 0
    begin = last_told = time.perf_counter()
    for step in range(1, math.ceil(mission.run.time_limit_s / dt_s) + 1):
        if status is not StackStatus.RUNNING:
            break
        readings = simulator.step(command)
        truth = simulator.truth
        visits.add(truth.x_m, truth.y_m, simulator.t_s)
        if not simulator.on_sheet:
            status, reason = StackStatus.FAILED, "left the sheet"
            events.append(Event(simulator.t_s, "failed", "the robot's centre left the sheet"))
        else:
            command = explorer.step(readings)
            status, reason = explorer.status
        events += explorer.drain_events()
        if simulator.contacts > contacts:
            contacts = simulator.contacts
            events.append(Event(simulator.t_s, "collision", "the body ran into a box"))
        held_steps = held_steps + 1 if simulator.touching else 0
        if held_steps * dt_s > BLOCKED_S and status is StackStatus.RUNNING:
            status, reason = StackStatus.FAILED, "blocked by an obstacle"
            events.append(Event(simulator.t_s, "failed", f"a box held the robot for {BLOCKED_S:g} s"))
        if step % every == 0 or status is not StackStatus.RUNNING:
            belief = explorer.belief
            pose, cov = belief.pose, belief.cov
            rows.append(
                (
                    readings.t_s,
                    truth.x_m,
                    truth.y_m,
                    truth.theta_rad,
                    pose.x_m,
                    pose.y_m,
                    pose.theta_rad,
                    cov[0, 0],
                    cov[0, 1],
                    cov[1, 1],
                    cov[0, 2],
                    cov[1, 2],
                    cov[2, 2],
                    command.left_rad_s,
                    command.right_rad_s,
                    simulator.clearance_m,
                    world.overhang_m(truth.x_m, truth.y_m, radius),
                    float(contacts),
                    float(visits.count),
                    *explorer.telemetry().values(),
                )
            )
        if on_progress is not None and time.perf_counter() - last_told > EVERY_S:
            last_told = time.perf_counter()
            on_progress(_progress(simulator.t_s, visits.count, experiment, rows))
    outcome = SheetOutcome(
        done=status is StackStatus.ARRIVED,
        reason=_reason(status, reason, mission, contacts),
        loop_s=max(time.perf_counter() - begin, 1e-9),
        visited=visits.visited,
        first_visit_s=visits.first_s,
        way_m=simulator.way_m,
        contacts=contacts,
    )
    table = np.array(rows, dtype=np.float64).reshape(-1, len(COLUMNS) + len(telemetry))
    trace = {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate((*COLUMNS, *telemetry))}
    return SheetRecord(experiment, trace, outcome, events)


def _reason(status: StackStatus, reason: str, mission: SheetMission, contacts: int) -> str:
    if status is StackStatus.RUNNING:
        return f"time limit of {mission.run.time_limit_s:g} s reached"
    if status is StackStatus.ARRIVED and contacts > 0:
        # Done, and yet no success: it says why.
        times = "once" if contacts == 1 else f"{contacts} times"
        return f"{reason}; touched a box {times}"
    return reason or str(status)


def _progress(
    t_s: float, visited: int, experiment: SheetExperiment, rows: list[tuple[float, ...]]
) -> Progress:
    columns, lines = experiment.sheet.cells
    error = math.hypot(rows[-1][1] - rows[-1][4], rows[-1][2] - rows[-1][5]) if rows else math.nan
    share = 100.0 * visited / (columns * lines)
    return Progress(t_s, (("visited", f"{share:>5.1f} %"), ("error", metres(error, 3))))
