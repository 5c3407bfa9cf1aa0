"""The one loop: readings from the source, a command from each stack, and a task that says when it is over."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import Event, Pose2
from pilotage.evaluation.finished import FinishedRun, RobotRun
from pilotage.evaluation.tasks.task import Attempt, all_ended
from pilotage.experiments.build.build import Experiment, build
from pilotage.experiments.build.team import Member
from pilotage.experiments.disturbances import Disturbances
from pilotage.experiments.people_trail import PeopleTrail
from pilotage.experiments.progress import EVERY_S, OnProgress, Progress, metres
from pilotage.experiments.recorder import Recorder
from pilotage.experiments.sightings import Sightings
from pilotage.experiments.source import stepped
from pilotage.experiments.update_album import UpdateAlbum
from pilotage.missions.mission import Mission


@dataclass(frozen=True, slots=True)
class Run:
    """A finished run, what each robot's sensors saw, its updates worth a picture; where people walked."""

    finished: FinishedRun
    sightings: tuple[Sightings, ...]
    albums: tuple[UpdateAlbum, ...]
    people: PeopleTrail


def simulate(mission: Mission) -> Run:
    """Build a mission and step it to its end.

    Raises
    ------
    InputError
        Where the mission cannot be built.
    """
    return run_loop(build(mission))


def run_loop(experiment: Experiment, on_progress: OnProgress | None = None) -> Run:
    """Step source and stacks until the task says that it is over, or time is up."""
    mission, source, task = experiment.mission, experiment.simulator, experiment.task
    team = experiment.team
    attempts = tuple(
        Attempt(body, member.stack, member.journal) for body, member in zip(source.bodies, team, strict=True)
    )
    every = max(1, round(mission.run.record_every_s / mission.run.dt_s))
    recorders = tuple(
        Recorder(member, body, task, index, every > 1)
        for index, (member, body) in enumerate(zip(team, source.bodies, strict=True))
    )
    sightings = tuple(Sightings(dict(member.known.sensors)) for member in team)
    albums = tuple(UpdateAlbum() for _ in team)
    trail = PeopleTrail(source.crowd)
    events: list[Event] = []
    planned_s = sum(member.journal.planning_time_s for member in team)
    limit = math.ceil(mission.run.time_limit_s / mission.run.dt_s) if task.drives else 0
    disturbances = Disturbances(mission, source)
    ending = "" if not task.drives or all_ended(attempts) else None
    begin = last_told = time.perf_counter()
    step = 0
    stacks = [member.stack for member in team] if ending is None and limit > 0 else []
    events += _disturbed(disturbances, attempts)
    for readings, commands in stepped(source, stacks) if stacks else ():
        step += 1
        for index, member in enumerate(team):
            if member.journal.outbox:
                source.transmit(index, member.journal.outbox)
                member.journal.outbox.clear()
        ending = task.step(source.t_s, attempts)
        for index, member in enumerate(team):
            if step % every == 0 or ending is not None:
                recorders[index].record(readings[index], commands[index])
            else:
                recorders[index].pass_over(readings[index])
            sightings[index].record(readings[index], attempts[index].body.pose)
            update = member.journal.update
            if update is not None:
                albums[index].offer(source.t_s, update)
                member.journal.update = None
        if on_progress is not None and time.perf_counter() - last_told > EVERY_S:
            last_told = time.perf_counter()
            on_progress(_progress(experiment, attempts))
        if step % every == 0 or ending is not None:
            trail.record(source.t_s)
        if ending is not None or step >= limit:
            break
        events += _disturbed(disturbances, attempts)
    loop_s = time.perf_counter() - begin
    planning_s = sum(member.journal.planning_time_s for member in team) - planned_s
    if ending is None:
        ending = f"time limit of {mission.run.time_limit_s:g} s reached"
    events += [event for member in team for event in _events(member, several=len(team) > 1)] + task.events
    placed = experiment.obstacles
    finished = FinishedRun(
        mission,
        experiment.chart,
        placed.segments_m,
        placed.circles_m,
        placed.polygons_m,
        placed.pockets_m,
        tuple(_robot_run(experiment, index, recorder) for index, recorder in enumerate(recorders)),
        sorted(events, key=lambda event: event.t_s),
        step,
        source.t_s,
        max(loop_s - planning_s, 1e-9),
        ending,
    )
    return Run(finished, sightings, albums, trail)


def _disturbed(disturbances: Disturbances, attempts: tuple[Attempt, ...]) -> list[Event]:
    """Carry out what is due now; a robot that has stopped says nothing from then on."""
    events = disturbances.due()
    for attempt in attempts:
        attempt.journal.silenced = attempt.body.stopped
    return events


def _events(member: Member, *, several: bool) -> list[Event]:
    """What a robot told; among several it says who it is."""
    told = member.journal.events
    name = member.config.name
    return [replace(event, text=f"{name}: {event.text}") for event in told] if several else list(told)


def _robot_run(experiment: Experiment, index: int, recorder: Recorder) -> RobotRun:
    member, body = experiment.team[index], experiment.simulator.bodies[index]
    mission, journal, crowd = experiment.mission, member.journal, experiment.simulator.crowd
    start = mission.start_of(member.config)
    assert start is not None, "settled by the build"
    status, reason = member.stack.status
    return RobotRun(
        member.known.name,
        member.known.footprint,
        member.known.motion,
        Pose2(start.x_m, start.y_m, wrap_to_pi(start.theta_rad)),
        mission.goal_of(member.config),
        member.goals,
        member.rounds,
        member.stack_config,
        recorder.trace(),
        journal.plans,
        journal.counts,
        journal.results(),
        status,
        reason,
        body.collisions,
        body.driven_m,
        None if crowd is None else crowd.encounters(index),
    )


def _progress(experiment: Experiment, attempts: tuple[Attempt, ...]) -> Progress:
    """Where the worst located robot stands, and what the task has to tell."""
    worst_m, sigma_m = 0.0, 0.0
    for attempt in attempts:
        truth, belief = attempt.body.pose, attempt.stack.belief
        worst_m = max(worst_m, math.hypot(truth.x_m - belief.pose.x_m, truth.y_m - belief.pose.y_m))
        sigma_m = max(sigma_m, float(np.sqrt(max(np.linalg.eigvalsh(belief.cov[:2, :2])[-1], 0.0))))
    numbers = (
        *experiment.task.progress(attempts),
        ("error", metres(worst_m, 3)),
        ("sigma", metres(sigma_m, 3)),
    )
    return Progress(experiment.simulator.t_s, numbers)
