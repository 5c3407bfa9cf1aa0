"""Laser scans and odometry of ROS 1 bags, ROS 2 bags and MCAP files (extra ``ros``).

Times are those of the messages' headers (of receipt where a driver left them 0). Odometry is the first topic
of ``nav_msgs/Odometry``, else the transforms of a frame that moves above the scanner's. Poses in space are
laid on the floor: x, y and the heading remain.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.files.arrays import quiet
from pilotage.core.types import FloatArray
from pilotage.logs.bag_messages import OpenBag, read_through
from pilotage.logs.bag_topics import Kind, holds, pick, sorted_out
from pilotage.logs.laser_log import LaserLog, RawScan, assemble
from pilotage.logs.scanner_mount import TransformTree, frame_name, mount_of

ODOMETRY_TYPE = "nav_msgs/msg/Odometry"
USUAL_TRUTH = ("/truth", "/ground_truth", "/ground_truth/odom", "/base_pose_ground_truth")
"""What a motion capture or a simulator usually calls what the robot does not know."""
SCANS = Kind("laser scans", ("sensor_msgs/msg/LaserScan",), ("/scan",))
ODOMETRY = Kind("odometry", (ODOMETRY_TYPE,), ("/odom",), never=USUAL_TRUTH)
TRANSFORM_TYPES = frozenset({"tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"})
USUAL_BASES = ("base_footprint", "base_link")
USUAL_ODOMETRY_FRAMES = ("odom", "odom_combined")
"""Frames of REP 105, for odometry that was recorded as transforms only."""


def read_bag(
    path: Path,
    scan_topic: str | None = None,
    odometry_topic: str | None = None,
    topics: Sequence[str] = (),
) -> LaserLog:
    """Read the scans and the odometry of a bag.

    A bag that is cut or damaged is read as far as it goes; the log's ``warnings`` say so.

    Parameters
    ----------
    path
        ``.bag``, ``.db3``, ``.mcap`` (told by their first bytes), or the folder of a ROS 2 bag.
    scan_topic, odometry_topic
        By default the only ones of their types; of several, ``/scan`` and ``/odom``, else those with most
        messages.
    topics
        The same by name alone: each is what its type says.

    Raises
    ------
    InputError
        Where ``rosbags`` is missing, the path is no bag, or the topics are not in it; the message then
        tells what it holds.
    """

    def read(bag: OpenBag) -> LaserLog:
        scan, odometry = sorted_out(bag, path, topics, (SCANS, ODOMETRY))
        return _collect(bag, path, _pick(bag, path, scan_topic or scan, odometry_topic or odometry))

    return read_through(path, read)


@dataclass(frozen=True, slots=True)
class _Picked:
    scan: str
    odometry: str | None
    transforms: tuple[str, ...]
    warnings: tuple[str, ...]


def _pick(bag: OpenBag, path: Path, scan_topic: str | None, odometry_topic: str | None) -> _Picked:
    said = list(bag.warnings)
    scan = pick(bag, path, SCANS, scan_topic, said)
    if scan is None:
        raise InputError(f"{path}: expected a topic of {SCANS}, {holds(bag.topics)}")
    odometry = pick(bag, path, ODOMETRY, odometry_topic, said)
    transforms = tuple(topic.name for topic in bag.topics if topic.msgtype in TRANSFORM_TYPES)
    return _Picked(scan, odometry, transforms, tuple(said))


@dataclass(slots=True)
class _Collected:
    scans: list[RawScan] = field(default_factory=list)
    scan_frame: str = ""
    base_frame: str = ""
    odometry_t_s: list[float] = field(default_factory=list)
    odometry: list[tuple[float, float, float]] = field(default_factory=list)
    tree: TransformTree = field(default_factory=TransformTree)
    tf_odometry: list[tuple[str, float, float, float, float]] = field(default_factory=list)
    damaged: int = 0
    unstamped: int = 0
    elsewhere: dict[str, int] = field(default_factory=dict)
    """How many scans have which other frames: another scanner's, whose mount is another one."""


def _collect(bag: OpenBag, path: Path, picked: _Picked) -> LaserLog:
    found = _Collected()
    static = {name for name in picked.transforms if name.endswith("static")}
    moving = set(picked.transforms) - static
    _read(bag, picked, {picked.scan, *static} | ({picked.odometry} if picked.odometry else set()), found)
    # The moving transforms are as many as the odometry: they are read only where they are needed.
    if moving and (not found.odometry or found.tree.chain(found.base_frame, found.scan_frame) is None):
        _read(bag, picked, moving, found)
    said = list(picked.warnings)
    if found.damaged:
        said.append(f"{found.damaged} messages that cannot be read were passed over")
    for frame, count in found.elsewhere.items():
        said.append(
            f"{count} scans of {picked.scan} are another scanner's, in the frame '{frame}': those in "
            f"'{found.scan_frame}' are taken"
        )
    if found.unstamped:
        said.append(f"{found.unstamped} messages carry no time: the time of receipt is used")
    t_s, poses = _odometry(found, said)
    mount = mount_of(found.tree, found.base_frame or _base(found), found.scan_frame)
    if not found.scans:
        raise InputError(f"{path}: expected laser scans in {picked.scan}, found none that can be read")
    scans = found.scans
    if not found.odometry:  # that of transforms is read later: nothing is known of the order
        scans = [replace(scan, readings_before=-1) for scan in scans]
    return assemble(path.name, scans, mount.pose, mount.upside_down, t_s, poses, [*said, *mount.warnings])


def _read(bag: OpenBag, picked: _Picked, names: set[str], found: _Collected) -> None:
    for topic, time_ns, message in bag.messages(names):
        try:
            if topic == picked.scan:
                _add_scan(found, message, time_ns)
            elif topic == picked.odometry:
                _add_odometry(found, message, time_ns)
            else:
                _add_transforms(found, message, time_ns)
        except (AttributeError, TypeError, ValueError, OverflowError):
            found.damaged += 1  # None, or what a damaged definition made of it


def _stamp_s(found: _Collected, header: Any, time_ns: int) -> float:
    seconds, nanoseconds = int(header.stamp.sec), int(header.stamp.nanosec)
    if seconds == 0 and nanoseconds == 0:
        found.unstamped += 1
        return time_ns * 1e-9
    return seconds + nanoseconds * 1e-9


def _add_scan(found: _Collected, message: Any, time_ns: int) -> None:
    frame = frame_name(message.header.frame_id)
    if not found.scans:
        found.scan_frame = frame
    elif frame not in {"", found.scan_frame}:
        found.elsewhere[frame] = found.elsewhere.get(frame, 0) + 1
        return
    found.scans.append(
        RawScan(
            _stamp_s(found, message.header, time_ns),
            quiet(np.asarray(message.ranges)).astype(np.float64),
            float(message.angle_min),
            float(message.angle_increment),
            float(message.range_min),
            float(message.range_max),
            len(found.odometry),
        )
    )


def _add_odometry(found: _Collected, message: Any, time_ns: int) -> None:
    found.base_frame = found.base_frame or frame_name(message.child_frame_id)
    point, turn = message.pose.pose.position, message.pose.pose.orientation
    row = float(point.x), float(point.y), heading_of(turn)
    found.odometry_t_s.append(_stamp_s(found, message.header, time_ns))
    found.odometry.append(row)


def _add_transforms(found: _Collected, message: Any, time_ns: int) -> None:
    for transform in message.transforms:
        found.tree.add(transform)
        if not found.odometry and frame_name(transform.header.frame_id) in USUAL_ODOMETRY_FRAMES:
            shift, turn = transform.transform.translation, transform.transform.rotation
            found.tf_odometry.append(
                (
                    frame_name(transform.child_frame_id),
                    _stamp_s(found, transform.header, time_ns),
                    float(shift.x),
                    float(shift.y),
                    heading_of(turn),
                )
            )


def heading_of(turn: Any) -> float:
    """Heading of a quaternion; NaN for one that is none, so that the reading is left out."""
    x, y, z, w = float(turn.x), float(turn.y), float(turn.z), float(turn.w)
    if not math.isfinite(x + y + z + w) or abs(x) + abs(y) + abs(z) + abs(w) < 1e-6:
        return math.nan
    return math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)


def _odometry(found: _Collected, said: list[str]) -> tuple[FloatArray, FloatArray]:
    if not found.odometry and found.tf_odometry:
        child = found.tf_odometry[0][0]
        rows = np.array([row[1:] for row in found.tf_odometry if row[0] == child])
        found.base_frame = child
        said.append(f"no topic of {ODOMETRY_TYPE}: odometry is taken from the transforms of '{child}'")
        return rows[:, 0], rows[:, 1:]
    return np.array(found.odometry_t_s), np.array(found.odometry).reshape(-1, 3)


def _base(found: _Collected) -> str:
    """The robot's frame where odometry does not name it: a usual one, else the scanner's own."""
    known = found.tree.parents
    frames = set(known) | {parent for parent, _ in known.values()}
    return next((frame for frame in USUAL_BASES if frame in frames), found.scan_frame)
