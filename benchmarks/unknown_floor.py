"""A floor that nobody has mapped: explored, mapped, and driven by the map.

Each seed is run three times: ``museum-unknown`` (or the same stack on another map), the same with a perfect
pose, and a mission from another random start to a goal with the built map as its own and a particle filter.
On another map all starts are drawn on its largest floor, and the goal is where the exploration began.
``python -m benchmarks.unknown_floor [--first 0] --seeds 5 [--map FILE --radius 0.2 --goal X Y]``.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from pilotage.core.errors import InputError
from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission

SECOND = ("stack.localizer.name=particle-filter", "world.obstacles=[]")
MUSEUM_GOAL = (20.0, 20.0)
ROOM_M = 0.3
"""A start is drawn with so much room beside the body."""


def main() -> None:
    """Print a line a seed, and how many succeeded; bad input is one line and exit 2."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--map", default=None)
    parser.add_argument("--radius", type=float, default=0.3)
    parser.add_argument("--goal", type=float, nargs=2, default=None)
    asked = parser.parse_args()
    try:
        explore(range(asked.first, asked.first + asked.seeds), asked.map, asked.radius, asked.goal)
    except InputError as error:
        parser.exit(2, f"unknown_floor: {error}\n")


def explore(seeds: range, chart: str | None, radius_m: float, goal_xy_m: tuple[float, float] | None) -> None:
    """Run every seed three times.

    Raises
    ------
    InputError
        Where the map cannot be read, or has no floor for the robot.
    """
    place = [
        f"robot.footprint.radius_m={radius_m}",
        f"world.random_start={{clearance_m: {radius_m + ROOM_M}}}",
    ]
    if chart is not None:
        place += [f"world.map={chart}", "world.start=null"]
    done = second = 0
    for seed in seeds:
        with tempfile.TemporaryDirectory() as folder:
            run = run_mission(load_mission("museum-unknown", place, seed), out=Path(folder))
            told = run.metrics
            best = run_mission(
                load_mission("museum-unknown", [*place, "run.oracles=[localizer]"], seed), save=False
            ).metrics
            assert run.run_dir is not None
            built = run.run_dir / "map.yaml"
            try:
                goal = goal_xy_m or (MUSEUM_GOAL if chart is None else _start_of(run.run_dir))
                sets = [
                    *place,
                    *SECOND,
                    f"world.goal={{x_m: {goal[0]}, y_m: {goal[1]}}}",
                    f"stack.map={built}",
                ]
                again = run_mission(load_mission("museum-1", sets, 1000 + seed), save=False).metrics
            except InputError as error:
                again = {"success": False, "reason": str(error)}
        done += bool(told["success"])
        second += bool(again["success"])
        ratio = float(str(told["path_length_m"])) / float(str(best["path_length_m"]))
        numbers = " ".join(
            f"{key} {float(str(told.get(key, float('nan')))):.4g}"
            for key in ("floor_mapped", "wall_rms_m", "return_error_m", "path_length_m", "nees_mean")
        )
        print(
            f"seed {seed}: {told['success']} ({told['reason']}) {numbers} collisions {told['collisions']} "
            f"path over the oracle's {ratio:.2f}; second mission {again['success']} ({again['reason']})",
            flush=True,
        )
    print(f"explored {done} of {len(seeds)}; second missions {second} of {len(seeds)}")


def _start_of(run_dir: Path) -> tuple[float, float]:
    """Where a run began."""
    start = load_mission(str(run_dir / "mission.yaml")).world.start
    assert start is not None
    return start.x_m, start.y_m


if __name__ == "__main__":
    main()
