"""Stepping a mission on a floor to its end."""

from __future__ import annotations

import math
import time

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import STOP, Command, Pose2, Twist
from pilotage.evaluation.run_metrics import Outcome, shortest_for
from pilotage.experiments.floor.build import Experiment, build, build_sensors
from pilotage.experiments.floor.recorder import Recorder, RunRecord
from pilotage.experiments.progress import EVERY_S, OnProgress, Progress, metres
from pilotage.missions.floor import FloorMission, Kidnap
from pilotage.stack.interface import StackStatus


def simulate(mission: FloorMission, on_progress: OnProgress | None = None) -> RunRecord:
    """Build a mission and step it to its end."""
    experiment = build(mission)
    mission = experiment.mission
    simulator, stack, journal = experiment.simulator, experiment.stack, experiment.journal
    recorder = Recorder(simulator, stack, journal, dict(build_sensors(mission)))
    limit = math.ceil(mission.run.time_limit_s / mission.run.dt_s)
    planned_s = journal.planning_time_s
    begin = last_told = time.perf_counter()
    command: Command = STOP
    status, reason = stack.status
    kidnaps = sorted(mission.world.kidnaps, key=lambda kidnap: kidnap.at_s)
    for _ in range(limit):
        if status is StackStatus.FAILED:
            break
        while kidnaps and simulator.t_s >= kidnaps[0].at_s:
            _carry(experiment, recorder, kidnaps.pop(0))
        readings = simulator.step(_twist(command))
        command = stack.step(readings)
        recorder.record(readings, _twist(command))
        status, reason = stack.status
        if simulator.body.collisions:
            recorder.note("collision", "the body touched something")
            break
        if status is StackStatus.ARRIVED:
            break
        if on_progress is not None and time.perf_counter() - last_told > EVERY_S:
            last_told = time.perf_counter()
            on_progress(_progress(experiment))
    loop_s = time.perf_counter() - begin
    outcome = Outcome(
        arrived=status is StackStatus.ARRIVED,
        reason=_reason(experiment, status, reason),
        loop_s=max(loop_s - (journal.planning_time_s - planned_s), 1e-9),
        plans=journal.plans,
        shortest=shortest_for(mission, journal.plans, experiment.floor.walls),
        counts=dict(journal.counts),
    )
    return RunRecord(
        experiment, recorder.trace(), outcome, recorder.events, recorder.album, recorder.sightings
    )


def _twist(command: Command) -> Twist:
    assert isinstance(command, Twist), "what moves on a floor follows twists"
    return command


def _carry(experiment: Experiment, recorder: Recorder, kidnap: Kidnap) -> None:
    """Carry the robot elsewhere; nobody tells it."""
    assert kidnap.to is not None, "settled by the build"
    experiment.simulator.body.carry_to(Pose2(kidnap.to.x_m, kidnap.to.y_m, wrap_to_pi(kidnap.to.theta_rad)))
    recorder.note(
        "kidnap", f"the robot is carried to ({kidnap.to.x_m:.2f}, {kidnap.to.y_m:.2f}) and not told"
    )


def _reason(experiment: Experiment, status: StackStatus, reason: str) -> str:
    """Why the run ended, in one line."""
    body, mission = experiment.simulator.body, experiment.mission
    if body.collisions:
        pose = body.pose
        return f"collision at ({pose.x_m:.2f}, {pose.y_m:.2f}) after {experiment.simulator.t_s:.1f} s"
    if status is StackStatus.RUNNING:
        return f"time limit of {mission.run.time_limit_s:g} s reached"
    return reason or str(status)


def _progress(experiment: Experiment) -> Progress:
    truth, belief = experiment.simulator.truth, experiment.stack.belief
    told = dict(zip(experiment.journal.units, experiment.journal.row, strict=True))
    to_go = told.get("distance_to_go_m", math.nan)
    error_m = math.hypot(truth.x_m - belief.pose.x_m, truth.y_m - belief.pose.y_m)
    sigma_m = float(np.sqrt(max(np.linalg.eigvalsh(belief.cov[:2, :2])[-1], 0.0)))
    numbers = (
        ("to go", metres(to_go, 1)),
        ("error", metres(error_m, 3)),
        ("sigma", metres(sigma_m, 3)),
    )
    return Progress(experiment.simulator.t_s, numbers)
