"""Recordings of every form: localized, calibrated from, mapped, judged, tracked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.io import savemat

from pilotage.logs.odometry_csv import COLUMNS
from support.films import FilmScript, render_film
from support.fuzz_targets.target import Target
from support.laser_bags import drive, write_foreign_mcap, write_ros1, write_ros2
from support.laser_drives import laser_drive
from support.laser_rooms import along, furnished, recording
from support.mrclam_drives import Events, Robot, write_mrclam


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


def _film(folder: Path) -> None:
    render_film(folder / "film.avi", FilmScript(frames=12))


def _relations(folder: Path) -> None:
    """A drive along a line, and what is truly between some of its poses."""
    t_s = [100.0 + 0.5 * k for k in range(30)]
    rows = [f"{t:.6f} {0.1 * k:.4f} 0.0 0.0 0.0 0.0 0.0 1.0\n" for k, t in enumerate(t_s)]
    (folder / "trajectory.tum").write_text("".join(rows))
    pairs = [f"{t_s[k]:.6f} {t_s[k + 5]:.6f} 0.5 0.01 0 0 0 0.002\n" for k in range(0, 25, 3)]
    (folder / "true.relations").write_text("".join(pairs))


def _stops(folder: Path) -> None:
    """A rover that goes on by a metre a stop."""
    rng = np.random.default_rng(5)
    rows = ["sol,easting_m,northing_m,yaw_rad,mobtrav_id"]
    for k, (aside, slip) in enumerate(rng.normal(0, [0.05, 0.02], (120, 2))):
        rows += [f"{k // 2},{4.6e6 + k:.3f},{-2.7e5 + aside:.3f},1.57,{1.0 + slip:.4f}"]
    (folder / "stops.csv").write_text("\n".join(rows) + "\n")


def _laser(folder: Path) -> None:
    """A short drive with a laser in a CARMEN log, and settings of the mapper."""
    log = recording(furnished(), along([(1.5, 1.2), (3.5, 1.2)]), np.random.default_rng(5), beams=60)
    assert log.odometry is not None
    lines = []
    for k, (x, y, a) in enumerate(log.odometry):
        pose = f"{x:.5f} {y:.5f} {a:.5f}"
        beams = " ".join(f"{min(r, 81.0):.3f}" for r in log.ranges_m[k])
        lines.append(f"FLASER 60 {beams} {pose} {pose} {log.t_s[k]:.3f} host {log.t_s[k]:.3f}\n")
    (folder / "lab.log").write_text("".join(lines))
    (folder / "slam.yaml").write_text("keyframe_distance_m: 0.3\nmax_range_m: 20.0\n")


def _bags(folder: Path) -> None:
    """The same short drive in bags of each form."""
    whole = drive(scans=12)
    write_ros1(folder / "plain.bag", whole)
    write_ros1(folder / "packed.bag", whole, "bz2")
    write_ros2(folder / "folder", whole)
    write_ros2(folder / "zipped", whole, packing="MESSAGE")
    write_foreign_mcap(folder / "packed.mcap", whole)
    write_foreign_mcap(folder / "plain.mcap", whole, "NONE")


def _slam(*words: str) -> tuple[str, ...]:
    return ("slam", *words, "--out", "out", "--quiet", "--no-report")


BAGS = {
    "ros1": ("plain.bag", ("plain.bag",)),
    "ros1 packed": ("packed.bag", ("packed.bag",)),
    "ros2": ("folder", ("folder/folder.db3", "folder/metadata.yaml")),
    "ros2 packed": ("zipped", ("zipped/zipped.db3", "zipped/metadata.yaml")),
    "mcap": ("plain.mcap", ("plain.mcap",)),
    "mcap packed": ("packed.mcap", ("packed.mcap",)),
}
"""What is mapped, and which files are damaged."""

TARGETS: tuple[Target, ...] = (
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
    Target(
        "evaluate relations",
        _relations,
        ("evaluate", "trajectory.tum", "true.relations", "--relations"),
        ("trajectory.tum", "true.relations"),
    ),
    Target(
        "localize stops",
        _stops,
        (
            "localize",
            "stops.csv",
            "--format",
            "stops",
            "--out",
            "out",
            "--no-report",
        ),
        ("stops.csv",),
    ),
    Target("slam carmen", _laser, _slam("lab.log"), ("lab.log",)),
    Target(
        "slam settings", _laser, _slam("lab.log", "--config", "slam.yaml"), ("slam.yaml",), True, goes_on=(0,)
    ),
    *(
        Target(f"slam {form}", _bags, _slam(name), damaged, goes_on=(0,))
        for form, (name, damaged) in BAGS.items()
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
