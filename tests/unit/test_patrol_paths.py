"""Paths around what stands, and other ones where no command leads along them."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of
from pilotage.kernels.control import safe_stop
from pilotage.sensors.readings import Readings
from pilotage.stack.navigator.patrol.impasses import Impasses
from pilotage.stack.navigator.patrol.states import transitions
from pilotage.stack.navigator.patrol.states.driving import Driving
from pilotage.stack.navigator.patrol.states.making_room import SteppingAside
from pilotage.stack.navigator.patrol.states.passages import StandingAside
from pilotage.stack.navigator.patrol.states.state import State
from pilotage.stack.patrol.shut_paths import NONE_SHUT, ShutPaths
from support.two_rooms import DOOR_Y_M, discs, roadmap_of, two_rooms

NOBODY: FloatArray = np.zeros((0, 2))
KEEP_M = 0.68


class TestPathsAround:
    def test_lead_through_the_other_door(self) -> None:
        roadmap = roadmap_of(DOOR_Y_M, 5.0)
        place = int(np.argmax(roadmap.places_xy_m[:, 0] - roadmap.places_xy_m[:, 1]))
        around = roadmap.around(np.array([[5.0, DOOR_Y_M, KEEP_M]]), (4.0, DOOR_Y_M), 0.9)
        way = around.way(4.0, DOOR_Y_M, around.time_s(place), 20.0)[:, :2]
        assert way[np.argmin(np.abs(way[:, 0] - 5.0)), 1] > 4.5
        straight = roadmap.way(4.0, DOOR_Y_M, roadmap.time_s(place), 20.0)[:, :2]
        assert straight[np.argmin(np.abs(straight[:, 0] - 5.0)), 1] < 1.5
        assert not any(around.is_cut_off(k) for k in range(len(around.places_xy_m)))

    def test_leave_out_what_is_behind_the_only_door(self) -> None:
        roadmap = roadmap_of(DOOR_Y_M)
        around = roadmap.around(np.array([[5.0, DOOR_Y_M, KEEP_M]]), (4.0, DOOR_Y_M), 0.9)
        behind = roadmap.places_xy_m[:, 0] > 6.0
        assert behind.any()
        assert [around.is_cut_off(int(k)) for k in np.flatnonzero(behind)] == [True] * int(behind.sum())
        assert not any(around.is_cut_off(int(k)) for k in np.flatnonzero(roadmap.places_xy_m[:, 0] < 4.0))
        assert around.time_s(int(np.argmax(behind))) is roadmap.time_s(int(np.argmax(behind)))

    def test_come_as_near_to_a_place_as_who_stands_on_it_allows(self) -> None:
        roadmap = roadmap_of(DOOR_Y_M, 5.0)
        place = 0
        x, y = roadmap.places_xy_m[place].tolist()
        around = roadmap.around(np.array([[x, y, KEEP_M]]), (x + 1.0 if x < 4.0 else x - 1.0, y), 0.9)
        row, column = np.unravel_index(int(np.argmin(around.time_s(place))), around.slowness.shape)
        x0, y0 = around.origin_xy_m
        away_m = math.hypot(x0 + column * around.spacing_m - x, y0 + row * around.spacing_m - y)
        assert KEEP_M <= away_m <= 0.9


BESIDE_DOOR: FloatArray = np.array([[5.6, DOOR_Y_M + 0.6]])
"""It leaves 0.14 m more than is kept from it and from the door's other edge: less than nodes are apart."""


class TestGapsThatBodiesLeave:
    @staticmethod
    def context() -> Any:
        stack: Any = build(mission_of(two_rooms(DOOR_Y_M), seed=0)).team[1].stack
        return stack._context

    def test_of_less_than_nodes_are_apart_are_planned_through(self) -> None:
        """No node lay in 1.26 m between a body and a door's edge: a way of 3 m became one of 29 m."""
        context = self.context()
        context._obstructions = SimpleNamespace(shutting=discs(BESIDE_DOOR, 0.0))
        context._shut_paths()
        assert context.memory.own.shut == NONE_SHUT
        x, y = 4.0, DOOR_Y_M
        behind = int(np.argmax(context.roadmap.places_xy_m[:, 0]))
        way = context._shut.way(x, y, context._shut.time_s(behind), 10.0)[:, :2]
        assert way[-1, 0] > 6.0
        coarse = context._whole.around(discs(BESIDE_DOOR, context.motion.shut_m), (x, y), 0.8)
        assert ShutPaths.of(coarse, context.task.graph).unreached

    def test_who_was_on_its_way_aside_looks_anew(self) -> None:
        """Its field is over other nodes."""
        context = self.context()
        field = context.roadmap.field_to(2.0, 3.0)
        states: tuple[State, ...] = (
            SteppingAside(context, field, 9.0),
            StandingAside(context, field, 0.0, 9.0),
        )
        context._obstructions = SimpleNamespace(shutting=discs(BESIDE_DOOR, 0.0))
        context._shut_paths()
        for state in states:
            assert isinstance(state.step(Readings(0.1, {}), transitions).state, Driving)


class TestWhereNoCommandLeadsOn:
    """Though the plan does: it must lead to another plan, never to standing for ever."""

    @staticmethod
    def before_a_gap() -> Any:
        context: Any = build(mission_of(two_rooms(DOOR_Y_M, 5.0), seed=0)).team[1].stack._context  # type: ignore[attr-defined]
        silent = np.array([[*BESIDE_DOOR[0], 0.5]])
        for t_s in (0.0, 0.2):
            context._obstructions.step(
                t_s, BESIDE_DOOR, np.zeros(int(t_s > 0.0), dtype=np.bool_), silent, (), ()
            )
        context._shut_paths()
        context.pose = Pose2(4.4, DOOR_Y_M, 0.0)
        context._take_what_leads_on()
        context.came_from = context.roadmap.nearest(4.0, DOOR_Y_M)
        context.hop = int(np.argmax(context.roadmap.places_xy_m @ [1.0, -1.0]))
        return context

    @staticmethod
    def crosses_at_m(context: Any) -> float:
        """At what y its path leads through the wall between the rooms."""
        way = context.roadmap.way(
            context.pose.x_m, context.pose.y_m, context.roadmap.time_s(context.hop), 20.0
        )
        return float(way[int(np.argmin(np.abs(way[:, 0] - 5.0))), 1])

    def test_past_a_body_another_way_is_taken(self) -> None:
        context = self.before_a_gap()
        assert self.crosses_at_m(context) < 2.0
        tries = 0
        while context.finds_another_way() and self.crosses_at_m(context) < 2.0:
            tries += 1
        assert self.crosses_at_m(context) > 4.0
        assert tries <= 3

    @pytest.mark.parametrize("spoils", ["mate", "moves"])
    def test_it_stays_where_mates_settle_who_goes_or_where_it_gets_on(self, spoils: str) -> None:
        context = self.before_a_gap()
        if spoils == "mate":
            context.mates.hear(2, context.t_s, SimpleNamespace(x_m=5.0, y_m=DOOR_Y_M))
        else:
            context.twist = Twist(0.3, 0.0)
        assert not context.finds_another_way()

    def test_who_is_cut_off_from_where_it_goes_turns_away(self) -> None:
        """It drove on to a door that had just been shut, and stood there until it stalled."""
        context: Any = build(mission_of(two_rooms(DOOR_Y_M), seed=0)).team[1].stack._context  # type: ignore[attr-defined]
        context.pose = Pose2(3.0, DOOR_Y_M, 0.0)
        context.hop = int(np.argmax(context.roadmap.places_xy_m[:, 0]))
        state = transitions.set_out(context)
        door = np.array([[5.0, DOOR_Y_M]])
        context._obstructions.step(0.0, door, np.zeros(0, dtype=np.bool_), discs(door, 0.5), (), ())
        context._shut_paths()
        context._take_what_leads_on()
        assert context.roadmap.is_cut_off(context.hop)
        state.step(Readings(0.1, {}), transitions)
        assert not context.roadmap.is_cut_off(context.hop)

    def test_an_unknown_thing_is_tried_again_less_and_less_often(self) -> None:
        impasses, place, t_s, waits = Impasses(), np.array([5.0, 1.0]), 0.0, []
        for _ in range(3):
            assert impasses.meet(place, 0.3)
            since_s = t_s
            while not impasses.step(t_s):
                t_s += 1.0
            waits.append(t_s - since_s)
            assert not len(impasses.discs)
        assert waits == [60.0, 120.0, 240.0]

    def test_an_unknown_thing_is_as_large_as_it_proves_to_be(self) -> None:
        impasses, place = Impasses(), np.array([5.0, 1.0])
        sizes: list[float] = []
        while impasses.meet(place + 0.03 * len(sizes), 0.5):
            ((x, y, size_m),) = impasses.discs.tolist()
            assert (x, y) == (5.0, 1.0)
            sizes.append(size_m)
        assert sizes == sorted(set(sizes))
        assert sizes[-1] <= 0.5 + 0.05


def test_a_door_that_things_beside_its_edges_narrow_keeps_nobody() -> None:
    """No return lay far enough from the map's walls to be of anything new: the robot stood there for good."""
    values = two_rooms(DOOR_Y_M, 5.0)
    values["robots"], values["team"] = values["robots"][1:2], {"strategy": "cyclic", "radio": {}}
    values["world"]["obstacles"] = [
        {"kind": "box", "from_m": [5.0, DOOR_Y_M + low], "to_m": [5.0, DOOR_Y_M + high], "thickness_m": 0.2}
        for low, high in ((-0.5, -0.35), (0.35, 0.5))
    ]
    values["task"]["duration_s"] = values["run"]["time_limit_s"] = 80.0
    experiment = build(mission_of(values, seed=1))
    run = run_loop(experiment)
    assert experiment.task.judge(run.finished).metrics["collisions"] == 0
    task: Any = experiment.task
    assert (80.0 - task._visits.last_s).max() < 45.0


def test_where_it_plans_past_a_body_it_may_drive() -> None:
    """Plans came 2 cm nearer than commands may: it stood before the gap, and all counted on its share."""
    motion: Any = build(mission_of(two_rooms(DOOR_Y_M), seed=0)).team[1].stack._context.motion  # type: ignore[attr-defined]
    radius_m = motion._senses.radius_m
    angles = np.linspace(0.0, 2.0 * np.pi, 200)
    rim = radius_m * np.column_stack([np.cos(angles), np.sin(angles)])
    for ahead_m in np.linspace(0.0, 1.0, 11):
        body = rim + np.array([ahead_m, motion.shut_m])
        seen, no_map = (body, body, NOBODY), (np.zeros((1, 1)), 0.0, 0.0, 1.0)
        assert safe_stop.stop_is_clear(
            0.2, 0.0, 0.2, 0.0, motion._limits, motion._safety, seen, np.zeros(3), no_map
        )


@pytest.mark.parametrize(("off_m", "there"), [(0.1, True), (0.6, False)])
def test_where_the_way_around_a_body_ends_near_a_place_it_is_there(off_m: float, *, there: bool) -> None:
    """It stood at the end of the way until it stalled, 0.51 m from the place, on every round."""
    context: Any = build(mission_of(two_rooms(DOOR_Y_M), seed=0)).team[1].stack._context  # type: ignore[attr-defined]
    place = context.roadmap.places_xy_m[context.hop]
    body = place + np.array([[0.0, 0.05]])
    near_m = 0.9 * context.task.visit_m - context.roadmap.spacing_m
    away = place + np.array([0.0, 1.5])
    around = context.roadmap.around(discs(body, 0.6), (float(away[0]), float(away[1])), near_m)
    x, y = around.origin_xy_m
    row, column = around._seeds[context.hop]
    end = np.array([x + column * around.spacing_m, y + row * around.spacing_m])
    assert 0.5 < float(np.hypot(*(end - place))) <= near_m
    out = (end - place) / float(np.hypot(*(end - place)))
    here = end + off_m * out
    context.roadmap = context._shut = around
    context.pose = Pose2(float(here[0]), float(here[1]), 0.0)
    assert context.arrived(blocked=False) is there
    context._shut = None
    assert not context.arrived(blocked=False)
