"""Recordings of buildings, mapped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pilotage.core import given
from pilotage.core.errors import InputError
from pilotage.core.given import FilePath
from pilotage.core.interruptions import interruptible
from pilotage.face.metrics import Metrics
from pilotage.logs.trajectories import Trajectory3, TrajectoryFormat, read_trajectory


@dataclass(frozen=True, slots=True, eq=False)
class MappedLog:
    """What SLAM made of a recording.

    Attributes
    ----------
    folder
        Map (a ROS map), trajectory (TUM), pose graph (g2o), covariances, closures.
    metrics
        Numbers by key.
    trajectory
        Times and poses of the scans.
    warnings
        What one should know.
    """

    folder: Path
    metrics: Metrics
    trajectory: Trajectory3 = field(repr=False)
    warnings: tuple[str, ...]

    @property
    def map(self) -> Path:
        """The map as a ROS map's YAML file, to plan and to drive on."""
        return self.folder / "map.yaml"

    def report(self) -> Path:
        """Write its page and return the path."""
        from pilotage.report.slam.page import write_slam_report

        return write_slam_report(self.folder)


@interruptible()
def slam(
    log: FilePath,
    *,
    config: FilePath | None = None,
    topics: Sequence[str] = (),
    extend: FilePath | None = None,
    out: FilePath = "runs",
) -> MappedLog:
    """Map a recording of a building that nobody has mapped.

    Parameters
    ----------
    log
        A ROS bag, an MCAP file or a CARMEN log with scans and odometry, or the folder of a run with a LiDAR.
    config
        A YAML file of the few parameters; None: as shipped.
    topics
        A bag's scans and odometry by name, where the usual ones are not meant.
    extend
        Folder of an earlier ``slam``: the recording, which may begin anywhere, is joined to its map.

    Raises
    ------
    InputError
        What of the log or of the earlier folder cannot be used, or why nothing joins the two.
    """
    from pilotage.experiments.slam import read_slam_config, slam_log

    settings = read_slam_config(None if config is None else given.path("config", config))
    earlier = None if extend is None else given.path("extend", extend)
    recording, asked = given.path("log", log), given.words("topics", topics)
    run = slam_log(recording, given.folder("out", out), settings, topics=asked, extend=earlier)
    if run.run_dir is None:
        raise InputError(f"{log}: {run.metrics['reason']}")
    trajectory = read_trajectory(run.run_dir / "trajectory.tum", TrajectoryFormat.TUM)
    return MappedLog(run.run_dir, Metrics(run.metrics), trajectory, run.warnings)
