"""Batteries of robots on patrol: they charge in time, their mates know it, and an empty one is a failure."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import STOP, Twist
from pilotage.experiments.build.build import build, build_source
from pilotage.experiments.disturbances import Disturbances
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import load_mission, mission_of
from pilotage.face.stepping import Simulation
from pilotage.stack.navigator.patrol.config import Mode
from support.missions import MISSIONS

BATTERY = {"range_m": 40.0, "charge_s": 8.0, "reserve_m": 3.0}


def two_in_a_room(duration_s: float, **team: Any) -> dict[str, Any]:
    """Two robots in the small room of the examples, with batteries."""
    values = {**MISSIONS["patrol"], "run": {"time_limit_s": duration_s}}
    values["team"] = {**values["team"], "battery": BATTERY, **team}
    values["task"] = {"name": "patrol", "duration_s": duration_s}
    return values


class TestCharging:
    def test_they_go_in_time_stand_for_it_and_come_back(self) -> None:
        experiment = build(mission_of(two_in_a_room(150.0), seed=2))
        finished = run_loop(experiment).finished
        metrics = experiment.task.judge(finished).metrics
        assert metrics["success"], metrics["reason"]
        assert metrics["robots_failed"] == metrics["collisions"] == 0
        charges = sum(robot.counts["charges"] for robot in finished.robots)
        assert metrics["charges"] == charges >= 4
        for index, robot in enumerate(finished.robots):
            x, y = experiment.mission.station_of(index) or (np.nan, np.nan)
            trace = robot.trace
            charging = trace["mode"] == Mode.CHARGE
            away_m = np.hypot(trace["true_x_m"] - x, trace["true_y_m"] - y)
            assert away_m[charging].max() < 0.8
            # It was back on patrol after its last charge, and drove farther than one battery lasts.
            assert robot.driven_m > BATTERY["range_m"]

    def test_no_path_around_a_mate_takes_the_last_metres(self) -> None:
        """1.4 m from its station one drove 4.4 m around a mate that went to its own, until it was empty."""
        experiment = build(mission_of(two_in_a_room(60.0), seed=25))
        metrics = experiment.task.judge(run_loop(experiment).finished).metrics
        assert metrics["success"]
        assert metrics["robots_failed"] == 0

    def test_the_others_are_told_if_there_is_a_radio(self) -> None:
        experiment = build(mission_of(two_in_a_room(100.0), seed=2))
        heard: set[bool] = set()
        context = experiment.team[1].stack._context  # type: ignore[attr-defined]
        receive = context.memory.receive

        def listen(message: Any) -> None:
            heard.update(state.on_duty for state in message.states if state.robot == 0)
            receive(message)

        context.memory.receive = listen
        run_loop(experiment)
        assert heard == {True, False}


class TestEmpty:
    def test_who_runs_out_stands_still_and_says_nothing_for_good(self) -> None:
        team = {"size": 1, "battery": {"range_m": 1.0, "charge_s": 2.0}}
        source = build_source(mission_of(two_in_a_room(20.0, **team), seed=2))
        simulator, body = source.simulator, source.simulator.bodies[0]
        disturbances = Disturbances(source.mission, simulator)
        events = []
        for step in range(300):
            simulator.step([Twist(0.2, 0.6) if step < 150 else STOP])
            events += disturbances.due()
        assert [event.kind for event in events] == ["failure"]
        assert body.stopped
        assert not simulator.radios[0].works
        assert 1.0 <= body.driven_m < 1.1

    def test_only_the_whole_time_at_the_station_fills_it(self) -> None:
        team = {"size": 1, "battery": {"range_m": 1.0, "charge_s": 2.0}}
        for stand_steps, stopped in ((10, True), (35, False)):
            source = build_source(mission_of(two_in_a_room(20.0, **team), seed=2))
            simulator = source.simulator
            disturbances = Disturbances(source.mission, simulator)
            commands = [Twist(0.2, 2.0)] * 30 + [STOP] * stand_steps + [Twist(0.2, 2.0)] * 30
            dt_s = source.mission.run.dt_s
            for command in commands:
                for _ in range(round(0.1 / dt_s)):
                    simulator.step([command])
                    disturbances.due()
            assert simulator.bodies[0].stopped is stopped


def test_who_cannot_be_put_down_yet_keeps_nobody_else_waiting_and_each_is_named() -> None:
    """Where a mate stood for good nobody was carried any more; and a team's page did not say who was."""
    values = two_in_a_room(20.0)
    values["team"] |= {"starts": [{"x_m": 2.0, "y_m": 2.0}, {"x_m": 4.0, "y_m": 2.0}]}
    values["world"] = {**values["world"], "kidnaps": []}
    for robot, x_m in ((0, 4.0), (1, 4.2)):
        to = {"x_m": x_m, "y_m": 2.0}
        values["world"]["kidnaps"].append({"robot": robot, "at_s": 0.1 * (1 + robot), "to": to})
    source = build_source(mission_of(values, seed=2))
    disturbances, told = Disturbances(source.mission, source.simulator), []
    for _ in range(5):
        source.simulator.step([STOP, STOP])
        told += [event.text for event in disturbances.due()]
    assert told == ["robot-1: the robot is carried to (4.20, 2.00) and not told"]


def test_nobody_is_put_down_right_before_somebody_not_even_when_stepped_by_hand() -> None:
    """A random place was 0.07 m before a mate that drove on; and stepping by hand put robots into others."""
    values = two_in_a_room(20.0)
    values["team"] |= {"starts": [{"x_m": 1.0, "y_m": 3.0}, {"x_m": 3.0, "y_m": 2.0}]}
    beside = {"robot": 0, "at_s": 0.1, "to": {"x_m": 4.0, "y_m": 2.0}}
    values["world"] = {**values["world"], "kidnaps": [beside]}
    sim = Simulation(mission_of(values, seed=2))
    sim.reset_all()
    sim.step([Twist(0.0, 0.0), Twist(0.0, 0.0)])
    assert sim.poses[0].x_m == 1.0
    for _ in range(100):
        sim.step([Twist(0.0, 0.0), Twist(-0.5, 0.0)])
        if sim.poses[0].x_m == 4.0:
            break
    assert sim.poses[1].x_m == pytest.approx(2.4, abs=0.1)


def test_who_stops_stands_when_stepped_by_hand_as_in_a_run() -> None:
    values = two_in_a_room(20.0, failures=[{"robot": 1, "at_s": 0.5}])
    sim = Simulation(mission_of(values, seed=2))
    sim.reset_all()
    for _ in range(40):
        sim.step([Twist(0.1, 0.0)] * 2)
        if sim.t_s == pytest.approx(1.0):
            before = sim.poses
    assert sim.poses[0] != before[0]
    assert sim.poses[1] == before[1]


@pytest.mark.parametrize(
    ("overrides", "told"),
    [
        (["team.battery={range_m: 0, charge_s: 10}"], r"team\.battery\.range_m"),
        (["team.battery={range_m: 500, charge_s: -1}"], r"team\.battery\.charge_s"),
        (["team.battery={range_m: 20, charge_s: 10}"], r"battery\.range_m: expected at least \d+ m"),
        (["team.stations=[[1, 1]]"], r"stations: expected team\.battery beside them"),
        (
            ["team.battery={range_m: 500, charge_s: 9}", "team.stations=[[1, 1]]"],
            r"team\.stations: expected one for each of 4 robots, or none, found 1",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(overrides: list[str], told: str) -> None:
    with pytest.raises(InputError, match=told) as caught:
        build(load_mission("museum-patrol", overrides))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("stations", "told"),
    [
        ([[0.05, 0.05], [2.0, 2.0]], r"team\.stations\.0: expected .*to the nearest wall"),
        ([[-50.0, 0.0], [2.0, 2.0]], r"team\.stations\.0: expected a place on the map"),
        ([[2.0, 2.0], [2.1, 2.0]], r"team\.stations\.1: expected room for two robots"),
    ],
)
def test_stations_need_room(stations: list[list[float]], told: str) -> None:
    with pytest.raises(InputError, match=told) as caught:
        build(mission_of(two_in_a_room(20.0, stations=stations), seed=2))
    assert "\n" not in str(caught.value)


def test_batteries_are_for_patrols() -> None:
    values = {**MISSIONS["reach"], "team": {"battery": BATTERY}}
    with pytest.raises(InputError, match=r"team\.battery: expected task 'patrol', found 'reach'"):
        build(mission_of(values))
