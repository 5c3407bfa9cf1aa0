"""IR-SIM's side: its lidar2d and its environment's step on the museum's walls, without any figure.

How it is kept fair:

- the walls are linestrings, chained where they meet: fewer objects than walls, which IR-SIM handles faster;
- the scanner has the same beams, field of view, reach and range noise; without noise both give the same
  ranges (``exact_ranges``);
- no figure, no window, no log; the robot is the same disc with the same speed limits and drives the same
  route by the cheapest behaviour, ``dash`` from goal to goal. A step of IR-SIM does less than one of
  pilotage: no odometry, beacons or ultrasonic cones, no limit of acceleration, no estimate; the true pose
  goes into the control.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import math
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from PIL import Image

from benchmarks.museum import GOAL_TOLERANCE_M, Museum
from pilotage.core.types import FloatArray
from pilotage.experiments.build.robots import motion_of
from pilotage.sensors.lidar import LidarConfig

MORE_STEPS = 1.5
"""IR-SIM may take this many times the steps of pilotage to finish the route."""

Point = tuple[float, float]


class IrsimPeer:
    """IR-SIM on the museum's floor.

    Raises
    ------
    ImportError
        Where IR-SIM is not installed.
    """

    def __init__(self, museum: Museum, scanner: LidarConfig | None = None) -> None:
        # On import it tries window systems, and says so on standard output where there is none.
        with contextlib.redirect_stdout(io.StringIO()):
            self._irsim: Any = importlib.import_module("irsim")
        self._museum, self._scanner = museum, scanner or LidarConfig()
        self._scanning = self._environment(noisy=True)
        self._scanning_cells = self._environment(noisy=True, on_grid=True)

    def scans_per_s(self, *, on_grid: bool = False) -> float:
        """Scan at every pose; on cells, where a scan takes a tenth of a second, at every tenth."""
        lidar = (self._scanning_cells if on_grid else self._scanning).robot.lidar
        states = self._states()[:: 10 if on_grid else 1]
        begin = time.perf_counter()
        for state in states:
            lidar.step(state)
        return len(states) / (time.perf_counter() - begin)

    def exact_ranges(self, *, on_grid: bool = False) -> FloatArray:
        """(poses, beams) ranges without noise."""
        lidar = self._environment(noisy=False, on_grid=on_grid).robot.lidar
        scans = []
        for state in self._states():
            lidar.step(state)
            scans.append(lidar.range_data.copy())
        return np.array(scans)

    def loop_steps(self, seed: int, steps_of_pilotage: int) -> tuple[int, float]:
        """Drive the route once; return the steps and the seconds that the stepping took."""
        environment = self._environment(noisy=True, seed=seed)
        robot = environment.robot
        limit, steps = int(MORE_STEPS * steps_of_pilotage), 0
        begin = time.perf_counter()
        while not robot.arrive_flag and steps < limit:
            environment.step()
            steps += 1
        took = time.perf_counter() - begin
        if not robot.arrive_flag or robot.collision_flag:
            raise RuntimeError(
                f"IR-SIM: expected an arrival, found {robot.state.ravel()} after {steps} steps"
            )
        return steps, took

    def _states(self) -> list[FloatArray]:
        return [pose.as_array()[:, None] for pose in self._museum.poses]

    def _environment(self, noisy: bool, seed: int = 0, *, on_grid: bool = False) -> Any:
        with tempfile.TemporaryDirectory() as folder:
            path, world = Path(folder) / "museum.yaml", self._world(noisy)
            if on_grid:
                picture = np.where(self._museum.grid.cells > 0, 0, 255).astype(np.uint8)
                Image.fromarray(picture).save(Path(folder) / "cells.png")
                world["world"]["obstacle_map"] = str(Path(folder) / "cells.png")
                world["obstacle"] = []
            path.write_text(yaml.safe_dump(world), encoding="utf-8")
            environment = self._irsim.make(str(path), headless=True, log_level="ERROR", seed=seed)
        corners = self._museum.route_xy_m[1:]
        environment.robot.set_goal([[x, y, 0.0] for x, y in corners])
        return environment

    def _world(self, noisy: bool) -> dict[str, Any]:
        """IR-SIM's description of the museum, from pilotage's mission."""
        mission, scanner = self._museum.mission, self._scanner
        start, motion = mission.world.start, motion_of(mission.robot, "robot")
        assert start is not None
        xmin, ymin, xmax, ymax = self._museum.floor.walls.bounds_m
        dt_s = mission.run.dt_s
        lidar = {
            "type": "lidar2d",
            "range_min": 0.0,
            "range_max": scanner.max_range_m,
            "angle_range": scanner.field_of_view_rad,
            "number": scanner.beams,
            "noise": noisy,
            "std": math.sqrt(scanner.range_var_m2),
        }
        robot = {
            "kinematics": {"name": "diff"},
            "shape": {"name": "circle", "radius": self._museum.radius_m},
            "state": [start.x_m, start.y_m, start.theta_rad],
            "goal": [*self._museum.route_xy_m[1], 0.0],
            "goal_threshold": GOAL_TOLERANCE_M,
            "vel_min": [-motion.top_speed_m_s, -motion.top_turn_rate_rad_s],
            "vel_max": [motion.top_speed_m_s, motion.top_turn_rate_rad_s],
            "behavior": {"name": "dash"},
            "sensors": [lidar],
        }
        walls = [
            {
                "shape": {"name": "linestring", "vertices": [list(point) for point in chain]},
                "state": [0.0, 0.0, 0.0],
                "static": True,
            }
            for chain in _chains(self._museum.floor.walls.segments_m)
        ]
        world = {
            "width": xmax - xmin,
            "height": ymax - ymin,
            "offset": [xmin, ymin],
            "step_time": dt_s,
            "sample_time": dt_s,
            "collision_mode": "stop",
        }
        return {"world": world, "robot": [robot], "obstacle": walls}


def _chains(segments_m: FloatArray) -> list[list[Point]]:
    """Join segments (N, 4) that share an end into polylines; each segment comes once."""
    left: list[tuple[Point, Point]] = []
    for x0, y0, x1, y1 in segments_m.tolist():
        wall = ((x0, y0), (x1, y1))
        if wall not in left:
            left.append(wall)
    chains = []
    while left:
        chain = list(left.pop(0))
        grown = True
        while grown:
            grown = False
            for wall in left:
                for a, b in (wall, wall[::-1]):
                    if a == chain[-1]:
                        chain.append(b)
                    elif a == chain[0]:
                        chain.insert(0, b)
                    else:
                        continue
                    left.remove(wall)
                    grown = True
                    break
                if grown:
                    break
        chains.append(chain)
    return chains
