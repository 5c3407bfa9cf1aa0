"""Bags of commanded velocities beside the odometry of the base that took them, and tags that it saw."""

from __future__ import annotations

import numpy as np

from pilotage.bridges.ros import messages as ros
from pilotage.bridges.ros.run_messages import RunMessages, Stamped
from pilotage.core.types import Pose2


def commanded(seconds: int = 180, told: bool = True, rate_hz: int = 20) -> RunMessages:
    """Commands that change every second: taken at 0.9 and 1.1 of what they say, and 0.2 s late."""
    out: list[Stamped] = []
    at, start, dt_s = Pose2(0.0, 0.0, 0.0), 1000.0, 1.0 / rate_hz
    rng = np.random.default_rng(3)
    sent = np.column_stack([rng.uniform(0.1, 0.5, seconds), rng.uniform(-0.6, 0.6, seconds)])
    late = round(0.2 * rate_hz)
    for k in range(seconds * rate_hz):
        t_s, now = start + dt_s * k, ros.nanoseconds(start + dt_s * k)
        if k % 2 == 0 and told:
            out.append(Stamped("/cmd_vel", now, ros.TWIST, ros.twist(*sent[k // rate_hz].tolist())))
        fields = ros.odometry(t_s, "odom", "base_link", at, ros.twist(0.0, 0.0))
        out.append(Stamped("/odom", now, ros.ODOMETRY, fields))
        v, w = sent[max(k - late, 0) // rate_hz] * [0.9, 1.1]
        at = at.compose(Pose2(dt_s * float(v), 0.0, dt_s * float(w)))
    return RunMessages(out, {})
