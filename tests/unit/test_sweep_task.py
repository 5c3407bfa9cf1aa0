"""Sweeps as they are driven: what the task asks, what its robot does, and what it is told."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import Twist
from pilotage.evaluation.tasks.sweep import _too_little
from pilotage.experiments import warm_up
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of
from pilotage.stack.control.last_word import LastWord
from pilotage.stack.control.own_half import OwnHalf
from pilotage.stack.interface import Belief
from pilotage.stack.navigator.trail import Trail
from pilotage.stack.planning.boustrophedon import BoustrophedonPlanner
from pilotage.stack.planning.planner import PlanRequest, PlanResult
from support.missions import MISSIONS


class TestTask:
    def test_a_room_is_swept_and_the_robot_comes_back(self) -> None:
        experiment = build(mission_of(MISSIONS["sweep-floor"], seed=0))
        run = run_loop(experiment).finished
        metrics = experiment.task.judge(run).metrics
        assert metrics["success"], metrics["reason"]
        assert metrics["collisions"] == 0
        assert [event.kind for event in run.events] == ["plan", "arrived"]
        assert float(str(metrics["swept_fraction"])) >= 0.9999
        assert float(str(metrics["sweep_ratio"])) < 1.2
        end = run.robots[0].trace
        assert np.hypot(end["true_x_m"][-1] - 1.0, end["true_y_m"][-1] - 1.0) < 0.1

    def test_what_it_left_it_sweeps_in_the_end(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """For some seconds it might have been anywhere, as far as it knows."""
        add, steps = Trail.add, 0

        def adds(self: Trail, belief: Belief) -> None:
            nonlocal steps
            steps += 1
            vague = np.eye(3) if 200 <= steps < 320 else belief.cov
            add(self, Belief(belief.pose, vague, belief.status))

        monkeypatch.setattr(Trail, "add", adds)
        experiment = build(mission_of(MISSIONS["sweep-floor"], seed=0))
        run = run_loop(experiment).finished
        metrics = experiment.task.judge(run).metrics
        assert [event.kind for event in run.events] == ["plan", "rest", "arrived"]
        assert len(run.robots[0].plans) == 2
        assert metrics["success"], metrics["reason"]

    def test_its_passes_overlap_by_how_unsure_it_is(self, monkeypatch: pytest.MonkeyPatch) -> None:
        plan, asked = BoustrophedonPlanner.plan, []

        def plans(self: BoustrophedonPlanner, request: PlanRequest) -> PlanResult:
            asked.append(request.unsure_m)
            return plan(self, request)

        monkeypatch.setattr(BoustrophedonPlanner, "plan", plans)
        run = run_loop(build(mission_of(MISSIONS["sweep-floor"], seed=0))).finished
        trace = run.robots[0].trace
        row = int(np.searchsorted(trace["t_s"], run.events[0].t_s))
        xx, xy, yy = (trace[f"cov_{name}_m2"][row] for name in ("xx", "xy", "yy"))
        least_m2 = np.linalg.eigvalsh([[xx, xy], [xy, yy]])[0]
        assert asked[0] == pytest.approx(np.sqrt(least_m2), rel=1e-6)

    def test_it_plans_where_its_first_readings_show_it_to_be(self) -> None:
        """It planned from 0.1 m beside, and drove back in the end for what it had not swept there."""
        values = copy.deepcopy(MISSIONS["sweep-floor"])
        values["stack"]["initial"] = {"x_var_m2": 0.01, "y_var_m2": 0.01, "theta_var_rad2": 0.01}
        run = run_loop(build(mission_of(values, seed=0))).finished
        assert [event.kind for event in run.events] == ["plan", "arrived"]
        told, plan = run.robots[0].trace, run.robots[0].plans[0]
        began = np.array([told["true_x_m"][0], told["true_y_m"][0]])
        assert np.hypot(*(plan.states[0, :2] - began)) < 0.01

    @pytest.mark.parametrize("localizer", ["slam", "dead-reckoning"])
    def test_who_never_mends_its_start_is_told_so_before_it_sweeps(self, localizer: str) -> None:
        """Three of four that made their own map gave up, centimetres off, or swept 99.97 %."""
        vague = {"x_var_m2": 0.01, "y_var_m2": 0.01, "theta_var_rad2": 0.01}
        values = copy.deepcopy(MISSIONS["sweep-floor"])
        values["stack"]["localizer"], values["stack"]["initial"] = localizer, vague
        with pytest.raises(InputError, match=r"^navigator 'maneuver': .* take stack\.localizer: laser"):
            build(mission_of(values, seed=0))
        values["stack"]["initial"] = dict.fromkeys(vague, 1e-6)
        build(mission_of(values, seed=0))

    def test_a_room_that_nobody_asks_for_is_no_waste(self) -> None:
        """A door with 3 cm to spare is none for cells of 3 cm that ask for 2: a ratio of 2."""
        values = copy.deepcopy(MISSIONS["sweep-floor"])
        door = [[2.5, 0, 2.5, 0.767], [2.5, 1.213, 2.5, 2]]
        walls = [[0, 0, 5, 0], [5, 0, 5, 2], [5, 2, 0, 2], [0, 2, 0, 0], *door]
        values["world"] |= {"map": {"map": "rooms", "walls_m": walls}, "start": {"x_m": 1.0, "y_m": 1.0}}
        values["robot"]["footprint"] = {"radius_m": 0.193}
        values["task"] = {"name": "sweep-floor", "width_m": 0.36}
        values["stack"]["planner"]["width_m"] = 0.36
        experiment = build(mission_of(values, seed=0))
        metrics = experiment.task.judge(run_loop(experiment).finished).metrics
        assert metrics["success"], metrics["reason"]
        assert float(str(metrics["sweep_ratio"])) < 1.2

    def test_where_it_was_shown_no_room_it_looks_again_in_the_end(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """What a laser showed at one moment shut off a piece of floor for good: it "arrived" with 93 %."""
        allows = LastWord.allows
        refused: list[float] = []

        def doubts(self: LastWord, command: Twist) -> bool:
            if self._t_s >= 22.0 and not refused:
                refused.append(self._t_s)
                self.shown_m = np.column_stack([np.full(7, 0.4), np.linspace(-0.3, 0.3, 7)])
                return False
            return allows(self, command)

        monkeypatch.setattr(LastWord, "allows", doubts)
        monkeypatch.setattr(OwnHalf, "sees", lambda self, shown_m: False)  # noqa: ARG005
        experiment = build(mission_of(copy.deepcopy(MISSIONS["sweep-floor"]), seed=0))
        run = run_loop(experiment).finished
        metrics = experiment.task.judge(run).metrics
        assert refused
        assert "rest" in [event.kind for event in run.events]
        assert metrics["success"], metrics["reason"]

    def test_who_turns_sluggishly_drives_its_lines_all_the_same(self) -> None:
        """It turned too far, set out askew, was 0.1 m beside lines, and went for the rest three times."""
        values = copy.deepcopy(MISSIONS["sweep-floor"])
        slow = {"max_turn_rate_rad_s": 2.4, "max_turn_acceleration_rad_s2": 2.5}
        values["robot"]["motion"] = {"name": "differential-drive", **slow}
        experiment = build(mission_of(values, seed=0))
        run = run_loop(experiment).finished
        metrics = experiment.task.judge(run).metrics
        assert metrics["success"], metrics["reason"]
        assert [event.kind for event in run.events] == ["plan", "arrived"]
        trace = run.robots[0].trace
        ahead = np.array([trace["ref_x_m"] - trace["true_x_m"], trace["ref_y_m"] - trace["true_y_m"]])
        theta = np.asarray(trace["ref_theta_rad"])
        across = np.abs(np.cos(theta) * ahead[1] - np.sin(theta) * ahead[0])[trace["t_s"] > 10.0]
        assert np.quantile(across[np.isfinite(across)], 0.95) < 0.012

    def test_it_is_planned_once_before_it_is_driven(self, monkeypatch: pytest.MonkeyPatch) -> None:
        rehearsed: list[str] = []
        monkeypatch.setattr(warm_up, "simulate", lambda mission: rehearsed.append(mission.task.name))
        monkeypatch.setattr(warm_up, "_WARM", set())
        for name in ("sweep-floor", "reach"):
            warm_up.warm_up(mission_of(MISSIONS[name], seed=0))
        assert rehearsed == ["reach"]

    def test_who_leaves_some_of_it_has_not_swept_the_floor(self) -> None:
        values = copy.deepcopy(MISSIONS["sweep-floor"])
        values["stack"]["planner"] = {"name": "astar"}
        experiment = build(mission_of(values, seed=0))
        metrics = experiment.task.judge(run_loop(experiment).finished).metrics
        assert not metrics["success"]
        assert str(metrics["reason"]).startswith("swept ")

    @pytest.mark.parametrize("points_m", [[[0.4, 0], [-0.2, 0.25], [-0.2, -0.25]]])
    def test_an_outline_is_given_the_room_that_its_turns_take(self, points_m: list[list[float]]) -> None:
        """It was planned for the planner's clearance, less than the outline's radius, and fitted nowhere."""
        values = copy.deepcopy(MISSIONS["sweep-floor"])
        values["robot"]["footprint"] = {"points_m": points_m}
        experiment = build(mission_of(values, seed=0))
        metrics = experiment.task.judge(run_loop(experiment).finished).metrics
        assert metrics["success"], metrics["reason"]
        assert metrics["collisions"] == 0

    def test_who_cannot_turn_on_the_spot_is_told_who_can(self) -> None:
        """It was told to take a planner that sweeps nothing, after the sweep had been planned."""
        values = copy.deepcopy(MISSIONS["sweep-floor"])
        values["robot"]["motion"] = {"name": "bicycle", "wheelbase_m": 0.4}
        with pytest.raises(
            InputError, match=r"turns on the spot.*take robot\.motion\.name: differential-drive"
        ):
            build(mission_of(values))

    def test_passes_wider_than_what_they_sweep_are_refused(self) -> None:
        """``task.width_m`` alone was driven to the end, with floor unswept between any two passes."""
        values = {**MISSIONS["sweep-floor"], "task": {"name": "sweep-floor", "width_m": 0.4}}
        with pytest.raises(InputError, match=r"stack\.planner\.width_m: expected at most 0\.4 m.*set both"):
            build(mission_of(values, seed=0))

    def test_a_team_is_refused(self) -> None:
        values = {**MISSIONS["sweep-floor"], "team": {"size": 2}}
        with pytest.raises(InputError, match="task 'sweep-floor': expected one robot, found 2"):
            build(mission_of(values))


@pytest.mark.parametrize(
    ("swept", "least", "told"),
    [
        (0.9998986, 0.9999, "swept 99.9899 % of the floor, not 99.99 %"),
        (0.25, 0.9999, "swept 25.00 % of the floor, not 99.99 %"),
        (0.99989999, 0.9999, "swept 99.989999 % of the floor, not 99.99 %"),
        (0.4, 0.5, "swept 40.00 % of the floor, not 50 %"),
    ],
)
def test_what_was_swept_is_told_apart_from_what_was_asked_for(swept: float, least: float, told: str) -> None:
    """It said "swept 99.99 % of the floor, not 99.99 %"."""
    assert _too_little(swept, least) == told
