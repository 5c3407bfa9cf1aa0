"""How the robot answers to commands: which share of the data sheet's limits it has, and which delay."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.control.commands_sent import drive_out, limit_errors, scaled
from pilotage.kernels.control.motion_limits import Drive

SHARES = (1.15, 1.0, 0.9, 0.8, 0.7, 0.6, 0.5)
DELAYS = (1.0, 1.25, 1.5, 1.75)
FORGET = 0.99
"""Per step: the limits may change with the ground."""
SPEED_STD = 0.03
TURN_STD = 0.06
MOST_ERROR = 25.0
"""Of one step, in squared standard deviations: a bump is no limit."""
PRIOR = 4.0
"""Cost of a hypothesis per unit that it is off the data sheet."""
KEPT_S = 2.0


class Answer:
    """Keeps the commands sent and weighs hypotheses about the limits by the speeds measured since.

    A bank of models, one for each share of the accelerations and each factor of the delay, each predicting
    the rates one step ahead (multiple-model estimation: Magill 1965). Accelerating tells of braking here: one
    share holds for both, which is wrong where brakes alone are worn.
    """

    def __init__(self) -> None:
        self._sent: list[tuple[float, float, float]] = []
        self._hypotheses = np.array([(share, delay) for share in SHARES for delay in DELAYS])
        self._costs = PRIOR * (np.abs(self._hypotheses[:, 0] - 1.0) + np.abs(self._hypotheses[:, 1] - 1.0))
        self._before: tuple[float, FloatArray] | None = None

    @property
    def share(self) -> float:
        """Of the data sheet's accelerations, as it seems."""
        return float(self._hypotheses[int(np.argmin(self._costs)), 0])

    @property
    def delay_factor(self) -> float:
        """Of the data sheet's delay, as it seems."""
        return float(self._hypotheses[int(np.argmin(self._costs)), 1])

    def sent(self, t_s: float, v_m_s: float, w_rad_s: float) -> None:
        """Remember a command."""
        self._sent.append((t_s, v_m_s, w_rad_s))
        # One older than that which acts now is enough.
        while len(self._sent) > 2 and self._sent[1][0] < t_s - KEPT_S:
            self._sent.pop(0)

    def learn(self, t_s: float, state: FloatArray, delay_s: float, drive: Drive) -> None:
        """Weigh the hypotheses by a measured state (5,)."""
        if self._before is not None and self._sent:
            then_s, before = self._before
            errors = limit_errors(
                before,
                state,
                then_s,
                t_s,
                delay_s,
                np.array(self._sent),
                drive,
                self._hypotheses,
                SPEED_STD,
                TURN_STD,
            )
            prior = PRIOR * np.abs(self._hypotheses - 1.0).sum(axis=1)
            self._costs = prior + FORGET * (self._costs - prior) + np.minimum(errors, MOST_ERROR)
        self._before = (t_s, state)

    def likely(self, drive: Drive) -> Drive:
        """The limits that explain the answers best, never above the data sheet's."""
        return Drive(*scaled(drive, min(self.share, 1.0)))

    def after_delay(self, t_s: float, state: FloatArray, delay_s: float, drive: Drive) -> FloatArray:
        """State (5,) when a command given now takes effect: those under way are driven out first."""
        delay = delay_s * self.delay_factor
        if delay <= 0.0 or not self._sent:
            return state
        out: FloatArray = drive_out(state, t_s, t_s + delay, delay, np.array(self._sent), drive)
        return out
