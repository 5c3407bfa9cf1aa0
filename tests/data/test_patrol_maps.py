"""The literature's patrol graphs on their maps; the best tours are held against an integer program."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray
from pilotage.experiments.build.build import build_source
from pilotage.experiments.build.charts import load_chart
from pilotage.experiments.mission import load_mission
from pilotage.maps.floor import Floor
from pilotage.missions.mission import Mission
from pilotage.stack.patrol.graph_file import on_floor, read_patrol_graph
from pilotage.stack.patrol.tours import Round
from support.recordings import recording


def optimal_tour_m(lengths: FloatArray) -> float:
    """Exact, by the cuts of Dantzig, Fulkerson and Johnson: no set of places keeps to itself."""
    count = len(lengths)
    a, b = np.triu_indices(count, 1)
    at = coo_array((np.ones(2 * len(a)), (np.r_[a, b], np.r_[range(len(a)), range(len(a))])), (count, len(a)))
    rules = [LinearConstraint(at.tocsr(), 2.0, 2.0)]
    for _ in range(60):
        found = milp(
            lengths[a, b],
            constraints=rules,
            integrality=np.ones(len(a), dtype=np.int64),
            bounds=Bounds(0.0, 1.0),
        )
        assert found.x is not None
        used: BoolArray = np.asarray(found.x > 0.5)
        graph = coo_array((np.ones(used.sum()), (a[used], b[used])), (count, count))
        pieces, piece = connected_components(graph, directed=False)
        if pieces == 1:
            return float(lengths[a, b][used].sum())
        rules += [
            LinearConstraint(((piece[a] == k) != (piece[b] == k)).astype(float)[None, :], 2.0, np.inf)
            for k in range(pieces)
        ]
    raise AssertionError("the cuts did not come to an end")


@pytest.mark.parametrize(("name", "vertices"), [("cumberland", 40), ("grid", 25), ("example", 29)])
def test_given_graphs_lie_on_their_floors_and_have_the_best_tour(name: str, vertices: int) -> None:
    graph = read_patrol_graph(recording(f"patrol/{name}.graph"))
    world = load_chart(str(recording(f"patrol/{name}.yaml")))
    assert len(graph) == vertices
    start = graph.vertices_xy_m[0]
    driven = on_floor(graph, Floor.of(world, 0.25, inside_xy_m=(float(start[0]), float(start[1]))))
    for each in (graph, driven):
        assert Round.best(each).length_m <= 1.01 * optimal_tour_m(each.shortest_m)


def test_teams_start_on_the_floor_of_their_patrol_and_too_many_are_refused() -> None:
    """Between cells of 0.05 and 0.1 m passages differ: a start that was drawn had none to the graph."""
    house = ["world.map=" + str(recording("ros_maps/turtlebot3_house.yaml")), "team.size=16"]
    mission = build_source(
        load_mission("museum-patrol", [*house, "robot.footprint.radius_m=0.25"], seed=0)
    ).mission
    floor = Floor.of(
        load_chart(str(recording("ros_maps/turtlebot3_house.yaml"))), 0.35, inside_xy_m=_start(mission, 0)
    )
    for index in range(16):
        floor.nearest_cell(np.array(_start(mission, index)))
    with pytest.raises(InputError, match=r"team\.size: expected at most \d+, for") as caught:
        build_source(load_mission("museum-patrol", house, seed=0))
    assert "\n" not in str(caught.value)
    # How many is by lot; with all of its rooms no fewer than these.
    assert 11 <= int(str(caught.value).split("at most ")[1].split(",")[0]) < 16


def _start(mission: Mission, index: int) -> tuple[float, float]:
    start = mission.start_of(mission.members[index])
    assert start is not None
    return start.x_m, start.y_m
