"""A stranger who hears ``/tf`` over DDS alone: knows Cyclone DDS, and nothing of ROS nor of pilotage.

Prints a line when it listens, and a JSON object when nothing has come for three seconds: times, count and
frames of the last message.
"""

from __future__ import annotations

import json
import os
import sys
import time
from typing import Any

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import make_idl_struct
from cyclonedds.idl.types import float64, int32, sequence, uint32
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


def struct(package: str, name: str, **fields: Any) -> Any:
    """A message's type as DDS knows it."""
    return make_idl_struct(name, f"{package}::msg::dds_::{name}_", fields)


STAMP = struct("builtin_interfaces", "Time", sec=int32, nanosec=uint32)
HEADER = struct("std_msgs", "Header", stamp=STAMP, frame_id=str)
VECTOR = struct("geometry_msgs", "Vector3", x=float64, y=float64, z=float64)
QUATERNION = struct("geometry_msgs", "Quaternion", x=float64, y=float64, z=float64, w=float64)
TRANSFORM = struct("geometry_msgs", "Transform", translation=VECTOR, rotation=QUATERNION)
STAMPED = struct("geometry_msgs", "TransformStamped", header=HEADER, child_frame_id=str, transform=TRANSFORM)
MESSAGE = struct("tf2_msgs", "TFMessage", transforms=sequence[STAMPED])


def main() -> None:
    """Listen until nobody speaks any more."""
    number = int(os.environ["ROS_DOMAIN_ID"])
    alone = "<General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces></General>"
    alone += "<Discovery><ParticipantIndex>none</ParticipantIndex></Discovery>"
    domain = Domain(number, f"<CycloneDDS><Domain>{alone}</Domain></CycloneDDS>")
    participant = DomainParticipant(number)
    quality = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepAll)
    reader = DataReader(participant, Topic(participant, "rt/tf", MESSAGE), qos=quality)
    sys.stdout.write("listens\n")
    sys.stdout.flush()
    messages: list[Any] = []
    begun = heard = time.monotonic()
    while time.monotonic() - max(heard, begun + 120.0 * (not messages)) < 3.0:
        taken = [message for message in reader.take(1000) if isinstance(message, MESSAGE)]
        if taken:
            messages += taken
            heard = time.monotonic()
        time.sleep(0.02)
    times = [
        round(1e-9 * m.transforms[0].header.stamp.nanosec + m.transforms[0].header.stamp.sec, 6)
        for m in messages
    ]
    frames = [[t.header.frame_id, t.child_frame_id] for t in messages[-1].transforms] if messages else []
    sys.stdout.write(
        json.dumps({"count": len(times), "times": times[:1] + times[-1:], "frames": frames}) + "\n"
    )
    del domain


if __name__ == "__main__":
    main()
