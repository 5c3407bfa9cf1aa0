"""The robots with what runs on them, each with its share of the task."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.evaluation.tasks.task import Task
from pilotage.experiments.build.obstacles import Obstacles
from pilotage.experiments.build.places import pose_of
from pilotage.experiments.build.stacks import build_stack, first_belief, goal_of, rounds_of, told
from pilotage.experiments.components import build_component
from pilotage.experiments.oracles.truth import Truth
from pilotage.maps.world_map import WorldMap
from pilotage.missions.mission import Mission
from pilotage.missions.places import GoalConfig
from pilotage.missions.robot import RobotConfig
from pilotage.missions.stack import StackConfig
from pilotage.sensors.radio import RadioConfig
from pilotage.stack.interface import NAVIGATORS, Stack
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.patrol.driven import as_driven
from pilotage.stack.patrol.roadmap import Roadmap
from pilotage.stack.patrol.strategy import STRATEGIES, PatrolSetting
from pilotage.stack.patrol.task import PatrolPlaces, PatrolSite, PatrolTask, Supply
from pilotage.stack.planning.rounds import Rounds


@dataclass(frozen=True, slots=True)
class Member:
    """One robot, ready to step.

    Attributes
    ----------
    config, stack_config
        As the mission has them.
    known
        Its own data sheet.
    goals, rounds
        Its goals in the order in which it is to visit them, and how it chose that order where it was free to.
    """

    config: RobotConfig
    stack_config: StackConfig
    known: RobotKnowledge
    stack: Stack
    journal: Journal
    goals: tuple[GoalConfig, ...]
    rounds: Rounds | None


def make_team(
    mission: Mission,
    chart: WorldMap,
    sheets: Sequence[RobotKnowledge],
    obstacles: Obstacles,
    oracles: frozenset[str],
    task: Task,
) -> tuple[list[Truth], list[Member]]:
    """The robots with their stacks, which plan, and the truths that some of their modules may know."""
    placed = obstacles.segments_m, obstacles.circles_m
    truths = [_truth(mission, index, chart, *placed) for index in range(len(sheets))]
    shares = _shares(mission, chart, sheets, task)
    team = [
        _member(mission, index, chart, sheet, truths[index], oracles, task, shares[index])
        for index, sheet in enumerate(sheets)
    ]
    return truths, team


def _truth(
    mission: Mission, index: int, chart: WorldMap, segments_m: FloatArray, circles_m: FloatArray
) -> Truth:
    start = mission.start_of(mission.members[index])
    assert start is not None, "settled above"
    return Truth(chart, segments_m, circles_m, pose_of(start))


def _member(
    mission: Mission,
    index: int,
    chart: WorldMap,
    sheet: RobotKnowledge,
    truth: Truth,
    oracles: frozenset[str],
    whole: Task,
    share: PatrolTask | None,
) -> Member:
    robot = mission.members[index]
    config = mission.stack_of(robot)
    goal = mission.goal_of(robot)
    own = told(config, chart)
    knowing = bool(oracles & {"initial", "explorer"})
    initial = first_belief(config.initial, truth.start, own, sheet.streams, knowing)
    goals = tuple(place for place in (goal, *whole.goals) if place is not None)
    rounds = None
    if getattr(whole, "any_order", False) and len(goals) > 1:
        goals = goals if goal is None else (*whole.goals, goal)
        rounds = rounds_of(config, sheet, own, initial, goals, goal is not None)
        goals = tuple(goals[place] for place in rounds.order)
    task = TaskKnowledge(
        initial=initial,
        goals=tuple(map(goal_of, goals)),
        goal_tolerance_m=min((place.tolerance_m for place in goals), default=np.inf),
        goal_tolerance_rad=goals[-1].tolerance_rad if goals else np.pi,
        time_limit_s=mission.run.time_limit_s,
        mates=len(mission.members) - 1,
        pose_given=truth.tell_pose if "localizer" in oracles else None,
    )
    if "mapper" in oracles and config.map == "none":
        own = chart
    journal = Journal()
    stack = build_stack(config, sheet, own, task, journal, truth, oracles, share)
    return Member(robot, config, sheet, stack, journal, goals, rounds)


def _shares(
    mission: Mission, chart: WorldMap, sheets: Sequence[RobotKnowledge], whole: Task
) -> Sequence[PatrolTask | None]:
    """Each robot's share of a task that has places to visit for all of the team."""
    site: PatrolSite | None = getattr(whole, "patrol", None)
    if site is None:
        for part in ("battery", "strategy"):
            if getattr(mission.team, part) is not None:
                raise InputError(
                    f"team.{part}: expected task 'patrol', found '{mission.task.name}', which has no use for "
                    f"it; take team.{part}=null"
                )
        return [None] * len(sheets)
    supply = _supply(mission)
    roadmaps = _roadmaps(mission, chart, sheets, PatrolPlaces.of(site.graph, supply, site.visit_m))
    graph, passages = as_driven(site.graph, site.passages, roadmaps)
    assert mission.team.strategy is not None, "the task looked"
    radios = [radio for sheet in sheets for radio in sheet.sensors_of(RadioConfig).values()]
    talks = sum(radio.loss < 1.0 for radio in radios) > 1
    speeds_m_s = np.array([sheet.motion.top_speed_m_s for sheet in sheets])
    radii_m = tuple(sheet.radius_m for sheet in sheets)
    brakings_m_s2 = tuple(sheet.motion.braking_m_s2 for sheet in sheets)
    shares = []
    for index, sheet in enumerate(sheets):
        setting = PatrolSetting(
            graph,
            index,
            site.starts,
            sheet.motion.top_speed_m_s,
            sheet.streams.stream("strategy"),
            passages=passages,
            starts_m=site.starts_m.copy(),  # nobody's strategy has any business in another's setting
            turn_m=site.turn_m,
            visit_m=site.visit_m,
            talks=talks,
            speeds_m_s=speeds_m_s.copy(),
        )
        strategy = build_component(STRATEGIES, mission.team.strategy, "strategy", setting)
        share = PatrolTask(
            graph, site.visit_m, site.near_m, site.starts, index, strategy, radii_m, brakings_m_s2, supply
        )
        shares.append(share)
    return shares


def _roadmaps(
    mission: Mission, chart: WorldMap, sheets: Sequence[RobotKnowledge], places: PatrolPlaces
) -> Sequence[Roadmap]:
    """The different paths that robots follow, of navigators that tell."""
    found: list[Roadmap] = []
    for member, sheet in zip(mission.members, sheets, strict=True):
        config = mission.stack_of(member)
        choice = config.navigator
        tells = getattr(NAVIGATORS.entry(choice.name).factory, "roadmap", None)
        if tells is None:
            continue
        own = NAVIGATORS.configure(choice.name, choice.parameters, "stack.navigator")
        roadmap = tells(own, sheet, told(config, chart), places)
        if not any(roadmap is other for other in found):
            found.append(roadmap)
    return found


def _supply(mission: Mission) -> Supply | None:
    """Where the team charges."""
    battery, places = mission.team.battery, stations_of(mission)
    if battery is None:
        return None
    return Supply(np.array(places), battery.range_m, battery.reserve_m, battery.charge_s)


def stations_of(mission: Mission) -> list[tuple[float, float]]:
    """Each robot's charging station; none where nobody charges."""
    places = [mission.station_of(index) for index in range(len(mission.members))]
    return [place for place in places if place is not None]
