"""Readers guided by coverage: ``python -m fuzz.guided READER [libFuzzer options]``; needs atheris."""

from __future__ import annotations

import importlib
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path

from pilotage.core.errors import InputError

Reader = Callable[[Path], object]


def _readers() -> dict[str, tuple[str, Reader]]:
    """Each reader with the name that its file has to have."""
    from pilotage.core.files import read_json, read_yaml
    from pilotage.core.files.arrays import map_npy, read_npz
    from pilotage.core.files.parquet import read_parquet
    from pilotage.logs.aer1513 import read_aer1513
    from pilotage.logs.carmen import read_carmen
    from pilotage.logs.heading_csv import read_heading_log
    from pilotage.logs.mrclam import read_barcodes, read_landmarks
    from pilotage.logs.odometry_csv import read_odometry_csv
    from pilotage.logs.reckoning_mat import read_reckoning_mat
    from pilotage.logs.steady_csv import read_steady_csv
    from pilotage.logs.trajectories import read_kitti, read_tum
    from pilotage.maps.cell_map_text import read_cell_map
    from pilotage.maps.elevation_file import read_elevation
    from pilotage.maps.grid_image import read_grey
    from pilotage.maps.landmark_table import read_landmark_table
    from pilotage.maps.moving_ai import read_moving_ai_map, read_scenario
    from pilotage.maps.ros_map import read_ros_map
    from pilotage.maps.true_cells import read_true_map

    return {
        "yaml": ("a.yaml", read_yaml),
        "json": ("a.json", read_json),
        "npy": ("a.npy", map_npy),
        "npz": ("a.npz", read_npz),
        "parquet": ("a.parquet", read_parquet),
        "aer1513": ("a.mat", read_aer1513),
        "reckoning": ("a.mat", read_reckoning_mat),
        "carmen": ("a.log", read_carmen),
        "heading": ("gyro.csv", read_heading_log),
        "barcodes": ("Barcodes.dat", read_barcodes),
        "landmarks": ("Landmark_Groundtruth.dat", read_landmarks),
        "landmark-table": ("a.csv", read_landmark_table),
        "odometry": ("a.csv", read_odometry_csv),
        "steady": ("a.csv", read_steady_csv),
        "tum": ("a.txt", read_tum),
        "kitti": ("a.txt", read_kitti),
        "cell-map": ("a.txt", read_cell_map),
        "true-map": ("a.yaml", read_true_map),
        "elevation": ("a.json", read_elevation),
        "ascii-grid": ("a.asc", read_elevation),
        "grey": ("a.png", read_grey),
        "moving-ai": ("a.map", read_moving_ai_map),
        "scenario": ("a.scen", read_scenario),
        "ros": ("a.yaml", read_ros_map),
    }


READERS = (
    *("yaml", "json", "npy", "npz", "parquet", "aer1513", "reckoning", "carmen", "heading", "barcodes"),
    *("landmarks", "landmark-table", "odometry", "steady", "tum", "kitti", "cell-map", "true-map"),
    *("elevation", "ascii-grid", "grey", "moving-ai", "scenario", "ros"),
)


SEEDS = {
    "yaml": ("run floor", "mission.yaml"),
    "json": ("plan heights json", "heights.json"),
    "npy": ("plan npy", "grid.npy"),
    "aer1513": ("localize aer1513", "packed.mat"),
    "reckoning": ("calibrate heading mat", "reckoning.mat"),
    "heading": ("calibrate heading", "gyro.csv"),
    "barcodes": ("localize mrclam", "drive/Barcodes.dat"),
    "landmarks": ("localize mrclam", "drive/Landmark_Groundtruth.dat"),
    "landmark-table": ("run terrain files", "landmarks.csv"),
    "odometry": ("calibrate odometry", "odometry.csv"),
    "steady": ("calibrate range", "range.csv"),
    "tum": ("evaluate tum", "a.tum"),
    "kitti": ("evaluate kitti", "a.kitti"),
    "cell-map": ("map-score text", "robot.txt"),
    "true-map": ("map-score yaml", "truth.yaml"),
    "elevation": ("plan heights json", "heights.json"),
    "ascii-grid": ("plan heights asc", "heights.asc"),
    "grey": ("plan png", "grid.png"),
    "moving-ai": ("plan map", "grid.map"),
    "scenario": ("bench scen", "grid.scen"),
    "ros": ("plan ros", "pgm.yaml"),
}
"""Use and file of a healthy input, from which a reader's fuzzing begins."""


def seed_of(reader: str) -> bytes:
    """A healthy input of a reader; a little text where there is none among the uses of commands."""
    from support.fuzz_targets import BY_NAME

    if reader not in SEEDS:
        return b"FLASER 3 1.0 2.0 3.0 0.1 0.2 0.3 1.1 1.2 1.3 1.5 host 1.5\n"
    use, name = SEEDS[reader]
    with tempfile.TemporaryDirectory() as folder:
        BY_NAME[use].write(Path(folder))
        return (Path(folder) / name).read_bytes()


def main() -> None:
    """Fuzz one reader; does not return."""
    atheris = importlib.import_module("atheris")
    with atheris.instrument_imports(include=["pilotage.core", "pilotage.logs", "pilotage.maps"]):
        name, reader = _readers()[sys.argv[1]]
    path = Path(tempfile.mkdtemp(prefix="pilotage-guided-")) / name

    def once(data: bytes) -> None:
        path.write_bytes(data)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                reader(path)
        except InputError as error:
            if "\n" in str(error) or not str(error).isprintable():
                raise RuntimeError("more than a line, or not for a terminal") from error

    atheris.Setup([sys.argv[0], *sys.argv[2:]], once)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
