"""Examples of patrol strategies, a small team on a small graph, and of the navigator."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from benchmarks.graph_patrol import GraphPatrol, Radio, patrol

from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop
from pilotage.experiments.mission import mission_of
from pilotage.stack.interface import StackStatus
from pilotage.stack.patrol.graph import PatrolGraph
from support.missions import MISSIONS

STRATEGY_NUMBERS: dict[str, frozenset[str]] = {
    **dict.fromkeys(
        ("conscientious-reactive", "heuristic-conscientious", "cyclic", "msp-partition"), frozenset()
    ),
    **dict.fromkeys(("greedy-bayesian", "sebs"), frozenset({"probability_at_zero"})),
    **dict.fromkeys(("cbls", "dtag", "dtap"), frozenset()),
    "adaptive-rounds": frozenset(
        {
            "by_chance",
            "mean_weights",
            "most_slack",
            "sharing_cost",
            "forecast_mean_weight",
            "alike",
            "forecast_sharing_cost",
            "slack",
        }
    ),
}
"""Every strategy, with its parameters that are pure numbers."""


def lattice(columns: int = 4, rows: int = 3, side_m: float = 2.0) -> PatrolGraph:
    """Vertices in rows and columns, edges between neighbours, and a dead end."""
    places = [(side_m * c, side_m * r) for r in range(rows) for c in range(columns)] + [(-3.0 * side_m, 0.0)]
    xy = np.array(places)
    apart = np.hypot(*(xy[:, None] - xy[None]).transpose(2, 0, 1))
    edges = np.where(apart <= side_m + 1e-9, apart, math.inf)
    edges[0, -1] = edges[-1, 0] = 3.0 * side_m
    return PatrolGraph.of(xy, edges)


def navigator_patrols(factory: Any, config: Any) -> None:
    """Two in one room visit its vertices by turns and keep clear of each other."""
    values = {**MISSIONS["patrol"]}
    values["stack"] = {**values["stack"], "navigator": {"name": "patrol", **config.model_dump(mode="json")}}
    experiment = build(mission_of(values))
    assert all(type(member.stack) is factory for member in experiment.team)
    finished = run_loop(experiment).finished
    metrics = experiment.task.judge(finished).metrics
    assert metrics["collisions"] == 0
    assert all(robot.driven_m > 3.0 for robot in finished.robots)
    assert all(robot.status is StackStatus.RUNNING for robot in finished.robots)


def strategy_patrols(factory: Any, config: Any) -> None:
    """Alone and in a team it comes to every vertex again and again, twice the same; with a deaf radio too."""
    graph = lattice()
    for team, radio in ((1, Radio()), (3, Radio()), (3, Radio(range_m=0.0))):
        trial = GraphPatrol(graph, np.arange(team), 1500.0, 0.5, radio=radio)
        visits, again = (patrol(trial, lambda setting: factory(config, setting), 4) for _ in range(2))
        assert np.array_equal(visits.times_s, again.times_s)
        assert np.array_equal(visits.vertices, again.vertices)
        late = visits.vertices[visits.times_s > 500.0]
        assert set(late.tolist()) == set(range(len(graph)))
