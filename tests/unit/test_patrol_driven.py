"""Strategies plan on lengths that the robots drive: gaps that these do not enter are on no way of theirs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pilotage.experiments.build.build import build
from pilotage.experiments.mission import mission_of, read_mission
from pilotage.stack.patrol.driven import as_driven, driven_m


def two_rooms(near_m: float) -> dict[str, Any]:
    """Two rooms, 8 m deep, with a door of some width at the bottom and one of 1.2 m at the top."""
    low, high = 1.0 - 0.5 * near_m, 1.0 + 0.5 * near_m
    walls: list[list[float]] = [[0, 0, 8, 0], [8, 0, 8, 8], [8, 8, 0, 8], [0, 8, 0, 0]]
    walls += [[4, 0, 4, low], [4, high, 4, 6.4], [4, 7.6, 4, 8]]
    values = read_mission("museum-patrol")
    values["world"] = {"map": {"map": "two rooms", "bounds_m": [0, 0, 8, 8], "walls_m": walls}}
    values["task"] = {"name": "patrol", "duration_s": 60.0, "derive": {"reach_m": 3.0}}
    values["team"] = {"size": 2, "strategy": "adaptive-rounds", "radio": {}, "spacing_m": 0.9}
    values["run"]["time_limit_s"] = 60.0
    return values


@pytest.mark.parametrize(("near_m", "longer"), [(0.72, True), (1.2, False)])
def test_an_edge_through_a_gap_that_nobody_enters_is_as_long_as_the_way_around(
    near_m: float, *, longer: bool
) -> None:
    """The best tour led twice through 0.73 m: with four robots 2.4 times the bound, 1.1 with this."""
    experiment = build(mission_of(two_rooms(near_m), seed=1))
    site: Any = experiment.task.patrol  # type: ignore[attr-defined]
    stack: Any = experiment.team[0].stack
    context = stack._context
    published, own = site.graph, context.task.graph
    assert (own is published) is not longer
    assert context.task.strategy._setting.graph is own
    x, y = published.vertices_xy_m.T
    apart = (
        (x[:, None] < 4.0) & (x > 4.0) & (np.maximum(y[:, None], y) < 3.0) & np.isfinite(published.edges_m)
    )
    assert apart.any()
    if longer:
        assert (own.edges_m[apart] > published.edges_m[apart] + 4.0).all()
        assert all(
            edge not in context.task.strategy._setting.passages.stretches
            for edge in zip(*np.nonzero(apart), strict=True)
        )
    same = ~(own.edges_m > published.edges_m)
    assert np.array_equal(own.edges_m[same], published.edges_m[same])


def test_a_team_plans_on_what_is_long_for_one_of_it() -> None:
    experiment = build(mission_of(two_rooms(0.72), seed=1))
    site: Any = experiment.task.patrol  # type: ignore[attr-defined]
    stack: Any = experiment.team[0].stack
    roadmap = stack._context.roadmap
    graph, passages = as_driven(site.graph, site.passages, [])
    assert graph is site.graph
    assert passages is site.passages
    graph, _ = as_driven(site.graph, site.passages, [roadmap])
    assert np.array_equal(graph.edges_m, driven_m(roadmap, site.graph))
