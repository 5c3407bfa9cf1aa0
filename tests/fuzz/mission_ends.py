# ruff: noqa: T201 - a command of its own, it prints
"""A mission's numbers at odd sizes, run with their pages: ``python -m fuzz.mission_ends``.

Well-formed and yet what nobody expects: each ends with numbers, or is refused before anything is left. Those
of components are those of ``fuzz.ends``.
"""

from __future__ import annotations

import argparse
import copy
import json
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from support.fuzz_targets.target import write_yaml
from support.missions import explore, patrol, reach
from support.outcome import Outcome, run

Values = dict[str, Any]
Place = tuple[str | int, ...]
SIZES = (0.0, -0.0, 1e-100, 1e-50, 1e-12, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e12, 1e15, -1e-100, -1e-6, -1e15)
COUNTS = (0, 1, 2, 3, 16, 17, 1000, 2**31, 2**62, -1)
WORDS = ("run", "mission.yaml", "--json", "--quiet", "--out", "out")
STEPS = 20
NOT_HERE = frozenset({"navigator", "localizer", "planner", "local_planner", "controller", "task"})


def bases() -> dict[str, Values]:
    """Healthy missions that hold every key of a world, a robot, a team and a run."""
    drawn, full, team, sheet = reach(), reach(), patrol(), explore()
    full["world"]["goal"] |= {"tolerance_m": 0.3, "theta_rad": 0.0, "tolerance_rad": 0.2}
    full["world"]["kidnaps"] = [{"at_s": 0.5, "clearance_m": 0.4}]
    full["world"]["obstacles"] = [
        {"kind": "box", "from_m": [3.0, 6.0], "to_m": [4.0, 6.0], "thickness_m": 0.3},
        {"kind": "circle", "centre_m": [3.0, 5.0], "radius_m": 0.3},
        {"kind": "across-path", "length_m": [0.5, 0.6], "thickness_m": 0.1, "along": [0.4, 0.6]},
    ]
    full["run"] = {"time_limit_s": 2.0, "settle_s": 1.0, "record_every_s": 0.0, "ellipse_probability": 0.95}
    drawn["world"] |= {"random_start": {"clearance_m": 0.4}, "random_goal": {"clearance_m": 0.4}}
    drawn["robot"]["footprint"] = {"points_m": [[0.3, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.3, -0.2]]}
    drawn["stack"]["planner"] = {"name": "rrt-star-dubins", "iterations": 500}
    team["team"] |= {
        "spacing_m": 1.5,
        "failures": [{"robot": 1, "at_s": 0.5, "for_s": 0.5, "kind": "radio"}],
        "battery": {"range_m": 50.0, "charge_s": 5.0, "reserve_m": 10.0},
        "starts": [{"x_m": 2.0, "y_m": 2.0, "theta_rad": 0.0}, {"x_m": 8.0, "y_m": 2.0}],
        "stations": [[2.0, 2.0], [8.0, 2.0]],
    }
    sheet["world"] = {
        "map": {
            **sheet["world"]["map"],
            "obstacles": [[0.05, 0.05, 0.1, 0.1]],
            "lines": [[[0.3, 0.3], [0.4, 0.3]]],
        },
        "markings": {"tape_width_m": 0.015},
    }
    rover: Values = {"extends": "gale-pose", "mission": "rover", "run": {"dt_s": 5.0}}
    heights = {"name": "elevation", "file": "heights.npy", "resolution_m": 1.0, "slope_limit_deg": 20.0}
    ends = {"start": {"x_m": 3.0, "y_m": 3.0}, "goal": {"x_m": 8.0, "y_m": 8.0, "theta_rad": 0.0}}
    found = {"full": full, "drawn": drawn, "team": team, "sheet": sheet}
    found["rover"] = {**rover, "world": {"map": {**heights, "origin": [0.0, 0.0, 0.0]}, **ends}}
    for values in found.values():
        values["run"]["time_limit_s"] = STEPS * values["run"].get("dt_s", 0.1)
    return copy.deepcopy(found)


def numbers(values: Any, place: Place = ()) -> Iterator[tuple[Place, float]]:
    """Where a mission's numbers stand; of a list's rows the first one's."""
    if isinstance(values, dict):
        for key, value in values.items():
            if key not in NOT_HERE and (key != "sensors" or not place):
                yield from numbers(value, (*place, key))
    elif isinstance(values, list):
        for index, value in enumerate(
            values[:1] if values and isinstance(values[0], list | dict) else values
        ):
            yield from numbers(value, (*place, index))
    elif isinstance(values, int | float) and not isinstance(values, bool):
        yield place, values


def cases() -> list[tuple[str, Values]]:
    """Every number at every size: what is changed, and the mission."""
    found = []
    for name, values in bases().items():
        for place, number in numbers(values):
            for size in COUNTS if isinstance(number, int) else SIZES:
                changed = copy.deepcopy(values)
                inner: Any = changed
                for key in place[:-1]:
                    inner = inner[key]
                inner[place[-1]] = size
                if place == ("run", "dt_s"):
                    changed["run"]["time_limit_s"] = STEPS * size
                found.append((f"{name}: {'.'.join(map(str, place))} = {size!r}", changed))
    return found


def faults(values: Values, folder: Path) -> tuple[Outcome, list[str]]:
    """Run one in a new folder; what broke."""
    folder.mkdir()
    np.save(folder / "heights.npy", np.add.outer(np.arange(12.0) / 10.0, np.zeros(16)))
    write_yaml(folder / "mission.yaml", values)
    outcome = run(WORDS, folder)
    found = outcome.faults()
    if outcome.code in (0, 1) and not found:
        try:
            told = json.loads(outcome.out, parse_constant=_no_number)
        except ValueError as error:
            return outcome, [f"standard output is no JSON: {error}"]
        if not (folder / told["run_dir"] / "report.html").is_file():
            found.append("no page")
    return outcome, found


def _no_number(text: str) -> NoReturn:
    raise ValueError(f"{text} is no number")


def main() -> int:
    """Try all in an order drawn by lot until the time is over; 1 where anything broke."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=None, help="else by the clock")
    asked = parser.parse_args()
    seed = int(time.time()) if asked.seed is None else asked.seed
    drawn, codes, broke = cases(), Counter[int](), 0
    random.Random(seed).shuffle(drawn)
    end = time.monotonic() + 60.0 * asked.minutes
    with tempfile.TemporaryDirectory(prefix="pilotage-ends-") as place:
        for number, (what, values) in enumerate(drawn):
            if time.monotonic() > end:
                break
            outcome, found = faults(values, Path(place) / str(number))
            codes[outcome.code] += 1
            if found:
                broke += 1
                print(f"seed {seed}, case {number}, {what}: {found[0][:600]}", flush=True)
    told = ", ".join(f"{count} with {code}" for code, count in sorted(codes.items()))
    print(f"seed {seed}: {sum(codes.values())} of {len(drawn)} cases ({told}); {broke} broke something")
    return 1 if broke else 0


if __name__ == "__main__":
    sys.exit(main())
