"""Any recording of a laser: bags and CARMEN logs, told apart by what they are and not by their names."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pilotage.core.errors import InputError
from pilotage.logs.bag_messages import is_bag
from pilotage.logs.bags import read_bag
from pilotage.logs.carmen_laser import read_carmen_scans
from pilotage.logs.laser_log import LaserLog


def read_laser_log(
    path: Path,
    scan_topic: str | None = None,
    odometry_topic: str | None = None,
    topics: Sequence[str] = (),
) -> LaserLog:
    """Read a ROS 1 bag, a ROS 2 bag, an MCAP file or a CARMEN log (plain or gzipped).

    Raises
    ------
    InputError
        Where it is none of them, cannot be read, holds no scans, or topics are asked of a CARMEN log.
    """
    if not path.exists():
        raise InputError(f"{path}: expected a recording, found no such file")
    if path.is_dir() or is_bag(path):
        return read_bag(path, scan_topic, odometry_topic, topics)
    if scan_topic is not None or odometry_topic is not None or topics:
        raise InputError(
            f"{path}: expected a bag where topics are named, found none: CARMEN logs have no topics"
        )
    return read_carmen_scans(path)
