"""What pilotage left: runs and studies, reported on, exported, gone on with."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from support.fuzz_targets import recordings
from support.fuzz_targets.missions import write_floor
from support.fuzz_targets.target import QUICK, SHORT, Target, write_yaml
from support.laser_rooms import along, furnished, recording, write_carmen
from support.outcome import run


def _run_folder(folder: Path) -> None:
    write_floor(folder)
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
    write_yaml(folder / "study.yaml", definition)


def _study_folder(folder: Path) -> None:
    _study(folder)
    assert run((*STUDY, "--workers", "1"), folder).code == 0
    (made,) = (folder / "studies").iterdir()
    made.rename(folder / "done")


def _slam_folder(folder: Path) -> None:
    BY_WRITER["slam carmen"].write(folder)
    assert run(BY_WRITER["slam carmen"].words, folder).code == 0
    (made,) = (folder / "out").iterdir()
    made.rename(folder / "mapped")
    t_s = [row.split()[0] for row in (folder / "mapped" / "trajectory.tum").read_text().splitlines()]
    rows = [f"{a} {b} 0.4 0.0 0 0 0 0.0\n" for a, b in zip(t_s[:-5:3], t_s[5::3], strict=False)]
    (folder / "true.relations").write_text("".join(rows))


def _map_and_recording(folder: Path) -> None:
    """A map, and a recording that goes round in it again."""
    corners = [(1.5, 1.2), (5.0, 1.2), (5.0, 4.0), (2.0, 4.0), (1.5, 1.2)]
    simulated = recording(furnished(), along(corners, 0.15, 0.2), np.random.default_rng(5), beams=91)
    write_carmen(folder / "lab.log", simulated)
    assert run(("slam", "lab.log", *SHORT), folder).code == 0
    (made,) = (folder / "out").iterdir()
    made.rename(folder / "mapped")


def _calibrated(folder: Path) -> None:
    target = BY_WRITER["calibrate odometry"]
    target.write(folder)
    assert run(target.words, folder).code == 0
    (made,) = (folder / "out").iterdir()
    made.rename(folder / "calibrated")


BY_WRITER = {target.name: target for target in recordings.TARGETS}
STUDY = ("study", "study.yaml", "--no-report", "--quiet")
RUN_FILES = ("metrics.json", "events.jsonl", "world.json", "mission.yaml", "trace.parquet", "scans.npz")
TARGETS: tuple[Target, ...] = (
    Target(
        "report run",
        _run_folder,
        ("report", "run"),
        ("run/metrics.json", "run/events.jsonl", "run/world.json", "run/mission.yaml"),
        True,
        goes_on=(0,),
    ),
    Target(
        "report run arrays",
        _run_folder,
        ("report", "run"),
        ("run/trace.parquet", "run/scans.npz"),
        goes_on=(0,),
    ),
    Target(
        "study",
        _study,
        ("study", "study.yaml", "--workers", "1", "--no-report", "--quiet"),
        ("study.yaml",),
        True,
    ),
    *(
        Target(
            f"export {to}",
            _run_folder,
            ("export", "run", "--to", to, "--out", name),
            tuple(f"run/{file}" for file in RUN_FILES),
            goes_on=(0,),
        )
        for to, name in (
            ("mcap", "a.mcap"),
            ("rosbag", "a.bag"),
            ("csv", "a.csv"),
            ("tum", "tum"),
            ("rerun", "a.rrd"),
        )
    ),
    Target(
        "slam run", _run_folder, ("slam", "run", *SHORT), ("run/trace.parquet", "run/scans.npz"), goes_on=(0,)
    ),
    Target(
        "evaluate slam",
        _slam_folder,
        ("evaluate", "mapped/trajectory.tum", "mapped/before.tum"),
        ("mapped/trajectory.tum", "mapped/before.tum"),
    ),
    Target(
        "evaluate slam relations",
        _slam_folder,
        ("evaluate", "mapped/trajectory.tum", "true.relations", "--relations"),
        ("mapped/keyframes.npz", "mapped/covariances.npz", "true.relations"),
        goes_on=(0,),
    ),
    Target(
        "report slam",
        _slam_folder,
        ("report", "mapped"),
        tuple(
            f"mapped/{file}"
            for file in (
                "metrics.json",
                "closures.json",
                "before.tum",
                "keyframes.npz",
                "covariances.npz",
                "map.yaml",
            )
        ),
        True,
        goes_on=(0,),
    ),
    Target(
        "extend slam",
        _map_and_recording,
        ("slam", "lab.log", "--extend", "mapped", *SHORT),
        ("mapped/keyframes.npz", "mapped/covariances.npz"),
    ),
    Target(
        "plan slam",
        _slam_folder,
        ("plan", "mapped/map.yaml", "--start", "0.5,0", "--goal", "1.5,0"),
        ("mapped/map.yaml", "mapped/map.pgm"),
    ),
    Target(
        "report calibration",
        _calibrated,
        ("report", "calibrated"),
        ("calibrated/calibration.json", "calibrated/data.npz"),
        True,
        goes_on=(0,),
    ),
    Target("report study", _study_folder, ("report", "done"), ("done/study.yaml",), True),
    Target("report study rows", _study_folder, ("report", "done"), ("done/trials.sqlite",)),
    Target(
        "study on",
        _study_folder,
        ("study", "done", "--resume", "--no-report", "--quiet"),
        ("done/study.yaml", "done/trials.sqlite"),
    ),
    Target(
        "run from",
        _study_folder,
        ("run", "--from", "done:1", *SHORT),
        ("done/study.yaml", "done/trials.sqlite"),
        goes_on=(0, 1),
    ),
)
