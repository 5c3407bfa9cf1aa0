"""What the robot saw on its way, as ``scans.npz`` keeps it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pilotage.core.types import FloatArray, IntArray


def _empty() -> FloatArray:
    return np.empty(0)


@dataclass(frozen=True, slots=True)
class Sightings:
    """Scans and beacons seen.

    Attributes
    ----------
    scan_t_s, ranges_m
        (S,) times and (S, B) ranges of the scans that were kept, nan where nothing was in reach.
    angles_rad, mount
        (B,) directions of the beams in the scanner's frame; (3,) pose of the scanner on the robot.
    beacon_counts, beacon_ids
        (N,) how many beacons each step saw, and their ids one after the other.
    """

    scan_t_s: FloatArray = field(default_factory=_empty)
    ranges_m: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    angles_rad: FloatArray = field(default_factory=_empty)
    mount: FloatArray = field(default_factory=lambda: np.zeros(3))
    beacon_counts: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    beacon_ids: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))


def read_sightings(path: Path) -> Sightings:
    """Read ``scans.npz``; a part that the robot had no sensor for is empty.

    Raises
    ------
    KeyError, ValueError, OSError
        Where the file is not what a run writes.
    """
    with np.load(path, allow_pickle=False) as archive:
        arrays = {name: np.asarray(archive[name]) for name in archive.files}
    empty = Sightings()
    scan_t_s, ranges_m, angles_rad, mount = empty.scan_t_s, empty.ranges_m, empty.angles_rad, empty.mount
    counts, ids = empty.beacon_counts, empty.beacon_ids
    if "scan_t_s" in arrays:
        scan_t_s = arrays["scan_t_s"].astype(np.float64).reshape(-1)
        angles_rad = arrays["scan_angles_rad"].astype(np.float64).reshape(-1)
        levels = arrays["scan_ranges"].reshape(len(scan_t_s), len(angles_rad))
        ranges_m = np.where(levels == 65535, np.nan, levels * float(arrays["scan_resolution_m"]))
        mount = arrays["scan_mount"].astype(np.float64).reshape(3)
        if bool((np.diff(scan_t_s) < 0.0).any()):
            raise ValueError("expected scans in the order of time")
    if "beacon_counts" in arrays:
        counts = arrays["beacon_counts"].astype(np.int64).reshape(-1)
        ids = arrays["beacon_ids"].astype(np.int64).reshape(-1)
        if counts.sum() != len(ids):
            raise ValueError(f"expected {counts.sum()} beacon ids, found {len(ids)}")
    return Sightings(scan_t_s, ranges_m, angles_rad, mount, counts, ids)
