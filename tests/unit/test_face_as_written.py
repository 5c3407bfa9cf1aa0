"""The public face's lines as they are promised, in a plain script without a guard around them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.ros_map import RosMap, write_ros_map
from support.films import FilmScript, render_film

SCRIPT = """
import pilotage as pl

near = {"x_m": 6.0, "y_m": 6.0}
mission = pl.load("museum-1", seed=7, set={"stack.localizer.gate": 0.99, "world.goal": near})
run = pl.run(mission)
print(run.success, run.reason)
print(run.metrics["position_rmse_m"])
print(run.metrics.table())
print(run.trace.to_arrow().num_rows, run.trace.to_pandas().shape)
run.report("night.html"); run
print(run.folder, pl.open_run(run.folder))
sim = pl.make(mission)
readings = sim.reset()
readings = sim.step(pl.Twist(0.5, 0.1))
print(sim.truth)
start, goal = (1.0, 1.0), (5.0, 1.0)
print(pl.plan("map.yaml", start, goal).path.shape)
print(pl.plan("map.yaml", start, goal, planner="theta-star", clearance_m=0.2).path.shape)
short = pl.load(mission, set={"run.time_limit_s": 3.0})
print(pl.study(short, vary={"stack.localizer.gate": [0.9, 0.99]}, trials=2, workers=1).table())
ranges = [2.0] * 90
box = [[0, 0, 6, 0], [6, 0, 6, 4], [6, 4, 0, 4], [0, 4, 0, 0], [3, 0, 3, 2.5]]
filter = pl.filters.EkfLandmarks(landmarks=[[4.0, 0.0], [0.0, 3.0]])
print(filter.predict(0.5, 0.0).update([0, 1], [3.5, 3.04], [0.0, 1.737]).mean)
log = pl.export(run, "mcap", "run.mcap")
print(pl.localize(log, map="museum").success)
print(pl.calibrate("odometry", log)["distance_scale"])
print(pl.evaluate(log, log, topics=["/pose", "/truth"])["ate_rmse_m"])
print(pl.track("film.avi").visited_cells)
print(pl.lines.extract(ranges, field_of_view_rad=1.5))
print(pl.planners.on_walls(box, (1, 1), (5, 1), planner="astar", clearance_m=0.3).status)
print(pl.planners.on_cells([[False] * 9] * 9, (1, 1), (7, 7)).status)
print(pl.draw(pl.vectorize("map.yaml"), "walls.png").layers["walls"])
print("all of it")
"""


pytest.importorskip("cv2", reason="needs the extra 'vision'")
pytest.importorskip("rosbags", reason="needs the extra 'ros'")
pytest.importorskip("pandas", reason="needs the extra 'dev'")


@pytest.mark.slow
def test_the_lines_run_as_written(tmp_path: Path) -> None:
    cells = np.zeros((40, 60), dtype=bool)
    cells[:, 0] = cells[:, -1] = cells[0] = cells[-1] = True
    cells[12:, 30] = True
    write_ros_map(tmp_path / "map.yaml", RosMap.of(OccupancyGrid.of(cells, 0.1), "map.pgm"))
    render_film(tmp_path / "film.avi", FilmScript(frames=20))
    (tmp_path / "lines.py").write_text(SCRIPT)
    done = subprocess.run(
        [sys.executable, "-W", "error", "lines.py"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert lines[0] == "True arrived"
    assert lines[-1] == "all of it"
    assert (tmp_path / "night.html").is_file()
