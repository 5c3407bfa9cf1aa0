"""Shortest paths on a large grid beside tcod, pyastar2d and scikit-image, as ratios with their bars.

    python -m benchmarks.grid_peers [--json] [--repeats 5] [--without-scikit-image]

The hazards of the crater terrain, 4500 x 3000 cells, from P1 to P2 of the rover's second task; every side
searches the same cells with steps of 1 and sqrt(2) and may cut corners, as the peers always do. pilotage's
time is that of a whole query on a new map, from the mask to the path: copy with a frame, connected
components, bits, search. The peers' arrays of costs are made beforehand and not counted. Sides take turns
(A B C A B C ...) and medians are compared. scikit-image is asked once.

Exit code 0 where every bar is cleared, 1 where not, a peer that is not installed included.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from pilotage.core.types import BoolArray
from pilotage.maps.crater_terrain import CraterTerrainConfig, crater_terrain
from pilotage.stack.planning.grid_space import Cell, GridSpace

P1_M, P2_M = (33_070.0, 19_010.0), (10_870.0, 25_670.0)
BARS = {"tcod": 5.0, "pyastar2d": 1.5, "scikit-image": 50.0}

Solve = Callable[[], Any]
"""Finds a path: (N, 2) row, column."""


@dataclass(frozen=True, slots=True)
class Row:
    """One peer: medians in milliseconds, lengths in cells, how many times faster pilotage is."""

    peer: str
    ours_ms: float
    theirs_ms: float | None
    ratio: float | None
    bar: float
    passed: bool
    our_cells: float
    their_cells: float | None
    note: str


def _tcod(blocked: BoolArray, start: Cell, goal: Cell) -> Solve:
    """Whole numbers 70 and 99 for the steps: the best pair whose costs fit its type on this map."""
    import tcod.path

    cost = (~blocked).astype(np.int8)

    def solve() -> Any:
        finder = tcod.path.Pathfinder(tcod.path.SimpleGraph(cost=cost, cardinal=70, diagonal=99))
        finder.add_root(start)
        return finder.path_to(goal)

    return solve


def _pyastar2d(blocked: BoolArray, start: Cell, goal: Cell) -> Solve:
    """It prices a diagonal step as a straight one, so its paths are longer."""
    import pyastar2d

    weights = np.where(blocked, np.inf, 1.0).astype(np.float32)
    return lambda: pyastar2d.astar_path(weights, start, goal, allow_diagonal=True)


def _scikit_image(blocked: BoolArray, start: Cell, goal: Cell) -> Solve:
    """Dijkstra with geometric costs; negative cells cannot be entered."""
    from skimage import graph

    find: Any = graph.route_through_array  # untyped in some of its versions

    cost = np.where(blocked, -1.0, 1.0)
    return lambda: find(cost, start, goal, fully_connected=True, geometric=True)[0]


PEERS: dict[str, Callable[[BoolArray, Cell, Cell], Solve]] = {
    "tcod": _tcod,
    "pyastar2d": _pyastar2d,
    "scikit-image": _scikit_image,
}


def _timed(solve: Solve) -> tuple[float, float]:
    """Milliseconds and length in cells."""
    began = time.perf_counter()
    path = np.asarray(solve())
    took_ms = (time.perf_counter() - began) * 1e3
    return took_ms, math.fsum(np.hypot(*np.diff(path, axis=0).T).tolist())


def compare(repeats: int, without: Sequence[str]) -> list[Row]:
    """Measure every peer that is installed."""
    hazards = crater_terrain(CraterTerrainConfig()).hazards
    blocked, start, goal = hazards.blocked(), hazards.cell_at(*P1_M), hazards.cell_at(*P2_M)

    def ours() -> Any:
        path = GridSpace(blocked).shortest(start, goal, cut_corners=True)
        assert path is not None
        return path.cells

    ours()
    solves: dict[str, Solve] = {}
    for name, make in PEERS.items():
        if name not in without:
            try:
                solves[name] = make(blocked, start, goal)
            except ImportError:
                continue
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in ("pilotage", *solves)}
    for turn in range(repeats):
        times["pilotage"].append(_timed(ours))
        for name, solve in solves.items():
            if name != "scikit-image" or turn == 0:
                times[name].append(_timed(solve))
    own_ms, own_cells = (statistics.median(part) for part in zip(*times["pilotage"], strict=True))
    rows = []
    for name, bar in BARS.items():
        if name in without:
            continue
        if name not in solves:
            rows.append(Row(name, own_ms, None, None, bar, False, own_cells, None, "not installed"))
            continue
        ms, cells = (statistics.median(part) for part in zip(*times[name], strict=True))
        longer = f"its path is {100.0 * (cells / own_cells - 1.0):.2f} % longer"
        passed = ms / own_ms >= bar and cells >= own_cells - 1e-6
        rows.append(Row(name, own_ms, ms, ms / own_ms, bar, passed, own_cells, cells, longer))
    return rows


def _table(rows: Sequence[Row]) -> Table:
    table = Table(title="shortest path on 4500 x 3000 cells, medians of interleaved repeats")
    for heading in ("peer", "pilotage ms", "peer ms", "ratio", "bar", "", "note"):
        table.add_column(heading, justify="left" if heading in ("peer", "note") else "right")
    for row in rows:
        peer_ms = "-" if row.theirs_ms is None else f"{row.theirs_ms:,.0f}"
        ratio = "-" if row.ratio is None else f"{row.ratio:.1f}"
        verdict = "yes" if row.passed else "NO"
        table.add_row(row.peer, f"{row.ours_ms:,.0f}", peer_ms, ratio, f">= {row.bar:g}", verdict, row.note)
    return table


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print the table, tell by the exit code whether every bar is cleared."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", action="store_true", help="one JSON object instead of the table")
    parser.add_argument("--repeats", type=int, default=5, help="turns of every side")
    parser.add_argument(
        "--without-scikit-image", action="store_true", help="leave out the slowest peer (half a minute)"
    )
    options = parser.parse_args(arguments)
    if options.repeats < 1:
        parser.error("expected at least one repeat")
    rows = compare(options.repeats, ["scikit-image"] if options.without_scikit_image else [])
    if options.json:
        print(json.dumps({"rows": [asdict(row) for row in rows]}))
    else:
        Console().print(_table(rows))
    return 0 if all(row.passed for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
