"""Missions with what they name: floors, terrain, sheets, teams, people, courses."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from pilotage.maps.grid_image import write_grey
from support.fuzz_targets.maps import SHEET, blocked_cells, write_ros, write_walls
from support.fuzz_targets.target import QUICK, SHORT, Target, write_yaml

WALKERS = Path(__file__).parents[1] / "walkers.txt"


def write_floor(folder: Path) -> None:
    write_walls(folder)
    mission = {
        "extends": "museum-1",
        "mission": "fuzzed",
        "world": {
            "map": "walls.yaml",
            "start": {"x_m": 1.0, "y_m": 1.0, "theta_rad": 0.0},
            "goal": {"x_m": 2.0, "y_m": 6.0},
            "obstacles": [{"kind": "box", "from_m": [1.0, 4.0], "to_m": [2.0, 4.0], "thickness_m": 0.3}],
        },
        "robot": {"sensors": {"lidar": {"name": "lidar", "rate_hz": 10}}},
        "stack": {"localizer": {"name": "ekf-landmarks", "gate": 0.999}, "initial": {"x_var_m2": 0.01}},
        "run": {"dt_s": 0.1, "time_limit_s": 1.0, "seed": 3},
    }
    write_yaml(folder / "mission.yaml", mission)
    write_yaml(
        folder / "parameters.yaml", {"robot": {"sensors": {"odometry": {"angle_var_rad2_per_m": 1.0e-4}}}}
    )


def _terrain(folder: Path) -> None:
    write_ros(folder)
    blocked = np.where(blocked_cells(), 255, 0).astype(np.uint8)
    write_grey(folder / "obstacles.png", blocked)
    (folder / "landmarks.csv").write_text("id,x_m,y_m\n1,10.0,10.0\n2,50.0,30.0\n3,30.0,50.0\n")
    sensors = {
        "odometer": {"name": "wheel-odometry", "rate_hz": 1, "distance_var_m2_per_m": 4.0e-5},
        "lidar": {"name": "beacons", "rate_hz": 1, "max_range_m": 500.0, "field_of_view_rad": 6.28},
    }
    mission = {
        "mission": "fuzzed-terrain",
        "world": {
            "map": {"name": "images", "obstacles": "obstacles.png", "resolution_m": 10.0},
            "start": {"x_m": 15.0, "y_m": 15.0, "theta_rad": 0.0},
            "goal": {"x_m": 130.0, "y_m": 60.0},
            "landmarks": "landmarks.csv",
        },
        "robot": {
            "footprint": {"radius_m": 1.5},
            "motion": {"name": "bicycle", "wheelbase_m": 3.0, "max_speed_m_s": 0.05},
            "sensors": sensors,
        },
        "stack": {
            "planner": {"name": "astar", "corner_cutting": False},
            "navigator": {"name": "curve", "spline": {"clear": True}, "speed_m_s": 0.04},
            "localizer": {"name": "ekf-landmarks"},
            "controller": "kanayama",
        },
        "run": {"dt_s": 1.0, "time_limit_s": 20.0},
    }
    write_yaml(folder / "mission.yaml", mission)


def _sheet(folder: Path) -> None:
    write_yaml(folder / "sheet.yaml", SHEET)
    mission = {
        "extends": "romi-explore",
        "mission": "fuzzed-sheet",
        "world": {"map": "sheet.yaml"},
        "stack": {"navigator": {"name": "surround-check", "margin_cells": 2}},
    }
    write_yaml(folder / "mission.yaml", mission)


GRAPH = (
    """3 100 100 0.1 0.0 0.0
0 15 15 1 1 E 0
1 30 15 2 0 W 0 2 N 0
2 30 60 1 1 S 0
""".replace(" E 0", " E 15")
    .replace(" W 0", " W 15")
    .replace(" N 0", " N 45")
    .replace(" S 0", " S 45")
)
"""A patrol graph of three places, in pixels of 0.1 m."""


def write_crowd(folder: Path) -> None:
    """A team of two that patrols a graph among people, with faults."""
    write_walls(folder)
    (folder / "rounds.graph").write_text(GRAPH)
    shutil.copyfile(WALKERS, folder / "walkers.txt")
    mission = {
        "extends": "museum-patrol",
        "mission": "fuzzed-crowd",
        "world": {
            "map": "walls.yaml",
            "people": [
                {"name": "track", "file": "walkers.txt"},
                {"name": "social-force", "count": 1},
            ],
        },
        "robot": {
            "faults": [
                {"name": "drop", "share": 0.3, "sensor": "odometry"},
                {"name": "delay", "most_s": 0.2, "sensor": "lidar"},
                {"name": "gap", "sensor": "lidar", "from_s": 0.1, "length_s": 0.3},
                {"name": "bias-step", "sensor": "odometry", "from_s": 0.1, "by_m": 0.01, "by_rad": 0.01},
            ]
        },
        "team": {
            "size": 2,
            "strategy": {"name": "cyclic"},
            "radio": {"range_m": 5.0, "loss": 0.1, "delay_s": 0.1},
            "starts": [
                {"x_m": 1.5, "y_m": 1.5, "theta_rad": 0.0},
                {"x_m": 3.0, "y_m": 6.0, "theta_rad": 0.0},
            ],
            "failures": [{"robot": 1, "at_s": 0.2, "kind": "radio", "for_s": 0.1}],
        },
        "task": {"name": "patrol", "graph": "rounds.graph", "duration_s": 1.0},
    }
    write_yaml(folder / "mission.yaml", mission)


def _courses(folder: Path) -> None:
    """A BARN course that is a lane with one post in it."""
    posts = [(x, round(0.2 * k, 3)) for x in (-4.2, -0.3) for k in range(5, 50)] + [(-2.25, 6.0)]
    (folder / "cylinders.csv").write_text("world,x_m,y_m\n" + "".join(f"0,{x},{y}\n" for x, y in posts))
    (folder / "paths.csv").write_text("world,k,x_m,y_m\n0,0,-2.25,3.0\n0,1,-2.25,13.0\n")
    (folder / "worlds.csv").write_text(
        f"world,cylinders,path_length_m,optimal_time_s\n0,{len(posts)},10.0,5.0\n"
    )
    shutil.copyfile(WALKERS, folder / "walkers.txt")
    write_walls(folder)


STRAIGHT = "stack.navigator={name: open-loop, speed_m_s: 1.0, turn_rate_rad_s: 0.0, duration_s: 90.0}"
ONE = ("--trials", "1", "--workers", "1", "--replays", "0", "--out", "out")
ONE_COURSE = (*ONE, "--courses", "1", "--controller", "dwa")
TARGETS: tuple[Target, ...] = (
    Target("run floor", write_floor, ("run", "mission.yaml", *QUICK), ("mission.yaml",), True),
    Target("run walls", write_floor, ("run", "mission.yaml", *QUICK), ("walls.yaml",), True),
    Target(
        "run parameters",
        write_floor,
        ("run", "mission.yaml", "--set", "@parameters.yaml", *QUICK),
        ("parameters.yaml",),
        True,
    ),
    Target("run terrain", _terrain, ("run", "mission.yaml", *SHORT), ("mission.yaml",), True),
    Target(
        "run terrain files",
        _terrain,
        ("run", "mission.yaml", *SHORT),
        ("obstacles.png", "landmarks.csv"),
    ),
    Target(
        "run sheet",
        _sheet,
        ("run", "mission.yaml", *SHORT, "--set", "run.time_limit_s=2", "--set", "run.dt_s=0.01"),
        ("mission.yaml", "sheet.yaml"),
        True,
    ),
    Target("run crowd", write_crowd, ("run", "mission.yaml", *QUICK), ("mission.yaml",), True),
    Target("run crowd files", write_crowd, ("run", "mission.yaml", *QUICK), ("rounds.graph", "walkers.txt")),
    Target(
        "bench barn",
        _courses,
        ("bench", "barn", ".", *ONE, "--set", STRAIGHT),
        ("cylinders.csv", "paths.csv", "worlds.csv"),
    ),
    Target(
        "bench controllers people",
        _courses,
        ("bench", "controllers", "walkers.txt", *ONE_COURSE, "--set", "run.time_limit_s=1"),
        ("walkers.txt",),
    ),
    Target(
        "bench controllers map",
        _courses,
        ("bench", "controllers", "walls.yaml", *ONE_COURSE, "--set", "run.time_limit_s=1"),
        ("walls.yaml",),
        True,
    ),
)
