"""pilotage beside its peers, measured in the same run: a table of ratios, each with its bar.

    python -m benchmarks.peers [--json] [--repeats 3] [--ompl-limit 3]

Three comparisons on the museum of the night watch: the first Dubins path against OMPL's RRT*, LiDAR scans
and closed-loop steps against IR-SIM. Each is warmed up and compiled first, then both sides take turns
(A B A B ...) and the medians are compared, so that what else the machine does hits both alike. How each peer
is set up, and kept fair, is told in ``peer_ompl`` and ``peer_irsim``.

Rows with a bar are the claims. Rows without one show how far the comparison reaches: pilotage without the
guide that steers its samples. Two easy queries, which OMPL answers at once, have a bar of 1.

Exit code 0 where every bar is cleared, 1 where not, a peer that is not installed included.
"""

from __future__ import annotations

import argparse
import json
import math
import platform
import statistics
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.museum import (
    CELL_M,
    CLEARANCE_M,
    CONNECTION_M,
    CONTROLS,
    GOAL_TOLERANCE_M,
    LATER_S,
    PATROLS,
    TURNING_RADIUS_M,
    VALIDATION_M,
    Attempt,
    Museum,
    Query,
)
from benchmarks.peer_irsim import IrsimPeer
from benchmarks.peer_ompl import OmplPeer
from pilotage import __version__
from pilotage.sensors.lidar import LidarConfig

FIRST, SCANS, STEPS = "first Dubins path", "LiDAR scans", "closed-loop steps"
CELL_SCANS, LIKE_STEPS = "LiDAR scans on a grid map", "closed-loop steps, scan and control alone"
SIMULATION = "simulation"
PACKAGES = ("ompl", "ir-sim", "numpy", "numba", "shapely")
FIRST_BAR, EASY_BAR, LENGTH_BAR, SCAN_BAR, LOOP_BAR, CELL_BAR = 20.0, 1.0, 1.0, 50.0, 25.0, 15.0
SEEDS_A_TURN = 5
"""pilotage plans this often in its turn: it is done in milliseconds."""

SCAN_TURNS, CELL_TURNS, LOOP_TURNS = 41, 7, 7
AS_GOOD_AS_EQUAL_M = 1e-6
FILE_WIDTH = 150


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table.

    Attributes
    ----------
    subject, what
        What is worked on and what is measured.
    ours, theirs
        Medians in ``unit``; None where there is none, ``note`` says why.
    ratio
        How many times better pilotage is; with ``at_least`` only a lower bound is known, because the peer
        had not finished when its time was over.
    bar
        Least ratio that is claimed; None where nothing is.
    passed
        Whether the bar is cleared; None where there is none.
    """

    subject: str
    what: str
    unit: str
    ours: float | None
    theirs: float | None
    ratio: float | None
    at_least: bool = False
    bar: float | None = None
    passed: bool | None = None
    note: str = ""


@dataclass(frozen=True, slots=True)
class Comparison:
    """Rows against one peer, and what must be known to read them."""

    rows: list[Row]
    notes: list[str]


def _row(
    subject: str,
    what: str,
    unit: str,
    ours: float | None,
    theirs: float | None,
    ratio: float | None,
    bar: float | None,
    at_least: bool = False,
    note: str = "",
) -> Row:
    passed = None if bar is None else ratio is not None and ratio >= bar
    return Row(subject, what, unit, ours, theirs, ratio, at_least, bar, passed, note)


def _missing(claims: Sequence[tuple[str, str, str, float]], peer: str) -> Comparison:
    """What stands in the table where a peer is not installed: subject, what, unit and bar of its claims."""
    note = f"{peer} not installed"
    rows = [
        _row(subject, what, unit, None, None, None, bar, note=note) for subject, what, unit, bar in claims
    ]
    return Comparison(rows, [])


# The first Dubins path


@dataclass(frozen=True, slots=True)
class Turns:
    """All attempts of both sides on one query."""

    ours: list[Attempt]
    theirs: list[Attempt]


def compare_planning(museum: Museum, repeats: int, limit_s: float) -> Comparison:
    """Time to the first Dubins path and the lengths of paths, against OMPL's RRT*."""
    try:
        ompl = OmplPeer(museum)
    except ImportError:
        return _missing([(query.name, FIRST, "ms", FIRST_BAR) for query in PATROLS], "OMPL")
    own_m = ompl.own_range_m(PATROLS[0])
    _warm_up(museum, own_m)
    rows: list[Row] = []
    every = Turns([], [])
    for query in (*PATROLS, *CONTROLS):
        first_bar, length_bar = (FIRST_BAR, LENGTH_BAR) if query in PATROLS else (EASY_BAR, None)
        for connection_m in (CONNECTION_M, own_m):
            turns = _take_turns(museum, ompl, query, connection_m, repeats, limit_s)
            lengths = [attempt.first_m for attempt in turns.ours]
            subject = f"{query.name}, connections {connection_m:.3g} m"
            rows.append(_first_row(subject, FIRST, turns, limit_s, first_bar))
            what = f"its length, OMPL's after {LATER_S:g} s"
            rows.append(_length_row(subject, what, lengths, turns.theirs, length_bar))
            every.ours.extend(turns.ours)
            every.theirs.extend(turns.theirs)
            if connection_m != CONNECTION_M:
                continue
            later = [museum.plan_on(query, seed) for seed in range(repeats)]
            lengths = [attempt.later_m for attempt in later]
            what = f"length, both after {LATER_S:g} s"
            rows.append(_length_row(subject, what, lengths, turns.theirs, length_bar))
            plain = [museum.plan_first(query, seed, guided=False) for seed in range(SEEDS_A_TURN)]
            unguided = Turns(plain, turns.theirs)
            rows.append(_first_row(subject, "first path without guide", unguided, limit_s, None))
            every.ours.extend([*plain, *later])
    return Comparison(rows, _planning_notes(museum, ompl, every, limit_s))


def _warm_up(museum: Museum, own_m: float) -> None:
    query = CONTROLS[0]
    for guided in (True, False):
        museum.plan_first(query, 0, CONNECTION_M, guided)
        museum.plan_first(query, 0, own_m, guided)
    museum.plan_on(query, 0)


def _take_turns(
    museum: Museum, ompl: OmplPeer, query: Query, connection_m: float, repeats: int, limit_s: float
) -> Turns:
    turns = Turns([], [])
    for turn in range(repeats):
        seeds = range(turn * SEEDS_A_TURN, (turn + 1) * SEEDS_A_TURN)
        turns.ours.extend(museum.plan_first(query, seed, connection_m) for seed in seeds)
        turns.theirs.append(ompl.solve(query, connection_m, limit_s))
    return turns


def _median(values: Sequence[float | None]) -> float:
    """Median with None as infinity: what was not found takes longest."""
    return statistics.median_high([math.inf if value is None else value for value in values])


def _first_row(subject: str, what: str, turns: Turns, limit_s: float, bar: float | None) -> Row:
    ours = _median([attempt.first_s for attempt in turns.ours])
    theirs = _median([attempt.first_s for attempt in turns.theirs])
    in_time = sum(attempt.first_s is not None for attempt in turns.theirs)
    note = f"OMPL found {in_time} of {len(turns.theirs)}"
    if not math.isfinite(ours):
        return _row(subject, what, "ms", None, None, None, bar, note="pilotage found none")
    if not math.isfinite(theirs):
        return _row(subject, what, "ms", 1e3 * ours, None, limit_s / ours, bar, at_least=True, note=note)
    return _row(subject, what, "ms", 1e3 * ours, 1e3 * theirs, theirs / ours, bar, note=note)


def _length_row(
    subject: str, what: str, lengths_m: list[float | None], theirs: list[Attempt], bar: float | None
) -> Row:
    """OMPL's length over ours; a peer without a path by then has none that could be shorter."""
    ours, other = _median(lengths_m), _median([attempt.later_m for attempt in theirs])
    if not math.isfinite(ours):
        return _row(subject, what, "m", None, None, None, bar, note="pilotage found none")
    if not math.isfinite(other):
        note = f"OMPL has none after {LATER_S:g} s"
        return Row(subject, what, "m", ours, None, None, False, bar, None if bar is None else True, note)
    return _row(subject, what, "m", ours, other, other / ours, bar)


def _planning_notes(museum: Museum, ompl: OmplPeer, every: Turns, limit_s: float) -> list[str]:
    own_m = ompl.own_range_m(PATROLS[0])
    shares = [
        f"{100.0 * max(ompl.check_share(query, length_m) for query in queries):.0f} % {where} with "
        f"connections of {length_m:.3g} m"
        for where, queries in (("on the patrols", PATROLS), ("on the easy queries", CONTROLS))
        for length_m in (CONNECTION_M, own_m)
    ]
    ny, nx = museum.field.distance_m.shape
    notes = [
        f"planning: {len(museum.floor.walls.segments_m)} walls, clearance {CLEARANCE_M:g} m, turning radius "
        f"{TURNING_RADIUS_M:g} m, checks {VALIDATION_M:g} m apart, connections up to {CONNECTION_M:g} m or "
        "to what OMPL chooses, for both sides; "
        f"pilotage on a field of {nx} x {ny} nodes, ending at the goal itself; OMPL in a region of "
        f"{GOAL_TOLERANCE_M:g} m around it, given up after {limit_s:g} s",
        f"OMPL's state checks, in Python, take at most these shares of its time: {', '.join(shares)}",
    ]
    for name, attempts in (("pilotage", every.ours), ("OMPL", every.theirs)):
        paths = sum(len(attempt.clearance_m) for attempt in attempts)
        bad = sum(attempt.invalid for attempt in attempts)
        nearest = min((c for attempt in attempts for c in attempt.clearance_m), default=math.nan)
        notes.append(
            f"{name}'s paths checked every centimetre: {bad} of {paths} come too near to a wall "
            f"(the nearest {nearest:.3f} m)"
        )
    return notes


# Scans and closed loop


def compare_simulation(museum: Museum) -> Comparison:
    """LiDAR scans and closed-loop steps a second, against IR-SIM."""
    try:
        irsim = IrsimPeer(museum)
    except ImportError:
        bars = {SCANS: SCAN_BAR, CELL_SCANS: CELL_BAR, STEPS: LOOP_BAR, LIKE_STEPS: LOOP_BAR}
        return _missing([(SIMULATION, what, "1/s", bar) for what, bar in bars.items()], "IR-SIM")
    rows = [
        *(_scan_row(museum, irsim, on_grid) for on_grid in (False, True)),
        *(_loop_row(museum, irsim, alike) for alike in (False, True)),
    ]
    apart_m = np.abs(museum.exact_ranges() - irsim.exact_ranges()).max()
    cells_apart_m = np.abs(museum.exact_ranges(on_grid=True) - irsim.exact_ranges(on_grid=True))
    other = cells_apart_m > AS_GOOD_AS_EQUAL_M
    scanner = LidarConfig()
    notes = [
        f"scans: {scanner.beams} beams over {math.degrees(scanner.field_of_view_rad):g} degrees, "
        f"{scanner.max_range_m:g} m, at {len(museum.poses)} poses of the route; "
        f"without noise the two sides differ by {apart_m:.1g} m at most, "
        f"on cells of {CELL_M:g} m in {other.sum()} of {other.size} beams (along a row of cells' edges)",
        f"closed loop: {museum.route_length_m:.0f} m of programmed route, steps of "
        f"{museum.mission.run.dt_s:g} s; pilotage with all sensors and its whole stack, on its own estimate; "
        "IR-SIM with the scanner alone, dashing from corner to corner on the truth, like pilotage in the row "
        "of scan and control alone",
    ]
    return Comparison(rows, notes)


def _scan_row(museum: Museum, irsim: IrsimPeer, on_grid: bool) -> Row:
    scanner = museum.scanner(on_grid=on_grid)
    museum.scans_per_s(scanner)
    irsim.scans_per_s(on_grid=on_grid)
    ours, theirs = [], []
    for _ in range(CELL_TURNS if on_grid else SCAN_TURNS):
        ours.append(museum.scans_per_s(scanner))
        theirs.append(irsim.scans_per_s(on_grid=on_grid))
    return _rate_row(*((CELL_SCANS, ours, theirs, CELL_BAR) if on_grid else (SCANS, ours, theirs, SCAN_BAR)))


def _loop_row(museum: Museum, irsim: IrsimPeer, alike: bool) -> Row:
    steps, _ = museum.loop_steps(0, like_the_peer=alike)
    ours, theirs = [], []
    for turn in range(LOOP_TURNS):
        taken, took = museum.loop_steps(turn, like_the_peer=alike)
        ours.append(taken / took)
        taken, took = irsim.loop_steps(turn, steps)
        theirs.append(taken / took)
    return _rate_row(LIKE_STEPS if alike else STEPS, ours, theirs, LOOP_BAR)


def _rate_row(what: str, ours: list[float], theirs: list[float], bar: float | None) -> Row:
    ratios = [a / b for a, b in zip(ours, theirs, strict=True)]
    note = f"turn by turn {min(ratios):.0f} to {max(ratios):.0f}"
    a, b = statistics.median(ours), statistics.median(theirs)
    return _row(SIMULATION, what, "1/s", a, b, a / b, bar, note=note)


# The table


def _versions() -> dict[str, str]:
    found = {"python": platform.python_version(), "pilotage": __version__}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def _number(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:,.0f}" if value >= 1000.0 else f"{value:.3g}"


def _table(rows: Sequence[Row]) -> Table:
    table = Table(title="pilotage and its peers, medians of interleaved repeats")
    for heading in ("on", "what", "unit", "pilotage", "peer", "ratio", "bar", "", "note"):
        numeric = heading in ("pilotage", "peer", "ratio", "bar")
        table.add_column(heading, justify="right" if numeric else "left")
    subject = ""
    for row in rows:
        verdict = {None: "", True: "yes", False: "NO"}[row.passed]
        if row.subject != subject and subject:
            table.add_section()
        table.add_row(
            row.subject if row.subject != subject else "",
            row.what,
            row.unit,
            _number(row.ours),
            _number(row.theirs),
            (">= " if row.at_least else "") + _number(row.ratio),
            "" if row.bar is None else f">= {row.bar:g}",
            verdict,
            row.note,
        )
        subject = row.subject
    return table


def _report(rows: Sequence[Row], notes: Sequence[str], as_json: bool) -> None:
    versions = _versions()
    if as_json:
        print(json.dumps({"versions": versions, "rows": [asdict(r) for r in rows], "notes": list(notes)}))
        return
    console = Console()
    if not console.is_terminal:
        console.width = FILE_WIDTH
    console.print(_table(rows))
    for note in (*notes, ", ".join(f"{name} {number}" for name, number in versions.items())):
        console.print(f"- {note}", highlight=False)


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure everything, print the table and tell which bars are missed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", action="store_true", help="one JSON object instead of the table")
    parser.add_argument("--repeats", type=int, default=3, help="turns of each planner on each query")
    parser.add_argument("--ompl-limit", type=float, default=3.0, help="seconds that OMPL gets for a query")
    options = parser.parse_args(arguments)
    if options.repeats < 1 or not options.ompl_limit >= LATER_S:
        parser.error(f"expected at least one repeat and a limit of {LATER_S:g} s or more")
    museum = Museum()
    told = Console(stderr=True)
    comparisons: list[Callable[[], Comparison]] = [
        lambda: compare_simulation(museum),
        lambda: compare_planning(museum, options.repeats, options.ompl_limit),
    ]
    rows: list[Row] = []
    notes: list[str] = []
    for name, compare in zip(("simulation", "planning"), comparisons, strict=True):
        told.print(f"comparing {name} ...", highlight=False)
        comparison = compare()
        rows += comparison.rows
        notes += comparison.notes
    _report(rows, notes, options.json)
    missed = [row for row in rows if row.passed is False]
    for row in missed:
        told.print(f"bar missed: {row.subject}, {row.what} ({row.note})", highlight=False)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
