"""Is the particle filter as good as it says? In a world where its density is the true one.

A likelihood field takes a wall seen aslant to be as uncertain across as along the beam. Across, the true
variance is smaller by the squared cosine of the angle, on average by about one half here, so a right filter
has a mean NEES between 3/2 and 3. Over 60 runs with other seeds it was 2.51 with a scatter of 1.1 from run to
run; the mean of 24 leaves the band around it about once in 200 fresh sets of seeds.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pilotage.core.types import FloatArray, Pose2
from pilotage.evaluation.consistency import nees
from pilotage.evaluation.driving import covariances, poses
from pilotage.experiments.build.charts import load_chart
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import load_mission
from pilotage.maps.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from pilotage.maps.ros_map import RosMap, write_ros_map
from support.bare_robots import ON_WALLS

RUNS, SETTLE = 24, 20
FEW = 8
"""Runs that are enough to find a wrong filter out; a right one passes on them, too."""
LOW, HIGH = 1.85, 3.2
WORLD = (
    "stack.localizer.name=particle-filter",
    "stack.localizer.field_std_m=0",
    "robot.sensors.lidar.range_var_m2=4e-4",
    *ON_WALLS,
    "run.time_limit_s=30",
)


@cache
def sample(*overrides: str, runs: int = RUNS) -> FloatArray:
    """NEES (R, N)."""
    rows = []
    for seed in range(runs):
        trace = simulate(load_mission("museum-walls", [*WORLD, *overrides], seed)).finished.robots[0].trace
        rows.append(nees(poses(trace, "true"), poses(trace, "est"), covariances(trace))[SETTLE:])
    return np.array(rows)


def is_consistent(values: FloatArray) -> bool:
    """Whether the mean NEES is that of a right filter."""
    return LOW < float(values.mean()) < HIGH


def test_nees_lies_where_the_likelihood_field_puts_it() -> None:
    assert is_consistent(sample())
    assert is_consistent(sample()[:FEW])


@pytest.mark.parametrize("factor", ["0.5", "2"])
def test_a_filter_that_is_wrong_about_its_scanner_by_a_factor_of_two_is_found_out(factor: str) -> None:
    assert not is_consistent(sample(f"stack.localizer.measurement_var_scale={factor}", runs=FEW))


def test_with_room_for_an_imperfect_map_it_is_cautious_never_overconfident() -> None:
    values = []
    for seed in range(4):
        mission = load_mission("museum-walls", [WORLD[0], *ON_WALLS, WORLD[-1]], seed)
        trace = simulate(mission).finished.robots[0].trace
        values.append(nees(poses(trace, "true"), poses(trace, "est"), covariances(trace))[SETTLE:])
    upper = np.array(values).mean(axis=0) <= 3.0 * 3.0
    assert upper.mean() >= 0.99
    assert np.mean(values) < 2.5


@pytest.mark.parametrize(
    ("walls_in", "odometry_hz"),
    [((0,), 10), ((-1, 0), 10), ((0,), 2)],
    ids=["one-side", "both-sides", "slow-odometry"],
)
def test_cells_are_no_independent_witnesses(
    tmp_path: Path, walls_in: tuple[int, ...], odometry_hz: int
) -> None:
    """The museum's walls lie on borders of cells, and a map may have them in the cells of either side.

    Taking the cells' sides for the walls, the filter was a whole cell off and its mean NEES 1e5 in the first
    map. Here single runs have 2 to 5; what is asked for is half to twice three, and chance of two runs. With
    slow odometry the heading is unsure before each scan, which told anew what was known beside it.
    """
    chart = load_chart("museum")
    cells = np.full((900, 900), FREE, np.int8)
    for x0, y0, x1, y1 in np.rint((chart.walls.segments_m + 1.0) / 0.05).astype(int):
        for aside in walls_in:
            rows, columns = slice(min(y0, y1), max(y0, y1)), slice(min(x0, x1), max(x0, x1))
            if x0 == x1:
                cells[rows, x0 + aside] = OCCUPIED
            else:
                cells[y0 + aside, columns] = OCCUPIED
    grid = OccupancyGrid(np.ascontiguousarray(cells[::-1]), 0.05, Pose2(-1.0, -1.0, 0.0))
    write_ros_map(tmp_path / "map.yaml", RosMap.of(grid, "map.pgm"))
    own = (
        "stack.localizer.name=particle-filter",
        f"stack.map={tmp_path / 'map.yaml'}",
        f"robot.sensors.odometry.rate_hz={odometry_hz}",
    )
    values = []
    for seed in range(2):
        mission = load_mission("museum-walls", [*own, *ON_WALLS, "run.time_limit_s=40"], seed)
        trace = simulate(mission).finished.robots[0].trace
        values.append(nees(poses(trace, "true"), poses(trace, "est"), covariances(trace))[SETTLE:])
    assert 0.5 < np.mean(values) < 8.0


@pytest.mark.parametrize("seed", [0, 1])
def test_who_hardly_sees_says_so(seed: int) -> None:
    """With ranges told to 2 m it was half a metre off and sure of its place to 0.1 m: NEES 34 to 86."""
    settings = [
        "world.obstacles=[]",
        "stack.localizer={name: particle-filter, relocalize: false}",
        "robot.sensors.lidar={name: lidar, rate_hz: 10, beams: 60, range_var_m2: 4.0}",
        *(f"stack.{part}=null" for part in ("mapper", "reactive", "escape")),
        "run.time_limit_s=12",
    ]
    robot = simulate(load_mission("museum-1", settings, seed=seed)).finished.robots[0]
    errors = nees(poses(robot.trace, "true"), poses(robot.trace, "est"), covariances(robot.trace))
    assert errors.mean() < 6.0
