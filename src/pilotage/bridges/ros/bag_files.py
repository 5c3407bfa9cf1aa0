"""Messages written into bags: MCAP, ROS 2 (a folder) and ROS 1, by ``rosbags`` (extra ``ros``)."""

from __future__ import annotations

import errno
import os
import sqlite3
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.bridges.ros.messages import TRANSFORMS
from pilotage.bridges.ros.run_messages import LOG_TYPE, RunMessages, Stamped
from pilotage.core.drafts import draft_prefix
from pilotage.core.whole_file import draft_of, named
from pilotage.logs.message_types import shipped_types
from pilotage.logs.rosbags_extra import rosbags
from pilotage.records.run_folder import draft_folder

ROS2_VERSION = 9
ROS1_TYPES = {TRANSFORMS: "geometry_msgs/TransformStamped[] transforms\n"}
"""What the library's own collection of types has not."""
ROS1_LOG_TYPE, ROS1_INFORMATION = "rosgraph_msgs/msg/Log", 2
BASE, NAME = 1, 2
"""Kinds of fields as ``rosbags`` counts them; the others are arrays and sequences."""


def write_mcap(path: Path, messages: RunMessages) -> None:
    """Write one MCAP file, whole or not at all."""
    rosbag2 = rosbags("rosbag2")
    begin = draft_prefix(path)
    with (
        named(path, path.with_name(begin)),
        draft_of(path) as draft,
        tempfile.TemporaryDirectory(dir=path.parent, prefix=begin) as folder,
    ):
        bag = Path(folder) / "bag"
        writer = rosbag2.Writer(bag, version=ROS2_VERSION, storage_plugin=rosbag2.StoragePlugin.MCAP)
        _write(writer, "LATEST", messages)
        next(bag.glob("*.mcap")).replace(draft)


def write_ros2(folder: Path, messages: RunMessages) -> None:
    """Write the folder of a ROS 2 bag (SQLite), whole or not at all."""
    rosbag2 = rosbags("rosbag2")
    with draft_folder(folder) as draft:
        inner = draft / folder.name
        try:
            _write(rosbag2.Writer(inner, version=ROS2_VERSION), "LATEST", messages)
        except sqlite3.OperationalError as error:  # it writes into a database
            full = error.sqlite_errorcode == sqlite3.SQLITE_FULL
            number = errno.ENOSPC if full else errno.EIO
            raise OSError(number, os.strerror(number)) from error
        for file in inner.iterdir():
            file.replace(draft / file.name)
        inner.rmdir()


def write_ros1(path: Path, messages: RunMessages) -> None:
    """Write a ROS 1 bag, whole or not at all."""
    with draft_of(path) as draft:
        _write(rosbags("rosbag1").Writer(draft), "ROS1_NOETIC", messages)


def _write(writer: Any, store_name: str, messages: RunMessages) -> None:
    ros1 = store_name.startswith("ROS1")
    store = shipped_types(store_name, {**messages.own_types, **(ROS1_TYPES if ros1 else {})})
    with writer:
        connections: dict[str, Any] = {}
        for message in messages.stamped:
            msgtype, fields = _of_ros1(message) if ros1 else (message.msgtype, message.fields)
            connection = connections.get(message.topic)
            if connection is None:
                kept: dict[str, Any] = _latched(ros1) if message.kept else {}
                connection = writer.add_connection(message.topic, msgtype, typestore=store, **kept)
                connections[message.topic] = connection
            value = filled(store, msgtype, fields)
            serialize = store.serialize_ros1 if ros1 else store.serialize_cdr
            writer.write(connection, max(message.time_ns, 0), serialize(value, msgtype))


def _latched(ros1: bool) -> dict[str, Any]:
    """How a topic says that whoever comes later is to have its last message too."""
    if ros1:
        return {"latching": 1}
    kinds = rosbags("interfaces")
    none = kinds.QosTime(0, 0)
    return {
        "offered_qos_profiles": [
            kinds.Qos(
                kinds.QosHistory.KEEP_LAST,
                1,
                kinds.QosReliability.RELIABLE,
                kinds.QosDurability.TRANSIENT_LOCAL,
                none,
                none,
                kinds.QosLiveliness.AUTOMATIC,
                none,
                False,
            )
        ]
    }


def _of_ros1(message: Stamped) -> tuple[str, Mapping[str, Any]]:
    """The one type that ROS 1 has otherwise."""
    if message.msgtype != LOG_TYPE:
        return message.msgtype, message.fields
    fields = dict(message.fields)
    return ROS1_LOG_TYPE, {
        "header": {"stamp": fields.pop("stamp"), "frame_id": ""},
        **fields,
        "level": ROS1_INFORMATION,
    }


def filled(store: Any, msgtype: str, fields: Mapping[str, Any]) -> Any:
    """A message of the store's type; what ``fields`` leaves out is zero, false or empty."""
    declared = store.fielddefs[msgtype][1]
    return store.types[msgtype](**{name: _value(store, kind, fields.get(name)) for name, kind in declared})


def _value(store: Any, kind: Any, given: Any) -> Any:
    form, inner = int(kind[0]), kind[1]
    if form == NAME:
        return filled(store, inner, {} if given is None else given)
    if form == BASE:
        zero: Any = "" if inner[0] == "string" else False if inner[0] == "bool" else 0
        return zero if given is None else given
    element, length = inner
    if int(element[0]) == NAME:
        return [filled(store, element[1], item) for item in given or ()]
    if element[1][0] == "string":
        return list(given or ())
    zeros: Any = np.zeros(length, dtype=element[1][0])
    return zeros if given is None else np.ascontiguousarray(given, dtype=element[1][0])
