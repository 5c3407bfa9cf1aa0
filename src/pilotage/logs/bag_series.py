"""What a bag says of one kind, as columns: poses, velocities, turn rates, magnetic fields, ranges, landmarks.

Times are those of the messages' headers, of receipt where they have none (a plain ``Twist``) or a driver left
them 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.logs.bag_kinds import FIELDS, LANDMARKS, POSES, RATES, ROWS
from pilotage.logs.bag_messages import OpenBag, read_through
from pilotage.logs.bag_topics import Kind, full_name, holds, pick
from pilotage.logs.bags import (
    ODOMETRY,
    TRANSFORM_TYPES,
    USUAL_BASES,
    USUAL_ODOMETRY_FRAMES,
)
from pilotage.logs.scanner_mount import LARGEST, TransformTree, frame_name
from pilotage.logs.trajectories import Trajectory3

MOUNTED = RATES, FIELDS, LANDMARKS
"""What is turned into the robot's frame: of several sensors on one topic that of the first is taken."""


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """What one topic says, in the order of time.

    Attributes
    ----------
    topic, frame
        Its name, and the frame of its first message; '' without one.
    t_s, values
        (N,) seconds and (N, C) as its kind has them.
    warnings
        What was chosen or passed over.
    """

    topic: str
    frame: str
    t_s: FloatArray
    values: FloatArray
    warnings: tuple[str, ...] = ()


def read_series(path: Path, kind: Kind, topic: str | None = None) -> Series:
    """Read one topic of a bag; of messages with the same time the later counts, but for landmarks.

    Raises
    ------
    InputError
        Where ``rosbags`` is missing, the path is no bag, or it holds no such topic; the message tells what
        it holds.
    """

    def read(bag: OpenBag) -> Series:
        said = list(bag.warnings)
        name = pick(bag, path, kind, topic, said)
        if name is None:
            wanted = str(kind) if kind.by_name_only else f"a topic of {kind}"
            raise InputError(f"{path}: expected {wanted}, {holds(bag.topics)}")
        return _series(bag, path, kind, name, said)

    return read_through(path, read)


def has(path: Path, kind: Kind) -> bool:
    """Whether a bag holds a topic of a kind."""
    return read_through(path, lambda bag: pick(bag, path, kind, None, []) is not None)


def topic_of(path: Path, topic: str) -> tuple[str, str]:
    """Name and type of a topic of a bag; InputError, telling what it holds, where it is not in it."""

    def read(bag: OpenBag) -> tuple[str, str]:
        found = next((t for t in bag.topics if full_name(t.name) == full_name(topic) and t.count), None)
        if found is None:
            raise InputError(f"{path}: expected the topic {full_name(topic)}, {holds(bag.topics)}")
        return found.name, found.msgtype

    return read_through(path, read)


def read_poses(path: Path, topic: str | None = None, kind: Kind = POSES) -> Series:
    """Poses (N, 7) of a topic, or of two frames of the transforms: ``/tf:map:base_link``.

    Raises
    ------
    InputError
        As ``read_series``; also where no transforms lead from the one frame to the other.
    """
    name, *frames = (topic or "").split(":")
    if not frames:
        return read_series(path, kind, topic)
    if len(frames) != 2 or not all(frames):
        raise InputError(f"{path}: topic {topic}: expected /tf:PARENT:CHILD for a pose out of the transforms")

    def read(bag: OpenBag) -> Series:
        names = {t.name for t in bag.topics if t.msgtype in TRANSFORM_TYPES}
        if full_name(name) not in {full_name(known) for known in names}:
            raise InputError(f"{path}: expected transforms in {full_name(name)}, {holds(bag.topics)}")
        return _of_transforms(bag, path, names, frame_name(frames[0]), frame_name(frames[1]))

    return read_through(path, read)


def read_odometry(path: Path, topic: str | None = None) -> Series:
    """Poses (N, 7) by the odometry: the topic, else the usual one, else the transforms of the usual frames.

    Raises
    ------
    InputError
        As ``read_poses``.
    """
    if topic is None and not has(path, ODOMETRY):
        found = _odometry_frames(path)
        if found is not None:
            return read_poses(path, found)
    return read_poses(path, topic, ODOMETRY)


def has_odometry(path: Path) -> bool:
    """Whether ``read_odometry`` finds any without being told where."""
    return has(path, ODOMETRY) or _odometry_frames(path) is not None


def _odometry_frames(path: Path) -> str | None:
    """The transforms that tell of odometry, as ``read_poses`` takes them; None where there are none."""

    def read(bag: OpenBag) -> str | None:
        names = [topic.name for topic in bag.topics if topic.msgtype in TRANSFORM_TYPES]
        moving = [name for name in names if not name.endswith("_static")]
        if not moving:
            return None
        tree = TransformTree()
        for _, _, message in bag.messages(set(names)):
            for transform in getattr(message, "transforms", ()):
                tree.add(transform)
        for parent in USUAL_ODOMETRY_FRAMES:
            for child in USUAL_BASES:
                if tree.chain(parent, child) is not None:
                    return f"{moving[0]}:{parent}:{child}"
        return None

    return read_through(path, read)


def trajectory_of_bag(path: Path, topic: str | None = None) -> Trajectory3:
    """A topic of poses, or two frames of the transforms, as a path in space.

    Raises
    ------
    InputError
        As ``read_poses``.
    """
    found = read_poses(path, topic)
    turns = np.asarray(
        scipy.spatial.transform.Rotation.from_quat(found.values[:, 3:]).as_matrix(), dtype=np.float64
    )
    return Trajectory3(found.t_s, found.values[:, :3].copy(), turns)


def headings(poses: FloatArray) -> FloatArray:
    """Planar poses (N, 3) of poses in space (N, 7)."""
    x, y, z, w = poses[:, 3:].T
    turn = np.arctan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return np.column_stack([poses[:, :2], turn])


def mount_matrix(path: Path, base: str, sensor: str) -> FloatArray | None:
    """(4, 4) pose of a sensor's frame in the robot's by a bag's transforms; None where none lead there."""

    def read(bag: OpenBag) -> FloatArray | None:
        tree = TransformTree()
        names = {topic.name for topic in bag.topics if topic.msgtype in TRANSFORM_TYPES}
        for _, _, message in bag.messages(names):
            for transform in getattr(message, "transforms", ()):
                tree.add(transform)
        found = tree.chain(frame_name(base), frame_name(sensor))
        return None if found is None else found[0]

    return read_through(path, read)


def landmarks_in_base(path: Path, topic: str | None, bases: Sequence[str]) -> Series:
    """Landmarks as the robot's frame has them, x ahead and y to the left, by the transforms.

    They lead from one of the frames ``bases``; a warning tells where none do.

    Raises
    ------
    InputError
        As ``read_series``.
    """
    found = read_series(path, LANDMARKS, topic)
    matrix = next((m for base in bases if (m := mount_matrix(path, base, found.frame)) is not None), None)
    if matrix is None:
        said = (
            f"no transforms from {' or '.join(bases)} to the frame '{found.frame}' of {found.topic}: x is "
            "taken to look ahead and y to the left"
        )
        return Series(found.topic, found.frame, found.t_s, found.values, (*found.warnings, said))
    places = found.values[:, 1:] @ matrix[:3, :3].T + matrix[:3, 3]
    rows = np.column_stack([found.values[:, :1], places])
    return Series(found.topic, found.frame, found.t_s, rows, found.warnings)


def _series(bag: OpenBag, path: Path, kind: Kind, name: str, said: list[str]) -> Series:
    rows_of = ROWS[kind.what]
    times: list[float] = []
    rows: list[tuple[float, ...]] = []
    frame, damaged = "", 0
    elsewhere: dict[str, int] = {}
    for _, time_ns, message in bag.messages({name}):
        try:
            for header, row in rows_of(message):
                seen_from = "" if header is None else frame_name(header.frame_id)
                frame = frame or seen_from
                if kind in MOUNTED and seen_from not in {"", frame}:
                    elsewhere[seen_from] = elsewhere.get(seen_from, 0) + 1
                    continue
                times.append(_seconds(header, time_ns))
                rows.append(row)
        except (AttributeError, TypeError, ValueError, OverflowError, IndexError):
            damaged += 1  # None, or what a damaged definition made of it
    t_s, values = np.array(times), np.array(rows, dtype=np.float64)
    fine = np.isfinite(t_s) if not rows else np.isfinite(t_s) & np.isfinite(values).all(axis=1)
    if rows:
        sane = ~(np.abs(values) > LARGEST).any(axis=1)
        damaged += int(np.sum(fine & ~sane))
        fine &= sane
    if damaged:
        said.append(f"{damaged} messages of {name} that cannot be read were passed over")
    for other, count in elsewhere.items():
        said.append(
            f"{count} of the {kind.what} in {name} are another sensor's, in the frame '{other}': those in "
            f"'{frame}' are taken"
        )
    if not fine.any():
        raise InputError(f"{path}: expected {kind.what} in {name}, found none that can be read")
    t_s, values = t_s[fine], values[fine]
    order = np.argsort(t_s, kind="stable")
    t_s, values = t_s[order], values[order]
    if kind is not LANDMARKS:
        last = np.append(np.diff(t_s) > 0.0, True)
        t_s, values = t_s[last], values[last]
    return Series(full_name(name), frame, t_s, values, tuple(said))


def _seconds(header: Any, time_ns: int) -> float:
    if header is None or (header.stamp.sec == 0 and header.stamp.nanosec == 0):
        return time_ns * 1e-9
    return float(header.stamp.sec) + 1e-9 * float(header.stamp.nanosec)


def _of_transforms(bag: OpenBag, path: Path, names: set[str], parent: str, child: str) -> Series:
    """The pose at each time that one of the transforms between the two frames is told anew."""
    tree, times, rows = TransformTree(), [], []
    for _, time_ns, message in bag.messages(names):
        for transform in getattr(message, "transforms", ()):
            moved = frame_name(transform.child_frame_id)
            tree.parents.pop(moved, None)
            tree.moved.discard(moved)
            tree.add(transform)
            found = tree.chain(parent, child)
            if found is None or not _lies_between(tree, moved, child, parent):
                continue
            matrix = found[0]
            half = 0.5 * math.atan2(matrix[1, 0], matrix[0, 0])
            times.append(_seconds(transform.header, time_ns))
            rows.append((*matrix[:3, 3].tolist(), 0.0, 0.0, math.sin(half), math.cos(half)))
    if not rows:
        frames = ", ".join(sorted({*tree.parents, *(known for known, _ in tree.parents.values())})) or "none"
        raise InputError(
            f"{path}: expected transforms from '{parent}' to '{child}', found the frames {frames}"
        )
    t_s, values = np.array(times), np.array(rows)
    order = np.argsort(t_s, kind="stable")
    t_s, values = t_s[order], values[order]
    last = np.append(np.diff(t_s) > 0.0, True)
    return Series(f"/tf:{parent}:{child}", parent, t_s[last], values[last])


def _lies_between(tree: TransformTree, moved: str, child: str, parent: str) -> bool:
    """Whether a transform's frame is on the way from one frame to the other."""
    for frame in (child, parent):
        seen: set[str] = set()
        while frame in tree.parents and frame not in seen:
            if frame == moved:
                return True
            seen.add(frame)
            frame = tree.parents[frame][0]
    return False
