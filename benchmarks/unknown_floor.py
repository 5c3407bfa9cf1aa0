"""A floor that nobody has mapped: explored, mapped, and driven by the map.

Each seed is run three times: ``museum-unknown`` (or the same stack on another map), the same with a perfect
pose, and a mission from another random start to a goal with the built map as its own and a particle filter.
``python -m benchmarks.unknown_floor --seeds 5 [--map FILE --radius 0.2]``.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from pilotage.core.errors import InputError
from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission

SECOND = (
    "stack.localizer.name=particle-filter",
    "world.random_start={clearance_m: 0.6}",
    "world.obstacles=[]",
)


def main() -> None:
    """Print a line a seed, and how many succeeded."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--map", default=None)
    parser.add_argument("--radius", type=float, default=0.3)
    parser.add_argument("--goal", type=float, nargs=2, default=(20.0, 20.0))
    asked = parser.parse_args()
    place = (
        [] if asked.map is None else [f"world.map={asked.map}", f"robot.footprint.radius_m={asked.radius}"]
    )
    done = second = 0
    for seed in range(asked.seeds):
        with tempfile.TemporaryDirectory() as folder:
            run = run_mission(load_mission("museum-unknown", place, seed), out=Path(folder))
            told = run.metrics
            best = run_mission(
                load_mission("museum-unknown", [*place, "run.oracles=[localizer]"], seed), save=False
            ).metrics
            assert run.run_dir is not None
            built = run.run_dir / "map.yaml"
            try:
                goal = f"world.goal={{x_m: {asked.goal[0]}, y_m: {asked.goal[1]}}}"
                sets = [*place, *SECOND, goal, f"stack.map={built}"]
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
    print(f"explored {done} of {asked.seeds}; second missions {second} of {asked.seeds}")


if __name__ == "__main__":
    main()
