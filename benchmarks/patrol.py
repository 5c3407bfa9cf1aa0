"""Patrol strategies against one another on the graph alone: idleness, radio, failures.

python -m benchmarks.patrol --seeds 12 [--floors cumberland museum MAP.yaml ...] [--teams 2 4 8]
[--what compare radio failure]

Floors are the literature's given graphs (``../shared/data/patrol``, edges as long as the paths on their
maps), graphs derived from other maps, and any other map, with the ``.graph`` beside it if there is one.
Trials of one seed share starts, paces and luck on the way. Idleness is in units of the bound, the best tour
over the robots' summed speed, after the first third of the time. Differences: Wilcoxon's signed-rank test on
seeds, corrected over all rivals by Holm.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.graph_patrol import GraphPatrol, Radio, patrol, spread_starts
from pilotage.core.types import FloatArray
from pilotage.evaluation.idleness import idleness
from pilotage.evaluation.paired import difference
from pilotage.experiments.build.charts import load_chart
from pilotage.maps.floor import Floor
from pilotage.stack.patrol.derive import derive_graph
from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.graph_file import on_floor, read_patrol_graph
from pilotage.stack.patrol.strategy import STRATEGIES, PatrolSetting, Strategy
from pilotage.stack.patrol.tours import Round, idleness_bound_s

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
OURS, OFF_LINE = "adaptive-rounds", ("cyclic", "msp-partition")
SPEED_M_S, ROUNDS, LEAST_S = 0.5, 24.0, 1800.0
POOR = Radio(range_m=10.0, loss=0.3, delay_s=1.0)
GIVEN = ("cumberland", "grid", "example")
DERIVED: dict[str, tuple[str, float, tuple[float, float] | None]] = {
    "museum": ("museum", 0.25, None),
    "house": ("ros_maps/turtlebot3_house.yaml", 0.15, (-6.0, 1.0)),
    "warehouse": ("ros_maps/warehouse.yaml", 0.3, None),
}
"""Map, radius of the robot, and a place inside."""


def floor_graph(name: str) -> PatrolGraph:
    """A given graph on its floor, one derived from a map, or by ``random-K`` places in a square by lot."""
    source = DATA / f"patrol/{name}.yaml" if name in GIVEN else Path(name)
    if source.suffix == ".yaml":
        world, file = load_chart(str(source)), source.with_suffix(".graph")
        if not file.exists():
            return derive_graph(world, Floor.of(world, 0.25)).graph
        graph = read_patrol_graph(file)
        x, y = graph.vertices_xy_m[0].tolist()
        return on_floor(graph, Floor.of(world, 0.25, inside_xy_m=(x, y)))
    if name.startswith("random-"):
        return random_graph(int(name.removeprefix("random-")))
    place, radius_m, inside = DERIVED[name]
    world = load_chart(place if place == "museum" else str(DATA / place))
    return derive_graph(world, Floor.of(world, radius_m, inside_xy_m=inside)).graph


def random_graph(seed: int) -> PatrolGraph:
    """The shortest spanning tree of 20 to 45 places, with half as many further short edges."""
    from scipy.sparse.csgraph import minimum_spanning_tree

    rng = np.random.default_rng([71, seed])
    count = int(rng.integers(20, 46))
    xy = rng.uniform(0.0, 40.0, (count, 2))
    away = np.hypot(*(xy[:, None] - xy[None]).transpose(2, 0, 1)) * rng.uniform(1.0, 1.3)
    tree = minimum_spanning_tree(away).toarray()
    edges = np.where((tree > 0.0) | (tree.T > 0.0), away, np.inf)
    a, b = np.triu_indices(count, 1)
    for k in np.argsort(away[a, b])[: 2 * count]:
        if rng.random() < 0.4:
            edges[a[k], b[k]] = edges[b[k], a[k]] = away[a[k], b[k]]
    return PatrolGraph.of(xy, edges)


def judged(graph: PatrolGraph, name: str, team: int, seeds: int, trial: GraphPatrol) -> FloatArray:
    """(seeds, 3) mean, worst and standard deviation of idleness in units of the bound."""
    builder = builder_of(name)
    bound_s = idleness_bound_s(graph, team, SPEED_M_S)
    rows = []
    for seed in range(seeds):
        starts = spread_starts(graph, team, np.random.default_rng([3, seed]))
        visits = patrol(replace(trial, starts=starts), builder, seed)
        found = idleness(
            visits.vertices, visits.times_s, len(graph), trial.duration_s, warm_s=trial.duration_s / 3.0
        )
        rows.append([found.mean_s / bound_s, found.worst_s / bound_s, found.std_s / bound_s])
    return np.array(rows)


def builder_of(name: str) -> Callable[[PatrolSetting], Strategy]:
    """Makes a strategy with its usual parameters."""
    entry = STRATEGIES.entry(name)
    config = entry.config()

    def build(setting: PatrolSetting) -> Strategy:
        return entry.factory(config, setting)

    return build


def holm(p_values: Iterable[float]) -> list[float]:
    """P-values corrected for being many (Holm 1979)."""
    p = np.array(list(p_values))
    order = np.argsort(p)
    stepped = np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1))
    out = np.empty(len(p))
    out[order] = np.minimum(1.0, stepped)
    return [float(value) for value in out]


def trial_for(graph: PatrolGraph, team: int, **changes: object) -> GraphPatrol:
    """Long enough for many rounds."""
    duration_s = max(LEAST_S, ROUNDS * idleness_bound_s(graph, team, SPEED_M_S))
    trial = GraphPatrol(graph, np.zeros(team, dtype=np.int64), duration_s, SPEED_M_S)
    return replace(trial, **changes)  # type: ignore[arg-type]


def compare(floor: str, graph: PatrolGraph, team: int, seeds: int, names: list[str]) -> dict[str, object]:
    """All strategies on one floor with one team; prints a table."""
    found = {name: judged(graph, name, team, seeds, trial_for(graph, team)) for name in names}
    ours = found[OURS]
    rivals = [name for name in names if name != OURS]
    p: dict[tuple[str, int], float] = {}
    for name in rivals:
        for column in (0, 1):
            change = difference(ours[:, column], found[name][:, column])
            p[name, column] = 1.0 if np.isnan(change.p_value) else change.p_value
    p = dict(zip(p, holm(p.values()), strict=True))
    print(f"\n{floor}, {len(graph)} vertices, {team} robots, {seeds} seeds: mean, worst, std in bounds")
    for name in sorted(names, key=lambda name: float(found[name][:, 1].mean())):
        mean, worst, std = found[name].mean(axis=0)
        told = "" if name == OURS else f"  p mean {p[name, 0]:.4f} worst {p[name, 1]:.4f}"
        print(f"  {name:26s}{mean:6.2f}{worst:7.2f}{std:7.2f}{told}", flush=True)
    surely_below = [
        name
        for name in rivals
        if name not in OFF_LINE
        and all(p[name, c] < 0.05 and ours[:, c].mean() < found[name][:, c].mean() for c in (0, 1))
    ]
    on_line = [name for name in rivals if name not in OFF_LINE]
    above = []
    for column, what in ((0, "mean"), (1, "worst")):
        best = OFF_LINE[int(np.argmin([found[name][:, column].mean() for name in OFF_LINE]))]
        if p[best, column] < 0.05 and ours[:, column].mean() > found[best][:, column].mean():
            above.append(f"{what} above {best}")
    missed = sorted(set(on_line) - set(surely_below))
    print(f"  surely below {len(surely_below)} of {len(on_line)} on-line strategies", end="")
    print(f"; not: {', '.join(missed)}" if missed else "", f"; {above}" if above else "")
    return {"floor": floor, "team": team, "found": {k: v.mean(axis=0).tolist() for k, v in found.items()}}


def radio(floor: str, graph: PatrolGraph, team: int, seeds: int) -> None:
    """What a poor radio and none cost."""
    row = {}
    for word, kind in (("full", Radio()), ("poor", POOR), ("none", Radio(range_m=0.0))):
        row[word] = judged(graph, OURS, team, seeds, trial_for(graph, team, radio=kind)).mean(axis=0)
    grows = row["poor"][0] / row["full"][0] - 1.0
    told = "  ".join(f"{word} {mean:.3f}/{worst:.2f}" for word, (mean, worst, _) in row.items())
    print(
        f"{floor:12s}{team} robots, mean/worst by radio: {told}  poor costs {100.0 * grows:+.1f} %",
        flush=True,
    )


def failure(floor: str, graph: PatrolGraph, seeds: int) -> None:
    """One of four stops for good: worst idleness from two tours later on, in bounds for three."""
    lap_s = Round.best(graph).length_m / SPEED_M_S
    bound_s = idleness_bound_s(graph, 3, SPEED_M_S)
    builder = builder_of(OURS)
    worst = {2.0: [], 2.0 / 3.0: []}  # type: dict[float, list[float]]
    for seed in range(seeds):
        starts = spread_starts(graph, 4, np.random.default_rng([3, seed]))
        trial = GraphPatrol(graph, starts, 8.0 * lap_s, SPEED_M_S, failures=((seed % 4, 3.0 * lap_s),))
        visits = patrol(trial, builder, seed)
        for tours in worst:
            from_s = (3.0 + tours) * lap_s
            found = idleness(visits.vertices, visits.times_s, len(graph), 8.0 * lap_s, warm_s=from_s)
            worst[tours].append(found.worst_s / bound_s)
    told = "; ".join(
        f"{tours:.2f} L/v later median {np.median(values):.2f}, largest {max(values):.2f}, "
        f"{np.count_nonzero(np.array(values) <= 1.25)} of {seeds} within 1.25"
        for tours, values in worst.items()
    )
    print(f"{floor:12s}1 of 4 fails, worst over the bound for 3: {told}", flush=True)


def main() -> None:
    """Compare, print, and write what was found."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--floors", nargs="+", default=[*GIVEN, *DERIVED])
    parser.add_argument("--teams", type=int, nargs="+", default=[2, 4, 8])
    parser.add_argument("--seeds", type=int, default=12)
    parser.add_argument("--strategies", nargs="+", default=STRATEGIES.names())
    parser.add_argument("--what", nargs="+", default=["compare", "radio", "failure"])
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    found = []
    began = time.time()
    for floor in args.floors:
        graph = floor_graph(floor)
        for team in args.teams:
            if "compare" in args.what:
                found.append(compare(floor, graph, team, args.seeds, args.strategies))
            if "radio" in args.what:
                radio(floor, graph, team, args.seeds)
        if "failure" in args.what:
            failure(floor, graph, args.seeds)
    print(f"took {time.time() - began:.0f} s")
    if args.json is not None:
        args.json.write_text(json.dumps(found))


if __name__ == "__main__":
    main()
