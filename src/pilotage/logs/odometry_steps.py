"""What odometry claimed, step by step, beside what truly happened: what a calibration works on."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import FloatArray


class OdometryForm(StrEnum):
    """How a log writes odometry down."""

    RESET = "reset"
    """Each row's odometry pose began at the true pose of the row before."""
    CUMULATIVE = "cumulative"
    """The odometry pose was never reset: errors add up."""
    INCREMENTS = "increments"
    """Distance and turn since the reading before."""


@dataclass(frozen=True, slots=True)
class OdometrySteps:
    """Steps of one log.

    Attributes
    ----------
    name
        What the log is called.
    form
        How it was written.
    t_s
        (N,) times of the steps' ends.
    start
        (N, 3) true pose x, y, theta at each step's begin.
    truth
        (N, 3) true pose at its end.
    claimed
        (N, 3) pose at its end as odometry claims it, begun at ``start``.
    """

    name: str
    form: OdometryForm
    t_s: FloatArray
    start: FloatArray
    truth: FloatArray
    claimed: FloatArray

    def __len__(self) -> int:
        return int(self.t_s.shape[0])

    @property
    def turn_rad(self) -> FloatArray:
        """(N,) true turn of each step."""
        return wrap_array_to_pi(self.truth[:, 2] - self.start[:, 2])

    @property
    def claimed_turn_rad(self) -> FloatArray:
        """(N,) turn of each step as odometry claims it."""
        return wrap_array_to_pi(self.claimed[:, 2] - self.start[:, 2])

    @property
    def middle_heading_rad(self) -> FloatArray:
        """(N,) direction of each step's chord if it is an arc."""
        return np.asarray(self.start[:, 2] + 0.5 * self.turn_rad)

    @property
    def arc_m(self) -> FloatArray:
        """(N,) true distance along the arc, negative backwards."""
        return arc_lengths(self.start, self.truth)


def arc_lengths(start: FloatArray, end: FloatArray) -> FloatArray:
    """Signed lengths (N,) of the arcs from ``start`` (N, 3) to ``end`` (N, 3).

    An arc of angle a and length s has the chord s sin(a / 2) / (a / 2) along the mean of both headings.
    """
    turn = wrap_array_to_pi(end[:, 2] - start[:, 2])
    middle = start[:, 2] + 0.5 * turn
    step = end[:, :2] - start[:, :2]
    chord = step[:, 0] * np.cos(middle) + step[:, 1] * np.sin(middle)
    return np.asarray(chord / np.sinc(turn / (2.0 * np.pi)))


def arc_ends(
    start: FloatArray, arc_m: FloatArray, turn_rad: FloatArray, left_m: FloatArray | float = 0.0
) -> FloatArray:
    """Poses (N, 3) after arcs of ``arc_m`` (N,) that turn by ``turn_rad`` (N,) from ``start`` (N, 3).

    Each goes to the left by ``left_m`` (N,) all the while, as a base does that drives sideways.
    """
    middle = start[:, 2] + 0.5 * turn_rad
    share = np.sinc(turn_rad / (2.0 * np.pi))
    chord, left = arc_m * share, left_m * share
    return np.column_stack(
        [
            start[:, 0] + chord * np.cos(middle) - left * np.sin(middle),
            start[:, 1] + chord * np.sin(middle) + left * np.cos(middle),
            wrap_array_to_pi(start[:, 2] + turn_rad),
        ]
    )


def carried_over(start: FloatArray, before: FloatArray, after: FloatArray) -> FloatArray:
    """Poses (N, 3) that are to ``start`` what ``after`` is to ``before`` (each (N, 3))."""
    turn = start[:, 2] - before[:, 2]
    c, s = np.cos(turn), np.sin(turn)
    step = after[:, :2] - before[:, :2]
    return np.column_stack(
        [
            start[:, 0] + c * step[:, 0] - s * step[:, 1],
            start[:, 1] + s * step[:, 0] + c * step[:, 1],
            wrap_array_to_pi(start[:, 2] + after[:, 2] - before[:, 2]),
        ]
    )
