"""``/tf`` where ``tf2_msgs`` is missing, which no package index has: spoken over DDS itself.

A topic of ROS 2 is one of DDS by the name ``rt/NAME``; its type's name has ``dds_`` in between, its fields
are in the order of the message's definition ("Topic and service name mapping to DDS", design.ros2.org).
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Mapping
from typing import Any

from pilotage.bridges.ros.messages import Fields

STAMPS: Fields = {"sec": "int32", "nanosec": "uint32"}
VECTOR: Fields = dict.fromkeys("xyz", "float64")
QUATERNION: Fields = dict.fromkeys("xyzw", "float64")
LOOPBACK = "<General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces></General>"
# Any free port: by its number in the domain it would take one that Fast DDS, which shares ports, listens at.
ANY_PORT = "<Discovery><ParticipantIndex>none</ParticipantIndex></Discovery>"
BLOCKED_S = 1
"""How long a message may wait for a listener that does not keep up."""


class TransformTopic:
    """A topic of ``tf2_msgs/msg/TFMessage``.

    Raises
    ------
    ImportError
        Where ``cyclonedds`` is not installed.
    """

    def __init__(self, topic: str, depth: int) -> None:
        core, domain, idl, pub, topics, util = (
            importlib.import_module(f"cyclonedds.{name}")
            for name in ("core", "domain", "idl", "pub", "topic", "util")
        )
        number = int(os.environ.get("ROS_DOMAIN_ID") or 0)
        if "CYCLONEDDS_URI" not in os.environ:
            told = ANY_PORT + LOOPBACK * stays_here(os.environ)
            # DDS keeps what it was told for as long as somebody holds this.
            self._domain = domain.Domain(number, f"<CycloneDDS><Domain>{told}</Domain></CycloneDDS>")
        participant = domain.DomainParticipant(number)
        quality = core.Qos(
            core.Policy.Reliability.Reliable(util.duration(seconds=BLOCKED_S)),
            core.Policy.History.KeepLast(depth),
            core.Policy.DataRepresentation(use_cdrv0_representation=True),
        )
        self._message, self._transform = _types(idl)
        opened = topics.Topic(participant, "rt" + topic, self._message, qos=quality)
        self._writer = pub.DataWriter(participant, opened, qos=quality)

    def send(self, fields: Fields) -> None:
        """Send a message."""
        self._writer.write(self._message([_filled(self._transform, item) for item in fields["transforms"]]))


def stays_here(environment: Mapping[str, str]) -> bool:
    """Whether ROS 2 is told to talk to this machine alone."""
    reach = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper()
    return environment.get("ROS_LOCALHOST_ONLY") == "1" or reach in ("LOCALHOST", "OFF")


def _types(idl: Any) -> tuple[Any, Any]:
    """``tf2_msgs/msg/TFMessage`` and ``geometry_msgs/msg/TransformStamped``."""
    kinds = importlib.import_module("cyclonedds.idl.types")

    def struct(package: str, name: str, fields: Mapping[str, Any]) -> Any:
        members = {
            key: getattr(kinds, kind) if isinstance(kind, str) else kind for key, kind in fields.items()
        }
        return idl.make_idl_struct(name, f"{package}::msg::dds_::{name}_", members)

    header = struct(
        "std_msgs", "Header", {"stamp": struct("builtin_interfaces", "Time", STAMPS), "frame_id": str}
    )
    vector, quaternion = (
        struct("geometry_msgs", "Vector3", VECTOR),
        struct("geometry_msgs", "Quaternion", QUATERNION),
    )
    transform = struct("geometry_msgs", "Transform", {"translation": vector, "rotation": quaternion})
    fields = {"header": header, "child_frame_id": str, "transform": transform}
    one = struct("geometry_msgs", "TransformStamped", fields)
    return struct("tf2_msgs", "TFMessage", {"transforms": kinds.sequence[one]}), one


def _filled(kind: Any, fields: Fields) -> Any:
    return kind(
        **{
            name: _filled(kind.__annotations__[name], value) if isinstance(value, Mapping) else value
            for name, value in fields.items()
        }
    )
