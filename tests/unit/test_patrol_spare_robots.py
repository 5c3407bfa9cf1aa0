"""More robots than places: each place is held by one, and the others keep out of the way."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pilotage.core.types import Pose2
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of, read_mission
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.messages import PatrolMemory
from pilotage.stack.patrol.strategies.adaptive_rounds import AdaptiveRoundsConfig, AdaptiveRoundsStrategy
from pilotage.stack.patrol.strategy import PatrolSetting
from pilotage.stack.patrol.word import TeamWord

GRAPH = PatrolGraph.of(np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([[0.0, 3.0], [3.0, 0.0]]))


def two_rooms(graph: Path, size: int) -> dict[str, Any]:
    """Rooms of 5 m x 5 m with a door of 1 m between them; a place in the middle of each."""
    graph.write_text("2 100 50 0.1 0 0\n\n0 25 25 1\n1 E 50\n\n1 75 25 1\n0 W 50\n")
    walls = [[0, 0, 10, 0], [10, 0, 10, 5], [10, 5, 0, 5], [0, 5, 0, 0], [5, 0, 5, 2], [5, 3, 5, 5]]
    values = read_mission("museum-patrol")
    values["world"] = {"map": {"map": "two rooms", "bounds_m": [0, 0, 10, 5], "walls_m": walls}}
    values["task"] = {"name": "patrol", "duration_s": 60.0, "graph": str(graph)}
    values["team"] = {"size": size, "strategy": "adaptive-rounds", "radio": {}}
    values["run"]["time_limit_s"] = 60.0
    return values


def test_who_shares_a_place_that_is_held_stays_where_it_is() -> None:
    """Of three robots on two places two drove to one, and pushed each other away from it for good."""
    starts = np.array([0, 1, 1])
    settings = [PatrolSetting(GRAPH, r, starts, 1.0, np.random.default_rng(0)) for r in range(3)]
    strategies = [AdaptiveRoundsStrategy(AdaptiveRoundsConfig(), setting) for setting in settings]
    rounds = [int(s._round.stops[0]) for s in strategies]
    one, other = next((a, b) for a in range(3) for b in range(a) if rounds[a] == rounds[b])
    held = rounds[one]
    memories = [PatrolMemory(2, r, 3, held if r == one else 1 - held, 1.0) for r in range(3)]
    assert strategies[other].next_vertex(memories[other].knowledge(1.0)) == held
    assert strategies[one].next_vertex(memories[one].knowledge(1.0)) == held
    memories[one].update(1.0, words=strategies[one].words(memories[one].knowledge(1.0)))
    memories[other].receive(memories[one].message(1.0))
    assert strategies[other].next_vertex(memories[other].knowledge(2.0)) == 1 - held


def test_who_made_room_does_not_go_back_where_a_mate_stands(tmp_path: Path) -> None:
    values = two_rooms(tmp_path / "two.graph", 2)
    context: Any = build(mission_of(values, seed=0)).team[0].stack._context  # type: ignore[attr-defined]
    context.task = SimpleNamespace(
        graph=context.task.graph,
        visit_m=context.task.visit_m,
        strategy=SimpleNamespace(next_vertex=lambda knowledge: knowledge.at),
    )
    context.hop = context.target = context.came_from = 0
    context.pose = Pose2(2.5, 4.2, 0.0)
    assert context.ask()
    news = replace(context.memory.message(0.0), sender=1)
    context.hear(0.0, TeamWord(2.5, 2.6, False, None, None, news, 0.3))
    assert not context.ask()


@pytest.mark.parametrize(("waits", "crowded"), [(True, False), (False, True)])
def test_a_mate_that_waits_as_well_wants_nobody_to_make_room(
    tmp_path: Path, *, waits: bool, crowded: bool
) -> None:
    values = two_rooms(tmp_path / "two.graph", 2)
    context: Any = build(mission_of(values, seed=0)).team[0].stack._context  # type: ignore[attr-defined]
    context.pose, context.strange = Pose2(2.5, 2.5, 0.0), np.array([[0.55, 0.0], [0.6, 0.1]])
    mate = PatrolMemory(2, 1, 2, 0, 1.0)
    mate.bound(0 if waits else 1, 0.0, 5.0)
    word = TeamWord(3.3, 2.5, False, None, None, mate.message(0.0), 0.3)
    context.hear(0.0, word)
    assert context.crowded(0.6) is crowded


@pytest.mark.parametrize("long", [True, False])
def test_a_body_that_is_planned_around_wants_nobody_to_make_room(tmp_path: Path, *, long: bool) -> None:
    """A robot that held the place of one that failed made room for its body, again and again."""
    values = two_rooms(tmp_path / "two.graph", 2)
    context: Any = build(mission_of(values, seed=0)).team[0].stack._context  # type: ignore[attr-defined]
    context.pose, context.strange = Pose2(2.5, 2.5, 0.0), np.array([[0.55, 0.0], [0.6, 0.1]])
    body = np.array([[3.3, 2.5]])
    for t_s in (0.0, 30.0 if long else 3.0):
        context._obstructions.step(t_s, body, np.zeros(int(t_s > 0.0), dtype=bool), np.zeros((0, 3)), (), ())
    assert context.crowded(0.6) is not long


@pytest.mark.parametrize("seed", [1, 2])
def test_six_robots_hold_two_places(tmp_path: Path, seed: int) -> None:
    """They fought for them: a place with three robots about it was left for half a minute."""
    experiment = build(mission_of(two_rooms(tmp_path / "two.graph", 6), seed=seed))
    metrics: Any = experiment.task.judge(run_loop(experiment).finished).metrics
    assert metrics["collisions"] == metrics["deadlocks"] == 0
    task: Any = experiment.task
    visits = task._visits
    found, _ = visits.idleness(60.0, 30.0)
    assert found.worst_s < 2.0
