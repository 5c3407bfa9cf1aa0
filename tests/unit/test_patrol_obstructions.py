"""Who stands for long and says nothing is planned around: a mate that failed in a door, say."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from pilotage.core.types import FloatArray, Pose2
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of
from pilotage.stack.navigator.patrol import traffic
from pilotage.stack.navigator.patrol.obstructions import (
    ABSENT_S,
    DENIED_S,
    KEPT_S,
    SHUTS_S,
    Obstructions,
    Told,
)
from pilotage.stack.navigator.patrol.passage import Stretch
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.partition import annealed
from pilotage.stack.patrol.passages import OPEN
from pilotage.stack.patrol.roadmap import Roadmap
from pilotage.stack.patrol.shut_paths import NONE_SHUT, OpenGraph, ShutPaths, same_side
from pilotage.stack.patrol.tours import Round
from pilotage.stack.patrol.word import Talk
from support.two_rooms import DOOR_Y_M, discs, two_rooms

NOBODY: FloatArray = np.zeros((0, 2))
BODY: FloatArray = np.array([[3.0, 1.0]])
KEEP_M = 0.68


def seen(kept: Obstructions, t_s: float, bodies: FloatArray, **more: Any) -> bool:
    """One scan; nothing is seen to be absent unless said."""
    absent = more.get("absent", [False] * len(kept.known_xy_m))
    told = [Told(7, place) for place in more.get("told", NOBODY)]
    silent = np.insert(more.get("silent", NOBODY), 2, 0.5, axis=1)
    return kept.step(t_s, bodies, absent, silent, told, more.get("heard", ()))


class TestWhoStands:
    def test_for_long_is_planned_around_and_told(self) -> None:
        kept = Obstructions()
        changes = [seen(kept, 0.5 * k, BODY + 0.01 * (k % 2)) for k in range(41)]
        assert changes.index(True) == round(SHUTS_S / 0.5)
        assert sum(changes) == 1
        assert kept.shutting_xy_m == pytest.approx(BODY + 0.005, abs=1e-3)
        assert [told[2] for told in kept.told()] == [0.0]

    def test_where_a_mate_fell_silent_is_planned_around_at_once(self) -> None:
        kept = Obstructions()
        assert seen(kept, 0.0, BODY, silent=BODY + 0.3)
        assert not seen(kept, 1.0, BODY, silent=BODY + 0.3)

    def test_where_a_mate_may_have_come_since_its_last_word_is_its_body(self) -> None:
        """It had driven 0.74 m since: robots waited, and made room for a body, for half a minute."""
        context: Any = build(mission_of(two_rooms(DOOR_Y_M), seed=0)).team[1].stack._context  # type: ignore[attr-defined]
        word = SimpleNamespace(x_m=3.0, y_m=1.0, talk=Talk(1.0, math.inf, 0.0, 1.0))
        context.mates.hear(0, 1.0, word)
        context.t_s = 3.0
        assert not len(context.fell_silent())
        context.t_s = 6.0
        ((x, y, reach_m),) = context.fell_silent()
        assert (x, y) == (3.0, 1.0)
        assert 1.2 < reach_m < 1.5
        kept, place = Obstructions(), np.array([[3.74, 1.0]])
        assert kept.step(6.0, place, [], context.fell_silent(), [], {})

    def test_and_says_nothing_for_seconds_has_not_failed_where_words_are_often_lost(self) -> None:
        """Of a radio that loses three words of ten some three in a row are lost every half a minute."""
        settings = two_rooms(DOOR_Y_M)
        settings["team"]["radio"] = {"range_m": 10.0, "loss": 0.3, "delay_s": 1.0}
        context: Any = build(mission_of(settings, seed=0)).team[1].stack._context  # type: ignore[attr-defined]
        word = SimpleNamespace(x_m=3.0, y_m=1.0, talk=Talk(1.0, 10.0, 0.3, 1.0))
        context.mates.hear(0, 1.0, word)
        context.t_s = 9.0
        assert not len(context.fell_silent())
        context.t_s = 10.0
        assert len(context.fell_silent()) == 1

    def test_is_forgotten_where_nothing_is_seen_any_more(self) -> None:
        kept = Obstructions()
        seen(kept, 0.0, BODY, silent=BODY)
        gone = np.array([True])
        assert not seen(kept, 0.5 * ABSENT_S, NOBODY, silent=BODY, absent=gone)
        assert seen(kept, 1.1 * ABSENT_S, NOBODY, silent=BODY, absent=gone)
        assert not len(kept.known_xy_m)

    @pytest.mark.parametrize("failed", [True, False])
    def test_is_looked_for_again_unless_a_mate_failed_there(self, failed: bool) -> None:
        kept = Obstructions()
        for t_s in (0.0, SHUTS_S):
            seen(kept, t_s, BODY)
        assert len(kept.shutting_xy_m) == 1
        seen(kept, SHUTS_S + 1.1 * KEPT_S, NOBODY, silent=BODY if failed else NOBODY)
        assert (len(kept.shutting_xy_m) == 1) is failed

    def test_is_no_mate_that_talks_again(self) -> None:
        kept = Obstructions()
        for t_s in (0.0, 0.5, 1.0):
            seen(kept, t_s, BODY, silent=BODY)
        assert seen(kept, 1.5, NOBODY)
        assert not len(kept.known_xy_m)

    def test_is_none_where_a_mate_is_that_talks(self) -> None:
        """One that failed before it ever said anything was nobody's mate."""
        kept = Obstructions()
        for t_s in (0.0, SHUTS_S):
            seen(kept, t_s, BODY)
        kept.is_of_mate(BODY[0] + 0.1, 0.3)
        assert seen(kept, SHUTS_S + 0.1, NOBODY, told=BODY)
        assert not len(kept.known_xy_m)

    def test_is_where_it_is_seen_by_and_by_and_where_mates_say_by_now(self) -> None:
        """One that was seen 0.1 m beside where it stood left a path that no command led along."""
        kept, told = Obstructions(), Obstructions()
        assert seen(kept, 0.0, BODY + 0.1, silent=BODY)
        assert seen(told, 0.0, NOBODY, told=BODY + 0.1)
        changes = [seen(kept, 0.2 * k, BODY, silent=BODY) for k in range(1, 40)]
        assert kept.shutting_xy_m == pytest.approx(BODY, abs=0.01)
        assert 1 <= sum(changes) <= 4
        assert seen(told, 1.0, NOBODY, told=BODY)
        assert told.shutting_xy_m.tolist() == BODY.tolist()

    def test_is_taken_for_wider_where_no_command_leads_past_and_mates_know_that(self) -> None:
        kept, mate = Obstructions(), Obstructions()
        seen(kept, 0.0, BODY, silent=BODY)
        assert kept.widen(BODY[0])
        assert seen(kept, 0.2, BODY, silent=BODY)
        ((x, y, wider_m),) = kept.told()
        assert wider_m > 0.0
        assert mate.step(
            0.0,
            NOBODY,
            [],
            discs(NOBODY, 0.5),
            [Told(1, np.array([x, y]), wider_m)],
            (),
        )
        assert mate.shutting[0, 2] == wider_m
        assert sum(kept.widen(BODY[0]) for _ in range(9)) <= 4
        assert not mate.widen(BODY[0] + 1.0)

    def test_is_taken_from_mates_and_not_told_on(self) -> None:
        kept = Obstructions()
        assert seen(kept, 0.0, NOBODY, told=BODY)
        assert len(kept.shutting_xy_m) == 1
        assert kept.told() == ()
        assert seen(kept, 1.1 * KEPT_S, NOBODY)

    def test_is_as_mates_tell_who_are_heard(self) -> None:
        kept = Obstructions()
        seen(kept, 0.0, NOBODY, told=BODY, heard={7})
        assert not seen(kept, 0.5 * KEPT_S, NOBODY)  # out of reach
        assert seen(kept, 0.6 * KEPT_S, NOBODY, heard={7})
        assert not len(kept.known_xy_m)

    def test_is_not_taken_back_from_those_who_do_not_know_yet(self) -> None:
        kept = Obstructions()
        seen(kept, 0.0, NOBODY, told=BODY, silent=BODY)
        assert seen(kept, 1.0, NOBODY, told=BODY)  # the mate talks again
        assert not seen(kept, 2.0, NOBODY, told=BODY)
        assert seen(kept, 1.0 + 1.1 * DENIED_S, NOBODY, told=BODY)
        kept.deny(BODY[0])
        assert not seen(kept, 8.0, NOBODY, told=BODY)


class TestPlans:
    """On the graph without what bodies shut."""

    @staticmethod
    def shut(*doors_y_m: float, here: tuple[float, float] = (4.0, DOOR_Y_M)) -> tuple[ShutPaths, PatrolGraph]:
        stack: Any = build(mission_of(two_rooms(*doors_y_m), seed=0)).team[1].stack
        roadmap, graph = stack._context.roadmap, stack._context.task.graph
        around = roadmap.around(np.array([[5.0, DOOR_Y_M, KEEP_M]]), here, 0.9)
        return ShutPaths.of(around, graph), graph

    def test_count_on_the_way_through_the_other_door(self) -> None:
        shut, graph = self.shut(DOOR_Y_M, 5.0)
        assert shut.unreached == ()
        assert shut.detours
        left = OpenGraph.of(graph, OPEN, shut)
        x = graph.vertices_xy_m[:, 0]
        through = (x[:, None] < 5.0) & (x > 5.0)
        assert (left.away_m(graph)[through] >= graph.shortest_m[through] - 0.25).all()
        a, b, length_m = max(shut.detours, key=lambda found: found[2])
        assert left.away_m(graph)[a, b] > graph.shortest_m[a, b] + 2.0
        assert length_m < graph.shortest_m[a, b] + 15.0
        round_m = Round.best(left.graph).length_m
        assert round_m > Round.best(graph).length_m + 2.0

    @pytest.mark.parametrize("side", ["left", "right"])
    def test_hold_what_is_reached_from_where_the_robot_is(self, side: str) -> None:
        here = (4.0, DOOR_Y_M) if side == "left" else (6.0, DOOR_Y_M)
        shut, graph = self.shut(DOOR_Y_M, here=here)
        x = graph.vertices_xy_m[:, 0]
        beyond = x > 6.0 if side == "left" else x < 4.0
        assert set(np.flatnonzero(beyond)) <= set(shut.unreached)
        left = OpenGraph.of(graph, OPEN, shut)
        assert len(left.graph) == len(graph) - len(shut.unreached) > 0
        plan = left.whole(annealed(left.graph, (1,), 2.0, 0.06))
        assert set(plan.rounds[0].stops.tolist()) == set(range(len(graph))) - set(shut.unreached)

    def test_are_of_those_on_one_side_and_of_one_word(self) -> None:
        one, two = ShutPaths((3, 4), ((0, 1, 5.5),)), ShutPaths((3, 4), ((0, 1, 6.0),))
        said = (NONE_SHUT, one, two, ShutPaths((0, 1, 2)))
        told = dict(enumerate(said))
        # Who knows of nothing that is shut may be on any side, and says nothing.
        assert same_side(2, told, 5) == (frozenset({0, 1, 2}), one)
        del told[0]
        assert same_side(2, told, 5) == (frozenset({1, 2}), one)
        assert same_side(1, told, 5) == (frozenset({1, 2}), one)
        assert same_side(3, told, 5) == (frozenset({3}), said[3])

    def test_join_what_no_edge_joins_any_more(self) -> None:
        """A place that is cut off was all that joined two others by edges."""
        edges_m = np.full((3, 3), np.inf)
        for a, b in ((0, 1), (1, 2)):
            edges_m[a, b] = edges_m[b, a] = 2.0
        graph = PatrolGraph.of(np.array([[0.0, 0.0], [2.0, 0.0], [4.0, 0.0]]), edges_m)

        class Around:
            def is_cut_off(self, place: int) -> bool:
                return place == 1

            def detour(self, one: int, other: int) -> float:
                assert (one, other) == (0, 2)
                return 1.5

        shut = ShutPaths.of(cast("Roadmap", Around()), graph)
        assert shut == ShutPaths((1,), ((0, 2, 6.0),))
        assert OpenGraph.of(graph, OPEN, shut).graph.shortest_m[0, 1] == 6.0


@pytest.mark.parametrize("planned_around", [True, False])
def test_who_is_planned_around_keeps_nobody_out_of_a_passage(*, planned_around: bool) -> None:
    """Its body beside the path counted as somebody who comes: all waited before the door, on every round."""
    context: Any = build(mission_of(two_rooms(DOOR_Y_M), seed=0)).team[1].stack._context  # type: ignore[attr-defined]
    context.pose = Pose2(-1.0, 0.0, 0.0)
    body = np.array([0.6, 0.65])
    angles = np.linspace(np.pi, 2.0 * np.pi, 20)
    rim = body + context.radius_m * np.column_stack([np.cos(angles), np.sin(angles)])
    context.strange = rim - np.array([-1.0, 0.0])
    line = np.column_stack([np.arange(0.5, 3.0, 0.25), np.zeros(10)])
    stretch = Stretch(False, 1.5, line, np.array([-1.0, 0.0]))
    context._obstructions = SimpleNamespace(shutting_xy_m=body[None])
    if planned_around:
        context._shut = context.roadmap
    for t_s in (0.2, 0.4):
        context.t_s = t_s
        ahead_m = traffic.comes(context, stretch)
    assert math.isinf(ahead_m) is planned_around
    assert traffic._is_crowded(context, stretch) is not planned_around


def test_each_side_of_a_door_that_a_mate_shuts_keeps_its_places() -> None:
    """Shares went by the graph with the door: places of one beyond it were left by everybody."""
    values = two_rooms(DOOR_Y_M, wall_x_m=3.0)
    values["robots"][2]["start"] = {"x_m": 8.0, "y_m": 5.0, "theta_rad": 0.0}
    values["task"]["derive"] = {"reach_m": 2.0}
    values["team"]["strategy"] = "adaptive-rounds"
    values["task"]["duration_s"] = values["run"]["time_limit_s"] = 180.0
    experiment = build(mission_of(values, seed=2))
    run = run_loop(experiment)
    metrics = experiment.task.judge(run.finished).metrics
    assert metrics["collisions"] == metrics["deadlocks"] == 0
    task: Any = experiment.task
    assert (180.0 - task._visits.last_s).max() < 40.0
    said = [event.text for event in run.finished.events if event.kind == "shut"]
    assert len({text.split("vertex ")[1] for text in said if "vertex " in text}) == 2


def test_who_talks_again_shuts_nothing() -> None:
    values = two_rooms(DOOR_Y_M)
    values["robots"][2]["start"] = {"x_m": 8.0, "y_m": 5.0, "theta_rad": 0.0}
    values["task"]["derive"] = {"reach_m": 2.0}
    values["team"]["failures"][0]["for_s"] = 60.0
    values["team"]["strategy"] = "adaptive-rounds"
    experiment = build(mission_of(values, seed=2))
    run = run_loop(experiment)
    assert any(event.kind == "shut" and event.t_s < 70.0 for event in run.finished.events)
    for robot in experiment.team:
        stack: Any = robot.stack
        assert stack._context.memory.own.shut == NONE_SHUT
        assert len(stack._context.task.strategy._side) == 3
    assert experiment.task.judge(run.finished).metrics["collisions"] == 0


@pytest.mark.parametrize("doors", [(DOOR_Y_M, 5.0), (DOOR_Y_M,)])
def test_a_mate_that_failed_in_a_door_keeps_nobody(doors: tuple[float, ...]) -> None:
    """They stood before it for good: the way to the next place led through that door."""
    experiment = build(mission_of(two_rooms(*doors), seed=1))
    run = run_loop(experiment)
    metrics = experiment.task.judge(run.finished).metrics
    assert metrics["collisions"] == 0
    task: Any = experiment.task
    idle_s = 120.0 - task._visits.last_s
    x = task.patrol.graph.vertices_xy_m[:, 0]
    assert np.count_nonzero(x < 4.0) >= 2
    assert idle_s[x < 4.0].max() < 40.0
    assert metrics["deadlocks"] == 0
    if len(doors) > 1:
        assert idle_s.max() < 40.0


def test_who_failed_says_and_counts_nothing_until_it_is_mended() -> None:
    """It told every few seconds that it made room, and was counted for it."""
    values = two_rooms(DOOR_Y_M)
    values["team"]["failures"] = [{"robot": 1, "at_s": 0.0}, {"robot": 2, "at_s": 10.0, "for_s": 60.0}]
    values["task"]["duration_s"] = values["run"]["time_limit_s"] = 75.0
    experiment = build(mission_of(values, seed=2))
    run = run_loop(experiment)
    told = {n: [e for e in run.finished.events if e.text.startswith(f"robot-{n}: ")] for n in (1, 2)}
    assert [event.kind for event in told[1]] == ["failure"]
    assert experiment.team[1].journal.counts["gave_way"] == 0
    assert not [e for e in told[2] if 10.0 < e.t_s < 70.0 and e.kind not in ("failure", "repair")]
    assert not experiment.team[2].journal.silenced
