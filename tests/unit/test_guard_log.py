"""Who is detected, and by whom: a robot that stopped tells nobody."""

from __future__ import annotations

from array import array
from types import SimpleNamespace
from typing import Any

import numpy as np

from pilotage.evaluation.guard_log import ALARM, GuardLog


def test_what_a_robot_that_stopped_sees_is_no_detection() -> None:
    traffic = SimpleNamespace(circles_m=np.array([[1.0, 2.0, 0.2]]), first_person=0)
    body = SimpleNamespace(world=SimpleNamespace(traffic=traffic), stopped=True)
    journal = SimpleNamespace(units=dict.fromkeys(ALARM, "m"), row=array("d", [5.0, 1.0, 2.0]))
    guard: Any = SimpleNamespace(body=body, journal=journal)
    log = GuardLog(1)
    log.step(5.0, [guard])
    assert log.metrics(somebody=True)["detected"] is False
    body.stopped = False
    log.step(6.0, [guard])  # mended; it saw somebody before
    assert log.metrics(somebody=True)["detected"] is False
    journal.row[0] = 7.0
    log.step(7.0, [guard])
    assert log.metrics(somebody=True) == {"false_alarms": 0, "detected": True, "detection_time_s": 2.0}
