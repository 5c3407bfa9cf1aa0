"""Small bags with a laser, odometry and transforms, in every form that the reader knows."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pilotage.logs.message_types import shipped_types

FloatArray = NDArray[np.float64]
SCAN, ODOMETRY, TRANSFORMS = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry", "tf2_msgs/msg/TFMessage"


@dataclass(frozen=True)
class Scan:
    t_s: float
    ranges_m: FloatArray
    first_rad: float = -1.0
    step_rad: float = 0.1
    range_min_m: float = 0.1
    range_max_m: float = 30.0
    topic: str = "/scan"
    frame: str = "laser"


@dataclass(frozen=True)
class Drive:
    """What is written; quaternions x, y, z, w."""

    scans: tuple[Scan, ...]
    odometry: tuple[tuple[float, float, float, float], ...] = ()
    """t, x, y, theta."""
    mount: tuple[float, float, float] = (0.2, 0.1, 0.3)
    mount_turn: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    odometry_as_transforms: bool = False
    without_mount: bool = False
    stamped: bool = True
    received_s: dict[int, float] = field(default_factory=dict)
    """Times of receipt that differ from the stamps, by the scan's number."""


def drive(scans: int = 30, beams: int = 21) -> Drive:
    """A drive at 10 Hz with odometry at 20 Hz."""
    rng = np.random.default_rng(5)
    t_s = 1000.0 + 0.1 * np.arange(scans)
    rows = [Scan(float(t), rng.uniform(0.5, 20.0, beams).astype(np.float32).astype(np.float64)) for t in t_s]
    odometry = tuple(
        (999.95 + 0.05 * k, 0.01 * k, 0.002 * k, math.remainder(3.0 + 0.01 * k, math.tau))
        for k in range(2 * scans + 2)
    )
    return Drive(tuple(rows), odometry)


def with_scan(whole: Drive, k: int, **changes: Any) -> Drive:
    """The same drive with another scan ``k``."""
    scans = list(whole.scans)
    scans[k] = replace(scans[k], **changes)
    return replace(whole, scans=tuple(scans))


def noetic() -> Any:
    """The types of ROS 1 with those of its transforms."""
    return shipped_types("ROS1_NOETIC", {TRANSFORMS: "geometry_msgs/TransformStamped[] transforms"})


class Messages:
    """Builds messages of a type store, of ROS 1 or 2."""

    def __init__(self, store: Any, ros1: bool) -> None:
        self.types = store.types
        self.ros1 = ros1

    def header(self, t_s: float, frame: str) -> Any:
        seconds = math.floor(t_s)
        stamp = self.types["builtin_interfaces/msg/Time"](seconds, round((t_s - seconds) * 1e9))
        extra = {"seq": 0} if self.ros1 else {}
        return self.types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame, **extra)

    def scan(self, scan: Scan, stamped: bool) -> Any:
        return self.types[SCAN](
            header=self.header(scan.t_s if stamped else 0.0, scan.frame),
            angle_min=scan.first_rad,
            angle_max=scan.first_rad + scan.step_rad * (len(scan.ranges_m) - 1),
            angle_increment=scan.step_rad,
            time_increment=0.0,
            scan_time=0.1,
            range_min=scan.range_min_m,
            range_max=scan.range_max_m,
            ranges=scan.ranges_m.astype(np.float32),
            intensities=np.zeros(0, np.float32),
        )

    def turn(self, x: float, y: float, z: float, w: float) -> Any:
        return self.types["geometry_msgs/msg/Quaternion"](x, y, z, w)

    def odometry(self, t_s: float, x: float, y: float, theta: float) -> Any:
        vector, point = self.types["geometry_msgs/msg/Vector3"], self.types["geometry_msgs/msg/Point"]
        turn = self.turn(0.0, 0.0, math.sin(theta / 2), math.cos(theta / 2))
        pose = self.types["geometry_msgs/msg/Pose"](point(x, y, 0.0), turn)
        twist = self.types["geometry_msgs/msg/Twist"](vector(0.0, 0.0, 0.0), vector(0.0, 0.0, 0.0))
        return self.types[ODOMETRY](
            header=self.header(t_s, "odom"),
            child_frame_id="base_link",
            pose=self.types["geometry_msgs/msg/PoseWithCovariance"](pose, np.zeros(36)),
            twist=self.types["geometry_msgs/msg/TwistWithCovariance"](twist, np.zeros(36)),
        )

    def transform(
        self, t_s: float, parent: str, child: str, shift: tuple[float, float, float], turn: Any
    ) -> Any:
        vector = self.types["geometry_msgs/msg/Vector3"](*shift)
        inner = self.types["geometry_msgs/msg/Transform"](vector, turn)
        stamped = self.types["geometry_msgs/msg/TransformStamped"](self.header(t_s, parent), child, inner)
        return self.types[TRANSFORMS]([stamped])


def messages(whole: Drive, make: Messages) -> Iterator[tuple[str, str, int, Any]]:
    """Topic, type, time of receipt in nanoseconds and message, in the order of receipt."""
    rows: list[tuple[float, str, str, Any]] = []
    if not whole.without_mount:
        first = whole.scans[0].t_s if whole.scans else 0.0
        # The laser hangs on a plate on the robot: a chain of two transforms.
        plate = make.transform(first, "base_link", "plate", whole.mount, make.turn(0.0, 0.0, 0.0, 1.0))
        laser = make.transform(first, "plate", "laser", (0.0, 0.0, 0.0), make.turn(*whole.mount_turn))
        rows += [(0.0, "/tf_static", TRANSFORMS, plate), (0.0, "/tf_static", TRANSFORMS, laser)]
    for t_s, x, y, theta in whole.odometry:
        if whole.odometry_as_transforms:
            turn = make.turn(0.0, 0.0, math.sin(theta / 2), math.cos(theta / 2))
            rows.append((t_s, "/tf", TRANSFORMS, make.transform(t_s, "odom", "base_link", (x, y, 0.0), turn)))
        else:
            rows.append((t_s, "/odom", ODOMETRY, make.odometry(t_s, x, y, theta)))
    for k, scan in enumerate(whole.scans):
        rows.append((whole.received_s.get(k, scan.t_s), scan.topic, SCAN, make.scan(scan, whole.stamped)))
    rows.sort(key=lambda row: row[0])
    for t_s, topic, msgtype, message in rows:
        yield topic, msgtype, round(t_s * 1e9), message


def write_ros1(path: Path, whole: Drive, packing: str = "none") -> Path:
    """Write a ROS 1 bag with rosbags."""
    from rosbags.rosbag1 import Writer

    store = noetic()
    writer = Writer(path)
    writer.chunk_threshold = 20_000  # several chunks also in a small bag
    if packing != "none":
        writer.set_compression(Writer.CompressionFormat[packing.upper()])
    with writer:
        connections: dict[str, Any] = {}
        for topic, msgtype, time_ns, message in messages(whole, Messages(store, ros1=True)):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, msgtype, typestore=store)
            writer.write(connections[topic], time_ns, store.serialize_ros1(message, msgtype))
    return path


def write_ros2(path: Path, whole: Drive, storage: str = "SQLITE3", packing: str = "NONE") -> Path:
    """Write the folder of a ROS 2 bag with rosbags."""
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

    store = shipped_types("ROS2_HUMBLE")
    writer = Writer(path, version=9, storage_plugin=StoragePlugin[storage])
    if packing != "NONE":
        writer.set_compression(CompressionMode[packing], CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Any] = {}
        for topic, msgtype, time_ns, message in messages(whole, Messages(store, ros1=False)):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, msgtype, typestore=store)
            writer.write(connections[topic], time_ns, store.serialize_cdr(message, msgtype))
    return path


def write_foreign_mcap(path: Path, whole: Drive, packing: str = "ZSTD", chunk: int = 1024 * 1024) -> Path:
    """Write MCAP with the libraries of Foxglove."""
    from mcap.writer import CompressionType
    from mcap_ros2.writer import Writer

    store = shipped_types("ROS2_HUMBLE")
    with path.open("wb") as file:
        writer: Any = Writer(file, chunk_size=chunk, compression=CompressionType[packing])
        schemas: dict[str, Any] = {}
        for topic, msgtype, time_ns, message in messages(whole, Messages(store, ros1=False)):
            if msgtype not in schemas:
                text, _ = store.generate_msgdef(msgtype, ros_version=2)
                schemas[msgtype] = writer.register_msgdef(msgtype, text)
            writer.write_message(topic, schemas[msgtype], as_dictionary(message), log_time=time_ns)
        writer.finish()
    return path


def write_ros1_mcap(path: Path, whole: Drive) -> Path:
    """Write MCAP with messages of ROS 1, as ``mcap convert`` makes it of a bag."""
    from mcap.writer import Writer

    store = noetic()
    with path.open("wb") as file:
        writer: Any = Writer(file)
        writer.start(profile="ros1")
        channels: dict[str, int] = {}
        for topic, msgtype, time_ns, message in messages(whole, Messages(store, ros1=True)):
            if topic not in channels:
                text, _ = store.generate_msgdef(msgtype, ros_version=1)
                schema = writer.register_schema(msgtype.replace("/msg/", "/"), "ros1msg", text.encode())
                channels[topic] = writer.register_channel(topic, "ros1", schema)
            data = bytes(store.serialize_ros1(message, msgtype))
            writer.add_message(channels[topic], time_ns, data, time_ns)
        writer.finish()
    return path


def as_dictionary(message: Any) -> Any:
    """A message as nested dictionaries of plain values."""
    if hasattr(message, "__dataclass_fields__"):
        names = [name for name in message.__dataclass_fields__ if name != "__msgtype__"]
        return {name: as_dictionary(getattr(message, name)) for name in names}
    if isinstance(message, np.ndarray):
        return message.tolist()
    return [as_dictionary(item) for item in message] if isinstance(message, list) else message


FORMS: dict[str, Callable[[Path, Drive], Path]] = {
    "ros1": lambda folder, whole: write_ros1(folder / "a.bag", whole),
    "ros1-bz2": lambda folder, whole: write_ros1(folder / "a.bag", whole, "bz2"),
    "ros1-lz4": lambda folder, whole: write_ros1(folder / "a.bag", whole, "lz4"),
    "ros2-sqlite": lambda folder, whole: write_ros2(folder / "a", whole),
    "ros2-sqlite-file": lambda folder, whole: write_ros2(folder / "a", whole) / "a.db3",
    "ros2-sqlite-zstd-messages": lambda folder, whole: write_ros2(folder / "a", whole, packing="MESSAGE"),
    "ros2-sqlite-zstd-file": lambda folder, whole: write_ros2(folder / "a", whole, packing="FILE"),
    "ros2-mcap": lambda folder, whole: write_ros2(folder / "a", whole, "MCAP"),
    "ros2-mcap-file": lambda folder, whole: write_ros2(folder / "a", whole, "MCAP") / "a.mcap",
    "foreign-mcap": lambda folder, whole: write_foreign_mcap(folder / "a.mcap", whole),
    "foreign-mcap-lz4": lambda folder, whole: write_foreign_mcap(folder / "a.mcap", whole, "LZ4", 4096),
    "foreign-mcap-plain": lambda folder, whole: write_foreign_mcap(folder / "a.mcap", whole, "NONE"),
    "ros1-mcap": lambda folder, whole: write_ros1_mcap(folder / "a.mcap", whole),
}
"""Write a drive into a folder, and return what is to be read."""
