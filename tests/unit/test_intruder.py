"""Somebody comes in among guards: he is seen for what he is, and nobody else is."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import Pose2
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import load_mission
from pilotage.kernels.scans.loose_clusters import loose_clusters
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, Readings
from pilotage.sim.people.intruder import Intruder, IntruderConfig
from pilotage.sim.people.people import Around, PeopleSetting
from pilotage.sim.worlds.world import World
from pilotage.stack.interface import Belief
from pilotage.stack.patrol.messages import PatrolMemory
from pilotage.stack.patrol.watch import IntruderWatch, WatchConfig
from pilotage.stack.patrol.word import TeamWord
from support.worlds import ROOM_MAP

ROBOTS = np.array([[2.0, 2.0, 0.0, 0.3]])
STOPPING = np.array([[0.0, 1.0]])
NEWS = PatrolMemory(2, 1, 2, 0, 1.0).message(0.0)


def judged(seed: int, duration_s: float, *overrides: str) -> dict[str, Any]:
    times = [f"task.duration_s={duration_s}", f"run.time_limit_s={duration_s}"]
    experiment = build(load_mission("museum-intruder", [*times, *overrides], seed=seed))
    return experiment.task.judge(run_loop(experiment).finished).metrics


def walked(plan: str, steps: int, robots: np.ndarray[Any, Any] = ROBOTS) -> np.ndarray[Any, Any]:
    """(T, 2) where he was, a robot standing."""
    config = IntruderConfig.model_validate({"plan": plan, "enters_from_s": 0, "enters_until_s": 0})
    world = World.of(ROOM_MAP)
    intruder = Intruder(
        config, PeopleSetting(world, robots, STOPPING, 0.1, np.random.default_rng(3), "world.people.0")
    )
    around = Around(robots, np.full((1, 3), np.nan), 0)
    return np.vstack([intruder.step(0.1 * k, around) for k in range(steps)])


class TestWalking:
    def test_nobody_walks_into_a_robot(self) -> None:
        # Wherever he goes in this room, robots stand about.
        robots = np.array(
            [[2.0, 2.0, 0.0, 0.3], [4.0, 3.0, 0.0, 0.3], [6.0, 4.5, 0.0, 0.3], [3.0, 5.0, 0.0, 0.3]]
        )
        places = walked("random", 3000, robots)
        away = np.hypot(*(places[:, None] - robots[None, :, :2]).transpose(2, 0, 1)) - 0.3 - 0.25
        assert away.min() > 0.05
        assert np.hypot(*np.diff(places, axis=0).T).sum() > 30.0

    def test_an_evasive_one_keeps_farther_away(self) -> None:
        away = {
            plan: np.hypot(*(walked(plan, 1500) - ROBOTS[0, :2]).T).mean() for plan in ("random", "evasive")
        }
        assert away["evasive"] > 1.2 * away["random"]

    def test_he_cannot_come_in_before_the_first_time_that_he_may(self) -> None:
        config = IntruderConfig(enters_from_s=20.0, enters_until_s=10.0)
        setting = PeopleSetting(
            World.of(ROOM_MAP), ROBOTS, STOPPING, 0.1, np.random.default_rng(0), "world.people.0"
        )
        with pytest.raises(InputError, match=r"enters_until_s: expected 20 s or more, found 10"):
            Intruder(config, setting)


class TestWatching:
    def test_points_that_hang_together_are_one_and_a_wall_is_none(self) -> None:
        person = np.column_stack([np.linspace(1.0, 1.3, 5), np.full(5, 2.0)])
        other = person + np.array([2.0, 0.0])
        wall = np.column_stack([np.linspace(5.0, 8.0, 20), np.full(20, 2.0)])
        speck = np.array([[12.0, 2.0]])
        found = loose_clusters(np.vstack([person, other, wall, speck]), 0.4, 1.0, 2)
        assert found == pytest.approx(np.array([[1.15, 2.0], [3.15, 2.0]]))

    def test_the_alarm_is_raised_once_for_who_is_seen_again_and_again(self) -> None:
        watch = IntruderWatch(WatchConfig(scans=3))
        said = [watch.step(np.array([[0.2 * k, 1.0], [0.2 * k + 0.1, 1.0]])) for k in range(8)]
        assert [len(one) for one in said] == [0, 0, 1, 0, 0, 0, 0, 0]
        # Somebody who is now here and now there is two, and neither for long.
        assert not any(watch.step(np.array([[5.0 * (k % 2), 1.0], [5.0 * (k % 2), 1.1]])) for k in range(9))

    def test_of_several_at_once_each_has_to_be_seen_as_many_times_as_often(self) -> None:
        watch = IntruderWatch(WatchConfig(scans=3))
        crowd = np.array([[x + dx, 1.0] for x in (0.0, 3.0, 6.0) for dx in (0.0, 0.1)])
        assert [len(watch.step(crowd)) for _ in range(10)] == [0] * 8 + [3, 0]
        assert [len(watch.step(crowd[:2])) for _ in range(4)] == [0] * 4  # who is left was told already

    def test_who_was_told_is_followed_and_nobody_beside_him(self) -> None:
        watch, somebody = IntruderWatch(WatchConfig(scans=3)), np.array([[0.0, 1.0], [0.2, 1.0]])
        mate = somebody + np.array([0.7, 0.0])
        assert not watch.follows(somebody, 0.3).any(), "was not seen"
        for _ in range(2):
            watch.step(somebody)
        assert not watch.follows(somebody, 0.3).any(), "was not told yet"
        watch.step(somebody)
        for _ in range(10):  # no word of a mate tells any more that he is none
            somebody = somebody - np.array([0.2, 0.0])
            seen = np.vstack([somebody, mate])
            assert watch.follows(seen, 0.3).tolist() == [True, True, False, False]
            watch.step(seen[watch.follows(seen, 0.3)])
        assert not watch.follows(mate, 0.3).any(), "is somebody else"
        watch.step(somebody[:0])
        assert not watch.follows(somebody, 0.3).any(), "was out of sight meanwhile"


class TestSensed:
    def test_he_stays_who_he_is_while_mates_fall_silent(self) -> None:
        """A robot that rolls on for seconds took him for a mate that stops, as its words had become old."""
        hall = "world.map={map: hall, walls_m: [[0, 0, 20, 0], [20, 0, 20, 9], [20, 9, 0, 9], [0, 9, 0, 0]]}"
        team = build(load_mission("museum-intruder", ["team.size=2", hall])).team
        senses = team[0].stack._context  # type: ignore[attr-defined]
        mate = team[1].stack._context.talk_habit  # type: ignore[attr-defined]
        belief = Belief(Pose2(4.0, 4.5, 0.0), 1e-6 * np.eye(3))
        lidar, config = team[0].known.one_sensor(LidarConfig, "test")
        angles = np.asarray(config.beam_angles_rad())
        ahead = np.abs(angles) < 0.12

        def people(t_s: float, away_m: float | None) -> int:
            cosines, sines = np.cos(angles), np.sin(angles)
            with np.errstate(divide="ignore"):
                walls = np.minimum(np.where(cosines > 0.0, 16.0, 4.0) / np.abs(cosines), 4.5 / np.abs(sines))
            ranges = np.minimum(walls, config.max_range_m)
            if away_m is not None:
                ranges[ahead] = away_m
            senses.take_in(Readings(t_s, {lidar: LidarScan(ranges)}), belief, lost=False)
            return len(senses.people)

        senses.hear(0.0, TeamWord(18.0, 1.0, False, None, None, NEWS, 0.3, talk=mate))
        assert all(people(0.2 * k, 3.0) == ahead.sum() for k in range(6))
        assert all(people(1.2 + 0.2 * k, 3.0) == ahead.sum() for k in range(200)), "in sight all the time"
        assert people(42.0, None) == 0
        assert people(42.2, 3.0) == 0, "it may be the mate that comes back"


class TestMuseum:
    def test_he_is_detected_and_not_touched(self) -> None:
        come = "world.people=[{name: intruder, enters_from_s: 5, enters_until_s: 10}]"
        metrics = judged(2, 60.0, come)
        assert metrics["detected"]
        assert 0.0 < metrics["detection_time_s"] < 55.0
        assert metrics["false_alarms"] == metrics["collisions"] == metrics["people_touches"] == 0
        own = metrics["robots"]
        assert isinstance(own, dict)
        assert metrics["alarms"] == sum(robot["alarms"] for robot in own.values()) > 0

    def test_a_team_alone_raises_no_alarm_and_one_without_radios_never(self) -> None:
        metrics = judged(2, 40.0, "world.people=[]")
        assert metrics["false_alarms"] == metrics["alarms"] == 0
        assert metrics["detected"] is None
        come = "world.people=[{name: intruder, enters_from_s: 5, enters_until_s: 10}]"
        silent = judged(2, 40.0, come, "team.radio=null")
        assert not silent["detected"]
        assert silent["detection_time_s"] is None or math.isnan(silent["detection_time_s"])
        assert silent["false_alarms"] == silent["collisions"] == 0


class TestInADoor:
    @pytest.mark.parametrize("seed", [1, 8])
    def test_who_meets_him_in_a_door_lets_him_through_and_goes_on(self, seed: int) -> None:
        """It stood in the door from then on, towards a place behind him, and he before it."""
        walls = [[0, 0, 14, 0], [14, 0, 14, 6], [14, 6, 0, 6], [0, 6, 0, 0], [7, 0, 7, 2.5], [7, 3.5, 7, 6]]
        metrics = judged(seed, 200.0, "team.size=1", f"world.map={{map: two-rooms, walls_m: {walls}}}")
        assert metrics["idleness_worst_s"] < 60.0
        assert metrics["collisions"] == 0

    def test_who_meets_him_where_a_corridor_ends_finds_a_way_past(self) -> None:
        """As far around him as around a mate there was none: both stood there from the 458th second on.

        And in a passage for one, from the 104th on, a robot waited for him to go back as a mate would: the
        team planned around him then, and around nobody when he had gone.
        """
        metrics = judged(0, 530.0)
        assert metrics["deadlocks"] == metrics["collisions"] == metrics["people_touches"] == 0
        assert metrics["idleness_worst_s"] < 1.5 * metrics["idleness_bound_s"]
