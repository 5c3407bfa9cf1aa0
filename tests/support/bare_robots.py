"""What a filter is not told, left off the museum's robot: its estimates keep every bit.

Each sensor draws from a stream of its own, and on the programmed route nothing stands in the way that a
mapper or an ultrasonic sensor would show. A step costs a quarter less.
"""

from __future__ import annotations

_NO_OTHERS = ("stack.mapper=null", *(f"robot.sensors.{side}=null" for side in ("front", "left", "right")))

ON_BEACONS = ("robot.sensors.lidar=null", *_NO_OTHERS)
ON_WALLS = ("robot.sensors.beacons=null", *_NO_OTHERS)
