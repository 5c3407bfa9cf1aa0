"""Maps of every form: planned on, drawn, made into walls, scored."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from pilotage.maps.cell_map import CellMap
from pilotage.maps.cell_map_text import format_cell_map
from pilotage.maps.grid_image import write_grey
from pilotage.maps.true_cells import SheetFile, true_map
from support.fuzz_targets.target import ENDS, Target, write_yaml

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
ROOM = ("--start", "1,1", "--goal", "6.2,1.3")


def write_walls(folder: Path) -> None:
    write_yaml(folder / "walls.yaml", WALLS)


def blocked_cells() -> np.ndarray:
    blocked = np.zeros((12, 16), dtype=np.bool_)
    blocked[3:9, 7] = True
    return blocked


def write_ros(folder: Path) -> None:
    write_grey(folder / "grid.pgm", np.where(blocked_cells(), 0, 254).astype(np.uint8))
    write_grey(folder / "grid.png", np.where(blocked_cells(), 0, 254).astype(np.uint8))
    for suffix in ("pgm", "png"):
        write_yaml(
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
    write_grey(folder / "white.png", np.where(blocked_cells(), 255, 0).astype(np.uint8))


def _moving_ai(folder: Path) -> None:
    rows = ["".join("@" if cell else "." for cell in row) for row in blocked_cells()]
    (folder / "grid.map").write_text("type octile\nheight 12\nwidth 16\nmap\n" + "\n".join(rows) + "\n")
    (folder / "grid.scen").write_text(
        "version 1\n0\tgrid.map\t16\t12\t1\t1\t5\t1\t4.00000000\n"
        "0\tgrid.map\t16\t12\t2\t2\t2\t6\t4.00000000\n"
    )


def _npy(folder: Path) -> None:
    np.save(folder / "grid.npy", blocked_cells())
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


def _ascii_heights(folder: Path) -> None:
    lines = ["ncols 16", "nrows 12", "xllcorner 0", "yllcorner 0", "cellsize 1", "NODATA_value -9999"]
    lines += [" ".join([f"{0.5 * row:.2f}"] * 16) for row in range(12)]
    (folder / "heights.asc").write_text("\n".join(lines) + "\n")


def _cells(folder: Path) -> None:
    true = true_map(SheetFile.model_validate(SHEET))
    (folder / "printed.txt").write_text(format_cell_map(true.cells, 3600.0))
    (folder / "truth.txt").write_text(format_cell_map(CellMap.unknown(25, 25)))
    (folder / "robot.txt").write_text(format_cell_map(CellMap.unknown(25, 25), 3600.0))
    write_yaml(folder / "truth.yaml", SHEET)
    (folder / "track.json").write_text(json.dumps({"visited_cells": [[1, 1], [2, 2]], "grid": {"cells": 8}}))


DRAWN = (
    ("walls", write_walls, "walls.yaml", True),
    ("ros", write_ros, "pgm.yaml", True),
    ("map", _moving_ai, "grid.map", False),
    ("heights", _heights, "heights.json", True),
)
TARGETS: tuple[Target, ...] = (
    Target(
        "plan walls",
        write_walls,
        ("plan", "walls.yaml", *ENDS, "--set", "iterations=200"),
        ("walls.yaml",),
        True,
    ),
    Target("plan ros", write_ros, ("plan", "pgm.yaml", *ROOM), ("pgm.yaml",), True),
    Target("plan pgm", write_ros, ("plan", "pgm.yaml", *ROOM), ("grid.pgm",)),
    Target("plan png", write_ros, ("plan", "png.yaml", *ROOM), ("grid.png",)),
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
    Target(
        "plan heights asc",
        _ascii_heights,
        ("plan", "heights.asc", *ROOM, "--slope-limit", "60"),
        ("heights.asc",),
    ),
    Target("bench scen", _moving_ai, ("bench-scen", "grid.map", "grid.scen"), ("grid.scen", "grid.map")),
    Target("map-score text", _cells, ("map-score", "robot.txt", "truth.txt"), ("robot.txt", "truth.txt")),
    Target("map-score yaml", _cells, ("map-score", "printed.txt", "truth.yaml"), ("truth.yaml",), True),
    Target(
        "map-score visited",
        _cells,
        ("map-score", "printed.txt", "truth.yaml", "--visited", "track.json"),
        ("track.json",),
        True,
    ),
    *(
        Target(f"draw {kind}", write, ("draw", name, "--out", "drawn.png"), (name,), trees)
        for kind, write, name, trees in DRAWN
    ),
    Target("draw sheet", _cells, ("draw", "truth.yaml", "--out", "drawn.png"), ("truth.yaml",), True),
    *(
        Target(
            f"vectorize {kind}", write, ("vectorize", name, "--out", "made.yaml", *more), (damaged,), trees
        )
        for kind, write, name, damaged, more, trees in (
            ("ros", write_ros, "pgm.yaml", "pgm.yaml", (), True),
            ("cells", write_ros, "png.yaml", "grid.png", ("--tolerance", "0.6"), False),
            ("map", _moving_ai, "grid.map", "grid.map", (), False),
        )
    ),
)
