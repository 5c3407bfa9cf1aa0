"""``scans.npz``: what the robot saw, kept small for a replay: scans quantised, the beacons by their ids."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.config import FARTHEST_M
from pilotage.core.types import FloatArray, IntArray
from pilotage.records.arrays import Arrays, read_record, write_arrays
from pilotage.records.events import LATEST_S

SCANS_FILE = "scans.npz"
LEVELS = 65534
"""A range is a whole number of ``max_range_m / LEVELS``; 65535 says that nothing was in reach."""
NOTHING = 65535


def _empty() -> FloatArray:
    return np.empty(0)


def _no_ids() -> IntArray:
    return np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Sightings:
    """Scans and beacons seen.

    Attributes
    ----------
    scan_t_s, ranges_m
        (S,) times and (S, B) ranges of the scans that were kept, nan where nothing was in reach.
    scan_poses
        (S, 3) where the robot was then: truly, or where nobody knows that, as it believed; nan in folders of
        versions that did not keep it.
    scan_odometry
        (S, 4) time of the odometry's last reading then, and the pose that its readings alone lead to from the
        origin; (0, 4) without odometry, and in folders of versions that did not keep it.
    angles_rad, mount
        (B,) directions of the beams in the scanner's frame; (3,) pose of the scanner on the robot.
    beacon_counts, beacon_ids
        (N,) how many beacons each step saw, and their ids one after the other; None where the robot has no
        such sensor.
    max_range_m
        Of the scanner; ranges are kept in steps of ``max_range_m / LEVELS``.
    """

    scan_t_s: FloatArray = field(default_factory=_empty)
    ranges_m: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    scan_poses: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    scan_odometry: FloatArray = field(default_factory=lambda: np.empty((0, 4)))
    angles_rad: FloatArray = field(default_factory=_empty)
    mount: FloatArray = field(default_factory=lambda: np.zeros(3))
    beacon_counts: IntArray = field(default_factory=_no_ids)
    beacon_ids: IntArray = field(default_factory=_no_ids)
    max_range_m: float = np.nan


def sighting_arrays(sightings: Sightings) -> Mapping[str, Any]:
    """The file's arrays; empty without scans and beacons."""
    arrays: dict[str, Any] = {}
    if len(sightings.scan_t_s):
        resolution_m = sightings.max_range_m / LEVELS
        ranges = sightings.ranges_m
        hit = np.isfinite(ranges) & (ranges >= 0.0) & (ranges < sightings.max_range_m)
        levels = np.where(hit, np.rint(np.where(hit, ranges, 0.0) / resolution_m), NOTHING)
        arrays |= {
            "scan_t_s": sightings.scan_t_s,
            "scan_poses": sightings.scan_poses,
            "scan_ranges": levels.astype(np.uint16),
            "scan_resolution_m": np.array(resolution_m),
            "scan_angles_rad": sightings.angles_rad,
            "scan_mount": sightings.mount,
        }
    if len(sightings.scan_odometry):
        arrays |= {"scan_odometry": sightings.scan_odometry}
    if len(sightings.beacon_counts):
        arrays |= {
            "beacon_counts": sightings.beacon_counts.astype(np.uint16),
            "beacon_ids": sightings.beacon_ids.astype(np.int32),
        }
    return arrays


def write_sightings(folder: Path, sightings: Sightings) -> None:
    """Write the sightings; no file where there are none."""
    arrays = sighting_arrays(sightings)
    if arrays:
        write_arrays(folder / SCANS_FILE, arrays)


def read_sightings(folder: Path) -> Sightings:
    """Read the sightings; a part that the robot had no sensor for is empty; InputError as ``read_record``."""
    return read_record(folder / SCANS_FILE, _sightings, Sightings())


def _sightings(arrays: Arrays) -> Sightings:
    counts, ids = _beacons(arrays)
    return replace(_scans(arrays), beacon_counts=counts, beacon_ids=ids)


def _scans(arrays: Arrays) -> Sightings:
    if "scan_t_s" not in arrays:
        return Sightings()
    t_s, angles_rad = arrays.floats("scan_t_s", -1), arrays.floats("scan_angles_rad", -1)
    levels = arrays.ints("scan_ranges", len(t_s), len(angles_rad))
    poses, odometry = np.full((len(t_s), 3), np.nan), np.empty((0, 4))
    if "scan_poses" in arrays:
        poses = arrays.floats("scan_poses", len(t_s), 3)
    if "scan_odometry" in arrays:
        odometry = arrays.floats("scan_odometry", len(t_s), 4)
    mount, resolution_m = arrays.floats("scan_mount", 3), arrays.scalar("scan_resolution_m")
    if not all(np.isfinite(at).all() and (np.diff(at) >= 0.0).all() for at in (t_s, odometry[:, 0])):
        raise ValueError("expected scans in the order of time")
    if not (np.abs(t_s) <= LATEST_S).all():
        raise ValueError(f"scan_t_s: expected times within {LATEST_S} s")
    if not (np.abs(mount) <= FARTHEST_M).all() or not np.isfinite(angles_rad).all():
        raise ValueError("scan_mount, scan_angles_rad: expected finite numbers")
    if not (np.isnan(poses) | (np.abs(poses) <= FARTHEST_M)).all():
        raise ValueError(f"scan_poses: expected numbers within {FARTHEST_M:g}")
    if not (np.abs(odometry[:, 1:]) <= FARTHEST_M).all():
        raise ValueError(f"scan_odometry: expected numbers within {FARTHEST_M:g}")
    if not 0.0 < resolution_m * LEVELS <= FARTHEST_M or bool(((levels < 0) | (levels > NOTHING)).any()):
        raise ValueError(f"scan_ranges: expected numbers from 0 to {NOTHING} in steps of more than 0 m")
    return Sightings(
        scan_t_s=t_s,
        ranges_m=np.where(levels == NOTHING, np.nan, levels * resolution_m),
        scan_poses=poses,
        scan_odometry=odometry,
        angles_rad=angles_rad,
        mount=mount,
        max_range_m=resolution_m * LEVELS,
    )


def _beacons(arrays: Arrays) -> tuple[IntArray, IntArray]:
    if "beacon_counts" not in arrays:
        return _no_ids(), _no_ids()
    counts, ids = arrays.ints("beacon_counts", -1), arrays.ints("beacon_ids", -1)
    if bool((counts < 0).any()) or int(np.minimum(counts, len(ids) + 1).sum()) != len(ids):
        raise ValueError(f"beacon_ids: expected as many as beacon_counts says, found {len(ids)}")
    return counts, ids
