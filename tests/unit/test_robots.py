"""Several robots in a mission, and outlines of any shape, as they are built from its text."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import yaml

from pilotage.core.errors import InputError
from pilotage.evaluation.finished import FinishedRun
from pilotage.experiments.build.build import Experiment, build
from pilotage.experiments.loop import run_loop, simulate
from pilotage.experiments.mission import load_mission, mission_of
from pilotage.experiments.resolve import resolved_values, resolved_yaml
from pilotage.missions.mission import Mission
from pilotage.missions.robot import DiscFootprint, PolygonFootprint
from support.missions import drive, reach

CAR = [[0.7, 0.25], [-0.2, 0.25], [-0.2, -0.25], [0.7, -0.25]]


def team(*robots: dict[str, Any], **changes: Any) -> Mission:
    values = drive()
    values["robots"] = list(robots)
    return mission_of({**values, **changes})


LEFT = {"start": {"x_m": 2.0, "y_m": 2.0}}
RIGHT = {"start": {"x_m": 2.0, "y_m": 6.0}}


class TestNames:
    def test_without_names_they_are_numbered(self) -> None:
        mission = team(LEFT, {**RIGHT, "name": "watch"})
        assert [robot.name for robot in mission.members] == ["robot-0", "watch"]

    def test_each_is_laid_over_the_common_one(self) -> None:
        mission = team(LEFT, {**RIGHT, "footprint": {"radius_m": 0.2}, "motion": "omnidirectional"})
        one, other = mission.members
        assert (one.footprint.radius_m, other.footprint.radius_m) == (0.3, 0.2)  # type: ignore[union-attr]
        assert (one.motion.name, other.motion.name) == ("differential-drive", "omnidirectional")
        assert one.sensors == other.sensors

    def test_another_outline_is_not_laid_over_the_common_one(self) -> None:
        """Neither in an entry of ``robots``, nor by an override."""
        mission = team(LEFT, {**RIGHT, "footprint": {"points_m": CAR}})
        assert isinstance(mission.members[1].footprint, PolygonFootprint)
        loaded = load_mission("museum-1", [f"robot.footprint={{points_m: {CAR}}}"])
        assert isinstance(loaded.robot.footprint, PolygonFootprint)
        corners = load_mission("museum-1", [f"robot.footprint.points_m={CAR}"])
        assert corners.robot == loaded.robot
        back = team({"footprint": {"radius_m": 0.2}, **LEFT}, robot={"footprint": {"points_m": CAR}})
        assert isinstance(back.members[0].footprint, DiscFootprint)

    def test_short_forms_take_parameters(self) -> None:
        """A task, a motion and one robot's sensor that are a name alone."""
        loaded = load_mission("romi-explore", ["task.blocked_s=3"])
        assert loaded.task.parameters == {"blocked_s": 3}
        moves = load_mission("museum-1", ["robot.motion=omnidirectional", "robot.motion.max_speed_m_s=0.4"])
        assert (moves.robot.motion.name, moves.robot.motion.parameters) == (
            "omnidirectional",
            {"max_speed_m_s": 0.4},
        )
        short = ["team.strategy=dtap", "team.strategy.hop_s=3", "team.radio=radio", "team.radio.loss=0.5"]
        team = load_mission("museum-patrol", short).team
        assert team.strategy is not None
        assert team.radio is not None
        assert (team.strategy.parameters, team.radio.parameters) == ({"hop_s": 3}, {"loss": 0.5})

    def test_a_stack_of_its_own_is_laid_over_the_common_one(self) -> None:
        own = {**RIGHT, "stack": {"navigator": {"speed_m_s": 0.1}}}
        mission = team(LEFT, own)
        speeds = [mission.stack_of(robot).navigator.parameters["speed_m_s"] for robot in mission.members]
        assert speeds == [0.2, 0.1]

    @pytest.mark.parametrize(
        ("robots", "told"),
        [
            (({**LEFT, "name": "a"}, {**RIGHT, "name": "a"}), "expected every name once, found 'a' twice"),
            (
                (LEFT, {**RIGHT, "footprnt": {}}),
                r"robots\.1\.footprnt: unknown key; did you mean 'footprint'",
            ),
            ((LEFT, {**RIGHT, "motion": "hover"}), "unknown motion 'hover'"),
            ((LEFT, {**RIGHT, "sensors": {"x": {"name": "sonr"}}}), "unknown sensor 'sonr'"),
        ],
    )
    def test_what_is_wrong_is_said_of_the_right_one(self, robots: Any, told: str) -> None:
        with pytest.raises(InputError, match=told):
            team(*robots)


class TestStarts:
    def test_robots_inside_each_other_are_refused(self) -> None:
        near = {"start": {"x_m": 2.4, "y_m": 2.0}}
        with pytest.raises(
            InputError, match=r"robots\.1\.start: expected robots apart, found 'robot-1' inside 'robot-0'"
        ):
            build(team(LEFT, near))

    def test_touching_corners_of_polygons_are_refused_by_the_simulator(self) -> None:
        """The middles are far enough apart; the outlines are not."""
        long = {"footprint": {"points_m": CAR}}
        with pytest.raises(InputError, match="expected starts apart, found them inside each other"):
            build(team({**LEFT, **long}, {**long, "start": {"x_m": 2.6, "y_m": 2.0}}))

    def test_each_needs_room(self) -> None:
        with pytest.raises(InputError, match=r"^robots\.1\.start: expected at least the body's radius"):
            build(team(LEFT, {"start": {"x_m": 2.0, "y_m": 7.9}}))

    def test_each_needs_room_among_what_is_on_no_map_too(self) -> None:
        values = drive()
        values["world"]["obstacles"] = [{"kind": "circle", "centre_m": [2.0, 6.0], "radius_m": 0.2}]
        values["robots"] = [LEFT, RIGHT]
        with pytest.raises(InputError, match=r"^robots\.1\.start: expected room for the robot's footprint"):
            build(mission_of(values))

    def test_a_polygon_that_stands_with_its_nose_in_a_wall_is_refused(self) -> None:
        values = drive()
        values["robot"]["footprint"] = {"points_m": CAR}
        values["world"]["start"] = {"x_m": 2.0, "y_m": 0.4, "theta_rad": -1.5}
        with pytest.raises(InputError, match=r"^world\.start: expected room for the robot's footprint"):
            build(mission_of(values))

    def test_a_sensor_is_named_with_its_robot(self) -> None:
        odd = {**RIGHT, "sensors": {"lidar": {"name": "lidar", "rate_hz": 7.0}}}
        with pytest.raises(InputError, match=r"^robots\.robot-1\.sensors\.lidar\.rate_hz: expected a whole"):
            build(team(LEFT, odd))

    def test_a_kidnap_of_nobody_is_refused(self) -> None:
        values = drive()
        values["world"]["kidnaps"] = [{"at_s": 1.0, "robot": 2}]
        values["robots"] = [LEFT, RIGHT]
        with pytest.raises(InputError, match="there is no robot 2 of 2"):
            mission_of(values)


def finished(mission: Mission) -> tuple[Experiment, FinishedRun]:
    experiment = build(mission)
    return experiment, run_loop(experiment).finished


class TestRuns:
    def test_a_team_is_judged_together_and_each_for_itself(self) -> None:
        experiment, run = finished(team(LEFT, RIGHT))
        metrics = experiment.task.judge(run).metrics
        assert metrics["success"] is True
        assert metrics["team_size"] == 2
        each = metrics["robots"]
        assert isinstance(each, dict)
        assert set(each) == {"robot-0", "robot-1"}
        lengths = [entry["path_length_m"] for entry in each.values()]
        assert metrics["path_length_m"] == pytest.approx(sum(lengths))

    def test_one_of_several_has_draws_of_its_own(self) -> None:
        """Who else is there changes nothing for it, out of sight and reach."""
        third = {"start": {"x_m": 8.0, "y_m": 2.0}}
        two = simulate(team(LEFT, RIGHT)).finished.robots[0].trace
        three = simulate(team(LEFT, RIGHT, third)).finished.robots[0].trace
        other = simulate(team(LEFT, RIGHT)).finished.robots[1].trace
        assert np.array_equal(two["odom_distance_m"], three["odom_distance_m"], equal_nan=True)
        assert not np.array_equal(two["odom_distance_m"], other["odom_distance_m"], equal_nan=True)

    def test_one_that_runs_into_another_ends_it_and_says_so(self) -> None:
        """The one behind is the faster one."""
        ahead = {
            "name": "slow",
            "start": {"x_m": 3.0, "y_m": 2.0},
            "stack": {"navigator": {"speed_m_s": 0.01}},
        }
        behind = {
            "name": "fast",
            "start": {"x_m": 1.8, "y_m": 2.0},
            "stack": {"navigator": {"speed_m_s": 0.8}},
        }
        straight = drive()["stack"]
        straight["navigator"] |= {"turn_rate_rad_s": 0.0, "duration_s": 5.0}
        experiment, run = finished(team(behind, ahead, stack=straight))
        assert run.ending.startswith("collision of fast and slow at (")
        assert [event.text for event in run.events if event.kind == "collision"] == [
            "fast: the body touched robot slow",
            "slow: the body touched robot fast",
        ]
        assert ") after " in run.ending, "both are named already"
        metrics = experiment.task.judge(run).metrics
        assert metrics["success"] is False
        assert metrics["collisions"] == 2, "who is run into has touched something, too"

    def test_who_was_done_before_the_run_ended_has_a_reason_of_its_own(self) -> None:
        """Each had that of the team: a robot that had arrived, and a success, told of others' collision."""
        soon = {**LEFT, "name": "soon", "stack": {"navigator": {"duration_s": 0.5}}}
        experiment, run = finished(team({**RIGHT, "name": "late"}, soon, run={"time_limit_s": 1.0}))
        metrics: Any = experiment.task.judge(run).metrics
        reasons = {name: one["reason"] for name, one in metrics["robots"].items()}
        assert reasons == {
            "late": "time limit of 1 s reached",
            "soon": "the command was carried out to its end",
        }
        assert metrics["reason"] == reasons["late"]

    def test_the_resolved_mission_is_the_same_team(self) -> None:
        mission = team(LEFT, {**RIGHT, "name": "watch", "footprint": {"points_m": CAR}})
        experiment = build(mission)
        again = mission_of(yaml.safe_load(resolved_yaml(experiment.mission, experiment.chart)))
        assert [robot.name for robot in again.members] == ["robot-0", "watch"]
        assert resolved_values(again)["robots"] == resolved_values(experiment.mission)["robots"]


def outlined(points: Any, **start: float) -> Mission:
    values = reach()
    values["robot"]["footprint"] = {"points_m": points}
    values["world"]["start"] |= start
    return mission_of(values)


class TestPolygons:
    def test_a_polygon_is_its_outline_from_the_text_to_the_body(self) -> None:
        experiment = build(outlined(CAR, theta_rad=0.0))
        (body,) = experiment.simulator.bodies
        assert not body.footprint.is_disc
        assert body.footprint.radius_m == pytest.approx(math.hypot(0.7, 0.25))
        assert body.footprint.inner_radius_m == pytest.approx(0.2)
        # Its nearest wall is below: half the car's width, not the disc around it.
        assert body.clearance_m == pytest.approx(2.0 - 0.25)
        assert experiment.team[0].known.radius_m == body.footprint.radius_m

    def test_the_way_round_does_not_matter(self) -> None:
        one, other = (build(outlined(points)).simulator.bodies[0] for points in (CAR, CAR[::-1]))
        assert one.clearance_m == pytest.approx(other.clearance_m, abs=1e-12)

    def test_it_drives_through_the_gap(self) -> None:
        run = simulate(outlined([[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]])).finished
        assert run.robots[0].arrived
        assert run.robots[0].collisions == 0

    def test_it_turns_its_corner_into_a_wall_that_a_disc_would_clear(self) -> None:
        """Beside a wall, a turn on the spot: the nose touches, and the run ends."""
        values = drive()
        values["robot"]["footprint"] = {"points_m": CAR}
        values["world"]["start"] = {"x_m": 2.0, "y_m": 0.4, "theta_rad": 0.0}
        values["stack"]["navigator"] |= {"speed_m_s": 0.0, "turn_rate_rad_s": -0.5}
        assert simulate(mission_of(values)).finished.ending.startswith("collision at (2.00, 0.40)")
        values["robot"]["footprint"] = {"radius_m": 0.3}
        assert simulate(mission_of(values)).finished.robots[0].arrived

    @pytest.mark.parametrize(
        ("points", "told"),
        [
            ([[0.1, 0.1], [-0.1, 0.1]], "footprint.points_m"),
            ([[1, 0], [2, 0], [2, 1]], "footprint.points_m"),
            ([[0.5, 0.5], [-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5]], "footprint.points_m"),
            ([[0.5, 0.5], [-0.5, math.nan], [0.0, -0.5]], "finite"),
        ],
    )
    def test_what_is_no_outline_is_refused_in_one_line(self, points: Any, told: str) -> None:
        with pytest.raises(InputError, match=told) as caught:
            build(outlined(points))
        assert "\n" not in str(caught.value)
