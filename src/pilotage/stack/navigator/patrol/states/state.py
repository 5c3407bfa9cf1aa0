"""What a state of a robot on patrol is, what a step of it comes to, and which transitions it may ask for."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from pilotage.core.types import Twist
from pilotage.sensors.readings import Readings
from pilotage.stack.navigator.patrol.context import Context
from pilotage.stack.navigator.patrol.passage import Stretch


class State(Protocol):
    """What the robot is about; it holds nothing but what this state alone needs."""

    def step(self, readings: Readings, to: Transitions) -> Move:
        """One control step: the command, and the state that the next step begins in."""


class Move(NamedTuple):
    """The outcome of a step, or of a transition."""

    state: State
    command: Twist


class Transitions(Protocol):
    """The functions of ``transitions``: they build states, hence states are handed them."""

    def arrive(self, context: Context) -> Move:
        """At where it drove to."""

    def resume(self, context: Context) -> Move:
        """On with the patrol."""

    def set_out(self, context: Context) -> State:
        """On to the hop."""

    def forgo(self, context: Context, *, for_long: bool) -> Move | None:
        """Leave it to mates to go there; None where it has to itself."""

    def give_way(self, context: Context) -> Move:
        """Out of the way."""

    def meet(self, context: Context, stretch: Stretch | None, since_s: float) -> Move | None:
        """What comes of a passage for one ahead; None to drive on."""
