"""``updates.npz``: updates by scans explained: what was seen, matched, accepted, and why not."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.scan_update import LineVerdict, ScanUpdate
from pilotage.core.types import Pose2
from pilotage.records.arrays import Arrays, read_record, write_arrays
from pilotage.records.plans import places
from pilotage.records.reading import clean_text

UPDATES_FILE = "updates.npz"
VERDICTS = tuple(LineVerdict)
"""In the order in which the file numbers them."""


@dataclass(frozen=True, slots=True)
class KeptUpdate:
    """An update worth a picture: when it was, why it was kept, and what it was, in the sensor's frame."""

    t_s: float
    why: str
    update: ScanUpdate


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedUpdate(ScanUpdate):
    """One update as it is drawn, when it was and why it was kept.

    All is in the map frame as it was believed before the update, the points and lines as well.
    """

    t_s: float
    why: str


def update_arrays(updates: Iterable[KeptUpdate]) -> Mapping[str, Any]:
    """The file's arrays; empty without any update."""
    arrays: dict[str, Any] = {}
    for k, kept in enumerate(updates):
        update = kept.update
        arrays |= {
            f"t_s_{k}": np.array(kept.t_s),
            f"why_{k}": np.array(kept.why),
            f"sensor_pose_{k}": update.sensor_pose,
            f"sensor_pose_after_{k}": update.sensor_pose_after,
            f"points_m_{k}": update.points_m.astype(np.float32),
            f"clusters_{k}": update.clusters.astype(np.int16),
            f"members_{k}": update.members.astype(np.int16),
            f"ends_m_{k}": update.ends_m,
            f"walls_m_{k}": update.walls_m,
            f"distances_{k}": update.distances,
            f"gate_{k}": np.array(update.gate),
            f"verdicts_{k}": np.array([VERDICTS.index(v) for v in update.verdicts], dtype=np.int16),
        }
    return arrays


def write_updates(folder: Path, updates: Iterable[KeptUpdate]) -> None:
    """Write the updates; no file where there are none."""
    arrays = update_arrays(updates)
    if arrays:
        write_arrays(folder / UPDATES_FILE, arrays)


def read_updates(folder: Path) -> tuple[RecordedUpdate, ...]:
    """Read the updates; none where there is no such file; InputError as ``read_record``."""
    return read_record(folder / UPDATES_FILE, _updates, ())


def _updates(arrays: Arrays) -> tuple[RecordedUpdate, ...]:
    updates: list[RecordedUpdate] = []
    while f"t_s_{len(updates)}" in arrays:
        updates.append(_update(arrays, len(updates)))
    return tuple(updates)


def _update(arrays: Arrays, k: int) -> RecordedUpdate:
    before, after = arrays.floats(f"sensor_pose_{k}", 3), arrays.floats(f"sensor_pose_after_{k}", 3)
    ends, points = places(arrays, f"ends_m_{k}", (4,)), places(arrays, f"points_m_{k}", (2,))
    lines, count = len(ends), len(points)
    verdicts = arrays.ints(f"verdicts_{k}", lines)
    clusters, members = arrays.ints(f"clusters_{k}", count), arrays.ints(f"members_{k}", count)
    if not (np.isfinite(before).all() and np.isfinite(after).all()):
        raise ValueError(f"sensor_pose_{k}: expected finite numbers")
    if bool(((verdicts < 0) | (verdicts >= len(VERDICTS))).any()):
        raise ValueError(f"verdicts_{k}: expected numbers below {len(VERDICTS)}")
    if bool(((members < -1) | (members >= lines)).any()) or bool((clusters < -1).any()):
        raise ValueError(f"members_{k}: expected numbers of lines, or -1")
    walls = places(arrays, f"walls_m_{k}", (4,))
    if len(walls) != lines:
        raise ValueError(f"walls_m_{k}: expected {lines} rows, found {len(walls)}")
    sensor = Pose2.from_array(before)
    return RecordedUpdate(
        t_s=arrays.scalar(f"t_s_{k}"),
        why=clean_text(arrays.word(f"why_{k}")),
        sensor_pose=before,
        sensor_pose_after=after,
        points_m=sensor.placed(points),
        clusters=clusters,
        members=members,
        ends_m=sensor.placed(ends.reshape(-1, 2)).reshape(-1, 4),
        walls_m=walls,
        distances=arrays.floats(f"distances_{k}", lines),
        gate=arrays.scalar(f"gate_{k}"),
        verdicts=tuple(VERDICTS[v] for v in verdicts),
    )
