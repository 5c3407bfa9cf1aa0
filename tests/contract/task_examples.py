"""Examples of tasks, run to their end in a small world, and of motions, driven in it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from pilotage.core.types import Twist
from pilotage.evaluation.tasks.task import TaskSetting
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of
from support import worlds
from support.missions import MISSIONS


def motion_moves(factory: Any, config: Any) -> None:
    """A data sheet that says what the robot can do; the simulated one drives, and stops where it is told."""
    assert factory is type(config)
    assert 0.0 < config.top_speed_m_s < math.inf
    assert 0.0 < config.top_turn_rate_rad_s < math.inf
    assert config.least_turning_radius_m >= 0.0
    assert config.braking_m_s2 > 0.0
    sim = worlds.simulator(worlds.robot(motion=config))
    for _ in range(20):
        sim.step([Twist(0.5 * config.top_speed_m_s, 0.0)])
    body = sim.bodies[0]
    assert body.driven_m > 0.05
    for _ in range(100):
        sim.step([Twist(0.0, 0.0)])
    assert abs(body.twist.v_m_s) < 1e-6


def task_runs(name: str) -> Callable[[Any, Any], None]:
    """The task in a mission that fits it: it ends, says why, and gives the same verdict twice."""

    def runs(factory: Any, config: Any) -> None:
        values = {**MISSIONS[name], "task": {"name": name, **config.model_dump(mode="json")}}
        experiment = build(mission_of(values))
        footprints = tuple(member.known.footprint for member in experiment.team)
        task = factory(config, TaskSetting(experiment.mission, experiment.chart, footprints))
        assert type(task) is type(experiment.task)
        assert task.columns == experiment.task.columns
        assert len(task.row(0)) == len(task.columns)
        assert all(unit for unit in task.columns.values())
        run = run_loop(experiment)
        assert (run.finished.steps > 0) is task.drives
        verdict = experiment.task.judge(run.finished)
        assert verdict.metrics["success"] is True, verdict.metrics["reason"]
        assert verdict.metrics["reason"]
        assert len(verdict.columns) == len(run.finished.robots)
        again = experiment.task.judge(run.finished)
        assert repr(again.metrics) == repr(verdict.metrics)
        for one, other in zip(verdict.columns, again.columns, strict=True):
            assert one.keys() == other.keys()
            assert all(np.array_equal(one[key], other[key], equal_nan=True) for key in one)

    return runs
