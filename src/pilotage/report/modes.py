"""The robot's modes as the trace numbers them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.records.trace import Trace
from pilotage.report.series import merge_spans, spans
from pilotage.report.style import BLUE, FAINT, GREEN, INK, ORANGE, PURPLE, SKY, VERMILLION


@dataclass(frozen=True, slots=True)
class Mode:
    """One mode: its number in the trace, its name, a short one for an axis, its colour."""

    number: int
    name: str
    short: str
    colour: str


FOLLOW = Mode(0, "follow the path", "follow", FAINT)
LATERAL = Mode(1, "lateral repulsion, hall", "lateral", BLUE)
AVOID = Mode(2, "avoid", "avoid", ORANGE)
ESCAPE = Mode(3, "back out", "back out", VERMILLION)
REPLAN = Mode(4, "stopped to replan", "replan", PURPLE)
ARRIVED = Mode(5, "arrived", "arrived", GREEN)
WANDER = Mode(6, "lost: wandering", "lost", INK)
WAIT = Mode(7, "waiting for somebody to pass", "wait", SKY)
MODES = (FOLLOW, LATERAL, AVOID, ESCAPE, REPLAN, ARRIVED, WANDER, WAIT)


def mode_spans(trace: Trace, mode: Mode) -> FloatArray:
    """Return (k, 2) the stretches of time in a mode; flickers shorter than a pixel are drawn as one."""
    t_s = trace.t_s
    if not len(t_s):
        return np.empty((0, 2))
    stretches = spans(t_s, trace["mode"] == mode.number)
    return merge_spans(stretches, float(t_s[-1] - t_s[0]) / 700.0)
