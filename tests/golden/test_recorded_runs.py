"""Small recorded runs: a change of these numbers is a change of behaviour, to be meant and recorded."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission

RECORDED = json.loads((Path(__file__).parent / "recorded_runs.json").read_text())


@pytest.mark.parametrize("name", sorted(RECORDED))
def test_run_is_as_recorded(name: str) -> None:
    recorded = RECORDED[name]
    finished = simulate(load_mission(recorded["mission"], recorded["overrides"], recorded["seed"])).finished
    (robot,) = finished.robots
    trace = robot.trace
    assert robot.arrived is recorded["arrived"]
    assert finished.steps == recorded["steps"]
    assert trace["t_s"].shape[0] == recorded["recorded"]
    assert [plan.length_m for plan in robot.plans] == pytest.approx(recorded["planned_m"], abs=1e-6)
    for step, row in recorded["rows"].items():
        for column, value in row.items():
            # The arithmetic of sine and cosine may differ in the last digits between machines.
            assert trace[column][int(step)] == pytest.approx(value, abs=1e-6), (step, column)


def test_the_same_seed_gives_the_same_run_bit_for_bit() -> None:
    mission = load_mission("museum-1", ["run.time_limit_s=40"], 5)
    traces = [simulate(mission).finished.robots[0].trace for _ in range(2)]
    assert traces[0].keys() == traces[1].keys()
    for column, values in traces[0].items():
        assert values.tobytes() == traces[1][column].tobytes(), column
