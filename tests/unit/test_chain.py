"""Legs one after another: where each begins, what is refused, what a page shows of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from pilotage.core.errors import InputError
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission
from pilotage.missions.mission import Mission
from pilotage.records.world import read_world
from pilotage.report import write_report

LEGS = [{"name": "pose", "arrival_m": 1.0}, {"name": "curve", "speed_m_s": 0.04}]


@pytest.fixture
def ground(tmp_path: Path) -> Path:
    """Obstacles of 60 x 40 pixels of 10 m: a wall across with a gap on top; white on black."""
    pixels = np.zeros((40, 60), np.uint8)
    pixels[3:, 30] = 255
    Image.fromarray(pixels).save(tmp_path / "obstacles.png")
    return tmp_path / "obstacles.png"


def project(ground: Path, legs: list[dict[str, Any]] = LEGS) -> Mission:
    """The rover's project on a small ground: to a pose before the wall, and on to a place behind it."""
    goal = "{x_m: 150, y_m: 105, theta_rad: 0.0, tolerance_m: 3.0}"
    settings = {
        "world.map.name": "images",
        "world.map.obstacles": str(ground),
        "world.start": "{x_m: 55, y_m: 45, theta_rad: 1.0}",
        "world.goal": goal,
        "task.goals": "[{x_m: 545, y_m: 45, tolerance_m: 12.0}]",
        "stack.navigator": json.dumps({"name": "chain", "legs": legs}),
        "stack.initial": "{x_var_m2: 0.01, y_var_m2: 0.01, theta_var_rad2: 1.0e-6}",
        "run.oracles": "[driver]",
    }
    return load_mission("gale-traverse", [f"{key}={value}" for key, value in settings.items()])


def test_the_second_leg_begins_where_the_first_one_truly_ended(ground: Path) -> None:
    run = simulate(project(ground)).finished
    robot = run.robots[0]
    trace = robot.trace
    assert robot.arrived
    leg = trace["leg"]
    first = int(np.flatnonzero(leg == 1.0)[0])
    ended = np.array([trace["true_x_m"][first], trace["true_y_m"][first]])
    assert np.hypot(*(ended - [150.0, 105.0])) < 3.0
    plan = robot.plans[0]
    assert plan.t_s == pytest.approx(trace["t_s"][first])
    assert np.hypot(*(plan.states[0, :2] - ended)) < 10.0
    assert np.isnan(trace["ref_x_m"][:first]).all()
    assert np.isfinite(trace["ref_x_m"][first + 1 :]).any()
    assert np.hypot(trace["true_x_m"][-1] - 545.0, trace["true_y_m"][-1] - 45.0) < 12.0


def test_a_leg_reads_its_own_plans_and_counts_again() -> None:
    """What was handed on was taken from it: navigator `goal` fell over its own last plan."""
    settings = {
        "world.obstacles": "[]",
        "world.goal": "{x_m: 3.0, y_m: 1.0}",
        "task.goals": "[{x_m: 5.0, y_m: 2.0}]",
        "stack.navigator": "{name: chain, legs: [goal, goal]}",
        "stack.mapper": "null",
        "stack.reactive": "null",
        "stack.escape": "null",
    }
    run = simulate(load_mission("museum-1", [f"{key}={value}" for key, value in settings.items()])).finished
    robot = run.robots[0]
    assert robot.arrived
    assert len(robot.plans) == 2 + robot.counts["replans"], "each is told once"


@pytest.mark.parametrize(
    ("legs", "says"),
    [
        (LEGS[:1], "a leg for each goal"),
        ([LEGS[0], {"name": "chain", "legs": LEGS}], "one leg"),
        ([LEGS[0], {"speed_m_s": 0.04}], "name of a navigator"),
        ([LEGS[0], {"name": "curved"}], "curve"),
        ([LEGS[0], {"name": "curve", "speed_m_s": -1.0}], "legs.1"),
    ],
)
def test_chains_that_cannot_be_are_refused(legs: list[dict[str, Any]], says: str, ground: Path) -> None:
    with pytest.raises(InputError, match=says):
        build(project(ground, legs))


def test_the_page_shows_every_goal_and_the_path_under_the_curve(ground: Path, tmp_path: Path) -> None:
    result = run_mission(project(ground), out=tmp_path)
    assert result.run_dir is not None
    page = write_report(result.run_dir).read_text()
    assert "The planned path under the curve" in page
    assert [goal[:2] for goal in read_world(result.run_dir).robots[0].goals] == [
        (150.0, 105.0),
        (545.0, 45.0),
    ]


def test_the_reports_project_is_one_mission() -> None:
    """Built, not driven: that takes half a minute."""
    mission = load_mission("gale-traverse")
    assert [leg["name"] for leg in mission.stack.navigator.parameters["legs"]] == ["pose", "curve"]
    assert mission.task.parameters["goals"][0]["x_m"] == 10870.0
