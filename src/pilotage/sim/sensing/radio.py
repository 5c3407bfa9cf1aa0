"""The radio's other side: who is near enough, which messages are lost, when they arrive."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from pilotage.sensors.radio import RadioConfig
from pilotage.sensors.readings import RadioMessage, RadioMessages
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier

SLACK_S = 1e-6
"""Step times are sums of dt."""


class _Link(NamedTuple):
    """From one radio to another: whose luck it is, what of both data sheets counts."""

    to: SimulatedRadio
    draw: Callable[[], float]
    loss: float
    reach_m: float
    delay_s: float

    @classmethod
    def between(cls, one: SimulatedRadio, to: SimulatedRadio) -> _Link:
        """From ``one`` to another."""
        loss = max(one.config.loss, to.config.loss)
        return cls(to, to._rng.random, loss, min(one._reach_m, to._reach_m), to.config.delay_s)


@SIMULATED_SENSORS.add(RadioConfig)
class SimulatedRadio:
    """Sends to all radios of its world, and holds what is under way to itself.

    Attributes
    ----------
    works
        False while it is broken: it neither sends nor receives.
    """

    def __init__(self, config: RadioConfig, carrier: Carrier, rng: np.random.Generator) -> None:
        self.config, self.works = config, True
        self._name, self._state, self._rng = carrier.body.name, carrier.body.state, rng
        self._t_s, self._period_s = 0.0, carrier.period_s
        self._reach_m = math.inf if config.range_m is None else config.range_m
        self._links: tuple[_Link, ...] = ()
        self._coming: deque[tuple[float, RadioMessage]] = deque()

    def connect(self, radios: Sequence[SimulatedRadio]) -> None:
        """Tell it which radios there are in this world, itself among them."""
        self._links = tuple(_Link.between(self, radio) for radio in radios if radio is not self)

    def send(self, t_s: float, content: object) -> None:
        """Broadcast; whether it arrives is drawn from each receiver's own stream, whatever the distance."""
        message = RadioMessage(self._name, t_s, content)
        x, y = self._state[:2].tolist()
        for peer, draw, loss, reach_m, delay_s in self._links:
            lost = loss > 0.0 and draw() < loss
            if lost or not (self.works and peer.works):
                continue
            if reach_m == math.inf or math.dist((x, y), peer._state[:2].tolist()) <= reach_m:
                peer._coming.append((t_s + delay_s, message))

    def read(self) -> RadioMessages:
        """What has arrived since the last reading, in the order in which it was sent."""
        self._t_s += self._period_s
        arrived = []
        while self._coming and self._coming[0][0] <= self._t_s + SLACK_S:
            arrived.append(self._coming.popleft()[1])
        return RadioMessages(tuple(arrived) if self.works else ())
