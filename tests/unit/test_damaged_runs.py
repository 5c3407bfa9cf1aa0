"""A corpus of damaged run folders through ``pilotage report``: a page or one line, never more than that.

Of all the ways some are drawn, and up to nine of them befall nine files of one folder: a page tells of each
file that it was made without, and to draw a page is what takes time. Where one makes the folder no run at
all, the others are tried again without it. ``PILOTAGE_DAMAGED_RUNS=1`` takes all ways, each by itself.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import savemat

from pilotage.cli.main import main
from pilotage.experiments.mission import load_mission
from pilotage.experiments.recordings.localize import localize_log
from pilotage.experiments.run import run_mission
from pilotage.logs.odometry_csv import COLUMNS
from pilotage.records.arrays import write_arrays
from support.damaged_runs import Damage, damages
from support.fabricated_run import fabricate_run
from support.laser_drives import laser_drive

DRAWN, AT_ONCE = 18, 9
"""Of each kind of folder; PILOTAGE_DAMAGED_RUNS tries all damages, the fuzz tests draw others."""


def a_floor(folder: Path) -> Path:
    run = fabricate_run(folder / "run", steps=30)
    levels = np.arange(30, dtype=np.uint16).reshape(3, 10) * 1000
    arrays = {
        "scan_t_s": np.arange(3.0),
        "scan_poses": np.zeros((3, 3)),
        "scan_ranges": levels,
        "scan_resolution_m": np.array(1e-4),
        "scan_angles_rad": np.linspace(-1.0, 1.0, 10),
        "scan_mount": np.zeros(3),
        "beacon_counts": np.ones(30, np.uint16),
        "beacon_ids": np.ones(30, np.int32),
    }
    write_arrays(run / "scans.npz", arrays)
    return run


def a_run_by_walls(folder: Path) -> Path:
    return driven(folder, "museum-walls", "run.time_limit_s=4")


def a_sheet(folder: Path) -> Path:
    return driven(folder, "romi-explore", "run.time_limit_s=8")


def a_drive_on_terrain(folder: Path) -> Path:
    from PIL import Image

    pixels = np.zeros((40, 60), np.uint8)
    pixels[3:, 30] = 255
    Image.fromarray(pixels).save(folder / "obstacles.png")
    ground = ["world.map.name=images", f"world.map.obstacles={folder / 'obstacles.png'}"]
    start = ["world.start.x_m=55", "world.start.y_m=45", "world.goal.x_m=545", "world.goal.y_m=45"]
    marks = ["world.landmarks=[{id: 7, x_m: 100, y_m: 200}, {id: 3, x_m: 400, y_m: 300}]"]
    return driven(folder, "gale-astar-ekf", *ground, *start, *marks)


def a_recording(folder: Path) -> Path:
    savemat(folder / "d.mat", laser_drive(rows=200))
    return localize_log(folder / "d.mat", folder, form="aer1513").run_dir


def a_calibration(folder: Path) -> Path:
    rng = np.random.default_rng(0)
    rows = [",".join(COLUMNS)]
    for x, claimed in zip(0.1 * np.arange(300.0), 0.1 + rng.normal(0.0, 3e-3, 300), strict=True):
        rows += [f"{x:.1f},{x + claimed:.6f},0,0,{x + 0.1:.1f},0,0"]
    (folder / "a.csv").write_text("\n".join(rows) + "\n")
    words = ["calibrate", "odometry", str(folder / "a.csv"), "--out", str(folder / "out"), "--no-report"]
    assert main(words) == 0
    (run,) = (folder / "out").iterdir()
    return run


@pytest.mark.parametrize(
    ("make", "columns", "value"),
    [(a_drive_on_terrain, ["ref_x_m"], -1e4), (a_recording, ["speed_error"], np.nan)],
)
def test_a_column_that_is_elsewhere_or_says_nothing(
    make: Callable[[Path], Path], columns: list[str], value: float, tmp_path: Path
) -> None:
    """The window of a curve beside the map had no size, an error of which no value is known no line."""
    run = make(tmp_path)
    table = pq.read_table(run / "trace.parquet")
    for name in columns:
        values = value + table[name].to_numpy()
        table = table.set_column(table.column_names.index(name), name, pa.array(values))
    pq.write_table(table, run / "trace.parquet")
    assert main(["report", str(run)]) == 0


def driven(folder: Path, mission: str, *settings: str) -> Path:
    run = run_mission(load_mission(mission, [*settings], 1), out=folder / "runs").run_dir
    assert run is not None
    return run


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
@pytest.mark.parametrize(
    ("make", "seed"),
    [
        (a_floor, 1),
        (a_run_by_walls, 2),
        (a_sheet, 3),
        (a_drive_on_terrain, 4),
        (a_recording, 5),
        (a_calibration, 6),
    ],
)
def test_a_report_of_a_damaged_folder_is_a_page_or_one_line(
    make: object, seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert callable(make)
    whole = make(tmp_path)
    rng = np.random.default_rng(seed)
    cases = list(damages(whole, rng))
    groups = [[case] for case in cases]
    if not os.environ.get("PILOTAGE_DAMAGED_RUNS"):
        groups = in_groups([cases[k] for k in rng.choice(len(cases), DRAWN, replace=False)])
    while groups:
        group = groups.pop()
        names = ", ".join(name for name, _ in group)
        run = tmp_path / "damaged"
        shutil.copytree(whole, run)
        for _, damage in group:
            damage(run)
        capsys.readouterr()
        code = main(["report", str(run)])
        said = capsys.readouterr()
        assert code in (0, 2), f"{names}: {said.err}"
        assert said.err.count("\n") <= 1, f"{names}: {said.err}"
        assert said.err.isprintable() or said.err[:-1].isprintable(), names
        assert (run / "report.html").exists() == (code == 0), names
        assert not [path for path in run.iterdir() if path.name.startswith(".")], names
        shutil.rmtree(run)
        if code == 2 and len(group) > 1:
            blamed = next((case for case in group if file_of(case) in said.err), group[0])
            groups.append([case for case in group if case is not blamed])


def file_of(case: tuple[str, Damage]) -> str:
    """The damaged one's name."""
    return next(word for word in re.split(r"[ :]+", case[0]) if "." in word)


def in_groups(cases: list[tuple[str, Damage]]) -> list[list[tuple[str, Damage]]]:
    """Of different files each, at most ``AT_ONCE``."""
    groups: list[list[tuple[str, Damage]]] = []
    for case in cases:
        for group in groups:
            if len(group) < AT_ONCE and file_of(case) not in map(file_of, group):
                group.append(case)
                break
        else:
            groups.append([case])
    return groups


def test_names_with_markup_stay_inert(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    attack = "<script>alert(1)<!--'\"><img src=x onerror=alert(2)>"
    columns = {f"us_{attack}_m": np.ones(20), f"{attack}_m": np.ones(20), "nis_dof": None}
    plans = dict(np.load(fabricate_run(tmp_path / "plain", steps=20) / "plans.npz"))
    run = fabricate_run(
        tmp_path / attack.replace("/", ""),
        steps=20,
        columns=columns,
        plans=plans | {attack: np.zeros(3)},
        mission=f"mission: |-\n  {attack}\ndescription: |-\n  {attack}\n",
        metrics={attack: {attack: 1.0}, "mission": attack, "seed": attack, "reason": attack},
        events=[{"t_s": 0.5, "kind": attack, "text": attack}],
    )
    (run / "world.json").write_text(f'{{"{attack[:8]}": [')
    assert main(["report", str(run)]) == 0
    said = capsys.readouterr()
    assert said.err.count("\n") == 1
    page = (run / "report.html").read_text()
    assert "<script>alert" not in page
    assert "<img src=x" not in page
    assert "world.json" in page
