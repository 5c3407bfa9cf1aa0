"""How the robot answers to commands: its rates, its share of the data sheet's limits, and its delay."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.control.commands_sent import drive_out, filter_rates, weigh
from pilotage.kernels.control.motion_limits import Drive

SHARES = (1.15, 1.0, 0.9, 0.8, 0.7, 0.6, 0.5)
DELAYS = (1.0, 1.25, 1.5, 1.75)
DOUBT_STD = np.array([0.03, 0.06])
"""Of speed (m/s) and turn rate (rad/s): closer than this no model of the limits need be."""
PRIOR = 4.0
"""Cost of a hypothesis per unit that it is off the data sheet."""
KEPT_S = 2.0
ROOM = 256
"""Commands that the list has room for before those still wanted are moved to its begin."""


class Answer:
    """Keeps the commands sent and weighs hypotheses about the limits by the speeds measured since.

    A bank of models, one for each share of the accelerations and each factor of the delay, each with its own
    Kalman filter of the rates (multiple-model estimation: Magill 1965). Accelerating tells of braking here:
    one share holds for both, which is wrong where brakes alone are worn. Rates are those of the likeliest
    model: what the odometry says of one step alone may be off by a tenth, and braking begins late by a fifth.

    It forgets from step to step, or ``holds_on`` to what it learned while nothing tells of it.
    """

    def __init__(self, shares: tuple[float, ...] = SHARES, *, holds_on: bool = False) -> None:
        self._room = np.empty((ROOM, 3))
        self._sent = self._room[:0]
        """(N, 3) time, speed and turn rate: a part of the room."""
        self._begin = 0
        self._pairs = [(share, delay) for share in shares for delay in DELAYS]
        self._hypotheses = np.array(self._pairs)
        self._prior = PRIOR * np.abs(self._hypotheses - 1.0).sum(axis=1)
        self._costs = self._prior.copy()
        self._choose(int(np.argmin(self._costs)))
        self._bank = np.zeros((len(self._pairs), 6))
        self._learned_s: float | None = None
        self._holds_on = holds_on

    def _choose(self, likeliest: int) -> None:
        """``share`` of the data sheet's accelerations, ``delay_factor`` of its delay, as they seem."""
        self._likeliest = likeliest
        self.share, self.delay_factor = self._pairs[likeliest]

    def sent(self, t_s: float, v_m_s: float, w_rad_s: float) -> None:
        """Remember a command."""
        end = self._begin + len(self._sent)
        if end == len(self._room):
            if self._begin < len(self._room) // 2:
                self._room = np.concatenate([self._room, np.empty((len(self._room), 3))])
            self._room[: len(self._sent)] = self._sent.copy()
            self._begin, end = 0, len(self._sent)
        self._room[end] = t_s, v_m_s, w_rad_s
        # One older than that which acts now is enough.
        while end - self._begin > 1 and self._room[self._begin + 1, 0] < t_s - KEPT_S:
            self._begin += 1
        self._sent = self._room[self._begin : end + 1]

    def learn(
        self, t_s: float, measured: FloatArray, measured_var: FloatArray, delay_s: float, drive: Drive
    ) -> None:
        """Weigh the hypotheses by a measured speed and turn rate (2,) with their variances (2,)."""
        if self._learned_s is None:
            self._bank[:, :2], self._bank[:, 2:4] = measured, measured_var
        else:
            errors = filter_rates(
                self._bank,
                measured,
                measured_var,
                self._learned_s,
                t_s,
                delay_s,
                self._sent,
                drive,
                self._hypotheses,
                DOUBT_STD,
            )
            self._choose(weigh(self._costs, self._prior, errors, self._holds_on))
        self._learned_s = t_s

    @property
    def rates(self) -> FloatArray:
        """(2,) speed and turn rate when it last learned."""
        rates: FloatArray = self._bank[self._likeliest, :2]
        return rates

    def likely(self, drive: Drive) -> Drive:
        """The limits that explain the answers best, never above the data sheet's."""
        return drive.scaled(min(self.share, 1.0))

    def after_delay(self, t_s: float, state: FloatArray, delay_s: float, drive: Drive) -> FloatArray:
        """State (5,) when a command given now takes effect: those under way are driven out first."""
        delay = delay_s * self.delay_factor
        if delay <= 0.0 or not len(self._sent):
            return state
        out: FloatArray = drive_out(state, t_s, t_s + delay, delay, self._sent, drive)
        return out
