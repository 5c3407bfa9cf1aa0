"""Bags of each form as ``localize``, ``calibrate`` and ``evaluate`` read them."""

from __future__ import annotations

from pathlib import Path

from pilotage.bridges.ros.bag_files import write_mcap, write_ros1, write_ros2
from support.command_bags import commanded
from support.fuzz_targets.target import Target
from support.laser_bags import drive
from support.laser_bags import write_ros1 as write_laser_ros1

OUT = ("--out", "out", "--no-report")


def _lasers(folder: Path) -> None:
    """Scans of nothing: they are read, and their robot goes on by its odometry."""
    write_laser_ros1(folder / "a.bag", drive(scans=8))


def _commands(folder: Path) -> None:
    """As short as a calibration of commands may be."""
    messages = commanded(seconds=115, rate_hz=5)
    write_ros1(folder / "a.bag", messages)
    write_ros2(folder / "folder", messages)
    write_mcap(folder / "a.mcap", messages)


TOPICS = ("--topic", "/odom", "--topic", "/odom")
TARGETS: tuple[Target, ...] = (
    Target(
        "localize bag",
        _lasers,
        ("localize", "a.bag", "--map", "museum", "--start", "1,1,0", "--localizer", "dead-reckoning", *OUT),
        ("a.bag",),
        goes_on=(0,),
    ),
    Target(
        "calibrate bag",
        _commands,
        ("calibrate", "commands", "folder", *OUT),
        ("folder/folder.db3", "folder/metadata.yaml"),
        goes_on=(0,),
    ),
    Target("evaluate bag", _commands, ("evaluate", "a.mcap", "a.bag", *TOPICS), ("a.mcap",), goes_on=(0,)),
)
"""One form of bag each: that all forms are read alike is ``tests/unit/test_bag_recordings.py``'s."""
