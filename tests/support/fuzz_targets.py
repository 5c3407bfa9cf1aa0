"""Every command with every reader behind it: healthy inputs, small, and the words that use them."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from scipy.io import savemat

from pilotage.logs.odometry_csv import COLUMNS
from pilotage.maps.cell_map import CellMap
from pilotage.maps.cell_map_text import format_cell_map
from pilotage.maps.grid_image import write_grey
from pilotage.maps.true_cells import SheetFile, true_map
from support.films import FilmScript, render_film
from support.laser_drives import laser_drive
from support.mrclam_drives import Events, Robot, write_mrclam

SHORT = ("--quiet", "--no-report", "--out", "out")
QUICK = (*SHORT, "--set", "run.time_limit_s=0.5", "--set", "run.dt_s=0.1")


@dataclass(frozen=True)
class Target:
    """One use of a command.

    Attributes
    ----------
    write
        Writes the healthy inputs into a folder.
    words
        After ``pilotage``, to be run in that folder.
    files
        Those of the inputs that are damaged.
    trees
        Whether they hold YAML or JSON.
    """

    name: str
    write: Callable[[Path], None]
    words: tuple[str, ...]
    files: tuple[str, ...]
    trees: bool = False


WALLS = {
    "map": "box",
    "description": "a box",
    "bounds_m": [0.0, 0.0, 10.0, 8.0],
    "walls_m": [[0, 0, 10, 0], [10, 0, 10, 8], [10, 8, 0, 8], [0, 8, 0, 0], [4, 0, 4, 5]],
    "circles_m": [[7.0, 4.0, 0.5]],
    "landmarks": [{"id": 1, "x_m": 0.1, "y_m": 0.1}, {"id": 2, "x_m": 9.5, "y_m": 7.5}],
    "walls_count": 5,
}
SHEET = {
    "size_m": [0.8, 0.8],
    "cells": [8, 8],
    "start_pose": [0.4, 0.3, 1.57],
    "obstacles": [[0.1, 0.6, 0.2, 0.7]],
    "lines": [[[0.5, 0.6], [0.7, 0.6]]],
}


def _yaml(path: Path, values: object) -> None:
    path.write_text(yaml.safe_dump(values, sort_keys=False), encoding="utf-8")


def _walls(folder: Path) -> None:
    _yaml(folder / "walls.yaml", WALLS)


def _blocked() -> np.ndarray:
    blocked = np.zeros((12, 16), dtype=np.bool_)
    blocked[3:9, 7] = True
    return blocked


def _ros(folder: Path) -> None:
    write_grey(folder / "grid.pgm", np.where(_blocked(), 0, 254).astype(np.uint8))
    write_grey(folder / "grid.png", np.where(_blocked(), 0, 254).astype(np.uint8))
    for suffix in ("pgm", "png"):
        _yaml(
            folder / f"{suffix}.yaml",
            {
                "image": f"grid.{suffix}",
                "resolution": 0.5,
                "origin": [0.0, 0.0, 0.0],
                "negate": 0,
                "occupied_thresh": 0.65,
                "free_thresh": 0.196,
            },
        )


def _images(folder: Path) -> None:
    write_grey(folder / "white.png", np.where(_blocked(), 255, 0).astype(np.uint8))


def _moving_ai(folder: Path) -> None:
    rows = ["".join("@" if cell else "." for cell in row) for row in _blocked()]
    (folder / "grid.map").write_text("type octile\nheight 12\nwidth 16\nmap\n" + "\n".join(rows) + "\n")
    (folder / "grid.scen").write_text(
        "version 1\n0\tgrid.map\t16\t12\t1\t1\t5\t1\t4.00000000\n"
        "0\tgrid.map\t16\t12\t2\t2\t2\t6\t4.00000000\n"
    )


def _npy(folder: Path) -> None:
    np.save(folder / "grid.npy", _blocked())
    np.save(folder / "heights.npy", np.add.outer(np.arange(12.0), np.zeros(16)).astype(np.float32))


def _heights(folder: Path) -> None:
    heights = (1000 + np.add.outer(np.arange(12) * 10, np.zeros(16, int))).astype("<u2")
    (folder / "heights.bin").write_bytes(heights.tobytes())
    side = {
        "size": [12, 16],
        "format": "uint16-le",
        "metresPerPixel": 1.0,
        "elevationMin": 0.0,
        "elevationMax": 100.0,
        "file": "heights.bin",
    }
    (folder / "heights.json").write_text(json.dumps(side))


def _floor(folder: Path) -> None:
    _walls(folder)
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
    _yaml(folder / "mission.yaml", mission)
    _yaml(folder / "parameters.yaml", {"robot": {"sensors": {"odometry": {"angle_var_rad2_per_m": 1.0e-4}}}})


def _terrain(folder: Path) -> None:
    _ros(folder)
    blocked = np.where(_blocked(), 255, 0).astype(np.uint8)
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
    _yaml(folder / "mission.yaml", mission)


def _sheet(folder: Path) -> None:
    _yaml(folder / "sheet.yaml", SHEET)
    mission = {
        "extends": "romi-explore",
        "mission": "fuzzed-sheet",
        "world": {"map": "sheet.yaml"},
        "stack": {"navigator": {"name": "surround-check", "margin_cells": 2}},
    }
    _yaml(folder / "mission.yaml", mission)


def _trajectories(folder: Path) -> None:
    tum = "".join(
        f"{i * 0.1:.6f} {i * 0.5:.4f} {i * i * 0.01:.4f} 0.0000 0.0 0.0 0.0 1.0\n" for i in range(40)
    )
    kitti = "".join(f"1 0 0 {i}.5 0 1 0 2.5 0 0 1 3.25\n" for i in range(40))
    for name in ("a", "b"):
        (folder / f"{name}.tum").write_text(tum)
        (folder / f"{name}.kitti").write_text(kitti)


def _mrclam(folder: Path) -> None:
    write_mrclam(folder / "drive", [(1, 0, Robot(), Events(duration_s=150.0))])


def _aer1513(folder: Path) -> None:
    savemat(folder / "drive.mat", laser_drive(rows=200))
    savemat(folder / "packed.mat", laser_drive(rows=200), do_compression=True)
    savemat(folder / "level4.mat", laser_drive(rows=200), format="4")


def _calibrate(folder: Path) -> None:
    rng = np.random.default_rng(3)
    rows = [",".join(COLUMNS)]
    for i in range(60):
        true = (0.1 * i, 0.1 * i, 0.0, 0.0)
        told = (0.1 * i + rng.normal(0, 0.004), rng.normal(0, 0.004), rng.normal(0, 0.002))
        rows.append(",".join(f"{value:.6f}" for value in (true[0], *told, *true[1:])))
    (folder / "odometry.csv").write_text("\n".join(rows) + "\n")
    steady = [f"{0.1 * i:.2f},{2.0 + rng.normal(0, 0.01):.5f},{rng.normal(0, 0.01):.5f}" for i in range(60)]
    (folder / "range.csv").write_text("t_s,range_m,bearing_rad\n" + "\n".join(steady) + "\n")
    turns = [",".join(f"{v:.6f}" for v in (0.01 * i, *rng.normal(0, 0.1, 3))) for i in range(800)]
    (folder / "gyro.csv").write_text("t,x,y,z\n" + "\n".join(turns) + "\n")
    angle = np.linspace(0.0, 12.0, 400)
    field = np.column_stack([0.2 + 0.4 * np.cos(angle), 0.1 + 0.4 * np.sin(angle), 0.3 + 0.0 * angle])
    field += rng.normal(0, 0.003, field.shape)
    told_field = [",".join(f"{v:.6f}" for v in (0.05 * i, *row)) for i, row in enumerate(field)]
    (folder / "compass.csv").write_text("t,x,y,z\n" + "\n".join(told_field) + "\n")
    t = 0.1 * np.arange(600)
    heading = 0.05 * t
    truth = np.column_stack([t, np.cos(heading), np.sin(heading), heading])
    steps = np.column_stack([t[1:], np.full(599, 0.005), np.diff(heading) + rng.normal(0, 1e-4, 599)])
    savemat(folder / "reckoning.mat", {"GT": truth, "DR": steps})


def _cells(folder: Path) -> None:
    true = true_map(SheetFile.model_validate(SHEET))
    (folder / "printed.txt").write_text(format_cell_map(true.cells, 3600.0))
    (folder / "truth.txt").write_text(format_cell_map(CellMap.unknown(25, 25)))
    (folder / "robot.txt").write_text(format_cell_map(CellMap.unknown(25, 25), 3600.0))
    _yaml(folder / "truth.yaml", SHEET)
    (folder / "track.json").write_text(json.dumps({"visited_cells": [[1, 1], [2, 2]], "grid": {"cells": 8}}))


def _film(folder: Path) -> None:
    render_film(folder / "film.avi", FilmScript(frames=12))


ENDS = ("--start", "1,1", "--goal", "2,5")
ROOM = ("--start", "1,1", "--goal", "6.2,1.3")

TARGETS: tuple[Target, ...] = (
    Target(
        "plan walls", _walls, ("plan", "walls.yaml", *ENDS, "--set", "iterations=200"), ("walls.yaml",), True
    ),
    Target("plan ros", _ros, ("plan", "pgm.yaml", *ROOM), ("pgm.yaml",), True),
    Target("plan pgm", _ros, ("plan", "pgm.yaml", *ROOM), ("grid.pgm",)),
    Target("plan png", _ros, ("plan", "png.yaml", *ROOM), ("grid.png",)),
    Target(
        "plan image", _images, ("plan", "white.png", *ROOM, "--set", "map.resolution_m=0.5"), ("white.png",)
    ),
    Target("plan map", _moving_ai, ("plan", "grid.map", *ROOM), ("grid.map",)),
    Target("plan npy", _npy, ("plan", "grid.npy", *ROOM), ("grid.npy",)),
    Target(
        "plan heights npy",
        _npy,
        ("plan", "heights.npy", *ROOM, "--slope-limit", "60", "--set", "map.resolution_m=1"),
        ("heights.npy",),
    ),
    Target(
        "plan heights json",
        _heights,
        ("plan", "heights.json", *ROOM, "--slope-limit", "60"),
        ("heights.json",),
        True,
    ),
    Target(
        "plan heights bin", _heights, ("plan", "heights.json", *ROOM, "--slope-limit", "60"), ("heights.bin",)
    ),
    Target("bench scen", _moving_ai, ("bench-scen", "grid.map", "grid.scen"), ("grid.scen", "grid.map")),
    Target("run floor", _floor, ("run", "mission.yaml", *QUICK), ("mission.yaml",), True),
    Target("run walls", _floor, ("run", "mission.yaml", *QUICK), ("walls.yaml",), True),
    Target(
        "run parameters",
        _floor,
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
    Target("evaluate tum", _trajectories, ("evaluate", "a.tum", "b.tum", "--align"), ("a.tum", "b.tum")),
    Target("evaluate kitti", _trajectories, ("evaluate", "a.kitti", "b.kitti"), ("a.kitti",)),
    Target(
        "localize mrclam",
        _mrclam,
        ("localize", "drive", "--format", "mrclam", "--robot", "1", "--out", "out", "--no-report"),
        (
            "drive/Robot1_Odometry.dat",
            "drive/Robot1_Measurement.dat",
            "drive/Robot1_Groundtruth.dat",
            "drive/Barcodes.dat",
            "drive/Landmark_Groundtruth.dat",
        ),
    ),
    Target(
        "localize aer1513",
        _aer1513,
        ("localize", "drive.mat", "--format", "aer1513", "--out", "out", "--no-report"),
        ("drive.mat",),
    ),
    Target(
        "localize aer1513 packed",
        _aer1513,
        ("localize", "packed.mat", "--format", "aer1513", "--out", "out", "--no-report"),
        ("packed.mat",),
    ),
    Target(
        "localize aer1513 level 4",
        _aer1513,
        ("localize", "level4.mat", "--format", "aer1513", "--out", "out", "--no-report"),
        ("level4.mat",),
    ),
    Target(
        "calibrate odometry",
        _calibrate,
        ("calibrate", "odometry", "odometry.csv", "--out", "out", "--no-report"),
        ("odometry.csv",),
    ),
    Target(
        "calibrate range",
        _calibrate,
        ("calibrate", "range", "range.csv", "--out", "out", "--no-report"),
        ("range.csv",),
    ),
    Target(
        "calibrate heading",
        _calibrate,
        ("calibrate", "heading", "gyro.csv", "compass.csv", "--out", "out", "--no-report"),
        ("gyro.csv", "compass.csv"),
    ),
    Target(
        "calibrate heading mat",
        _calibrate,
        ("calibrate", "heading", "reckoning.mat", "--out", "out", "--no-report"),
        ("reckoning.mat",),
    ),
    Target(
        "calibrate commands",
        _mrclam,
        ("calibrate", "commands", "drive", "--format", "mrclam", "--out", "out", "--no-report"),
        ("drive/Robot1_Odometry.dat", "drive/Robot1_Measurement.dat", "drive/Robot1_Groundtruth.dat"),
    ),
    Target("map-score text", _cells, ("map-score", "robot.txt", "truth.txt"), ("robot.txt", "truth.txt")),
    Target("map-score yaml", _cells, ("map-score", "printed.txt", "truth.yaml"), ("truth.yaml",), True),
    Target(
        "map-score visited",
        _cells,
        ("map-score", "printed.txt", "truth.yaml", "--visited", "track.json"),
        ("track.json",),
        True,
    ),
)
FILM_TARGETS = (
    Target(
        "track",
        _film,
        ("track", "film.avi", "--out", "out", "--corners", "120,330,560,318,450,60,190,52"),
        ("film.avi",),
    ),
)
"""In the long run only: a film takes seconds."""


def _run_folder(folder: Path) -> None:
    _floor(folder)
    from support.outcome import run

    assert run(("run", "mission.yaml", *QUICK), folder).code in (0, 1)
    (made,) = (folder / "out").iterdir()
    made.rename(folder / "run")


def _study(folder: Path) -> None:
    definition = {
        "study": "fuzzed",
        "mission": "museum-plan",
        "trials": 1,
        "set": {"stack.planner.iterations": 100},
        "factors": [{"key": "stack.planner.turning_radius_m", "values": [0.3, 0.5]}],
    }
    _yaml(folder / "study.yaml", definition)


TARGETS += (
    Target(
        "report run",
        _run_folder,
        ("report", "run"),
        ("run/metrics.json", "run/events.jsonl", "run/world.json", "run/mission.yaml"),
        True,
    ),
    Target("report run arrays", _run_folder, ("report", "run"), ("run/trace.parquet", "run/scans.npz")),
    Target(
        "study",
        _study,
        ("study", "study.yaml", "--workers", "1", "--no-report", "--quiet"),
        ("study.yaml",),
        True,
    ),
)
BY_NAME = {target.name: target for target in TARGETS}

OPTIONS: tuple[tuple[str, ...], ...] = (
    ("run", "VALUE"),
    ("run", "VALUE.yaml", *QUICK),
    ("run", "mission.yaml", *QUICK, "--seed", "VALUE"),
    ("run", "mission.yaml", *QUICK, "--set", "mission=VALUE"),
    ("run", "mission.yaml", *QUICK, "--set", "world.start.x_m=VALUE"),
    ("run", "mission.yaml", *QUICK, "--set", "VALUE=1"),
    ("run", "mission.yaml", *QUICK, "--set", "world.obstacles.VALUE.kind=box"),
    ("run", "mission.yaml", *QUICK, "--set", "run.seed=VALUE"),
    ("run", "mission.yaml", *QUICK, "--set", "run.oracles=[VALUE]"),
    ("run", "mission.yaml", *QUICK, "--set", "@VALUE"),
    ("run", "mission.yaml", *QUICK, "--set", "world.map=VALUE"),
    ("run", "mission.yaml", *QUICK, "--set", "stack.localizer.name=VALUE"),
    ("plan", "walls.yaml", "--start", "VALUE,1", "--goal", "2,6", "--set", "iterations=200"),
    ("plan", "walls.yaml", "--start", "1,1", "--goal", "2,6,VALUE", "--set", "iterations=200"),
    ("plan", "walls.yaml", *ENDS, "--planner", "VALUE"),
    ("plan", "VALUE", *ENDS),
    ("plan", "VALUE.png", *ENDS),
    ("evaluate", "VALUE", "walls.yaml"),
    ("localize", "VALUE", "--format", "mrclam"),
    ("localize", ".", "--format", "VALUE"),
    ("calibrate", "VALUE"),
    ("calibrate", "odometry", "VALUE"),
    ("calibrate", "odometry", "VALUE.csv", "--wheel-base", "VALUE"),
    ("map-score", "VALUE", "walls.yaml"),
    ("bench-scen", "VALUE", "VALUE"),
    ("components", "VALUE"),
    ("VALUE",),
)
"""Words on the command line with a place for what nobody expects there."""
