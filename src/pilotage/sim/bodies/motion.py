"""The role of a simulated motion, and the registry by which each data sheet finds its own."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from pilotage.core.checked import Gives, keeps
from pilotage.core.errors import InputError
from pilotage.core.misfit import kept, told, unfit_array, unfit_number
from pilotage.core.types import Command, FloatArray, Twist
from pilotage.sim.by_config import ByConfig

MOST_A_STEP = 10_000.0
"""Metres or radians: no robot drives farther, and to look for contacts on the way takes for ever."""


class SimulatedMotion(Protocol):
    """How commands become moves; whether a move is possible is the body's business.

    Built with its config, the step's length, the samples a step that the robot's sensors take, the robot's
    random streams, and its place in the mission for messages.

    Attributes
    ----------
    moves
        (K, 3) moves of the next step, each at constant twist: forward and lateral distance, angle.
    spins_on
        Whether wheels spin on at a contact, so that the body turns on while its centre stays.
    release_m
        How clear the body has to be again before a new contact counts.
    turned_rad
        Angles that the left and right wheel have turned so far, on the test bench and on the floor alike;
        None for motions without two driven wheels.
    """

    moves: FloatArray
    spins_on: bool
    release_m: float

    @property
    def turned_rad(self) -> tuple[float, float] | None:
        """See above."""

    def command(self, command: Command) -> None:
        """Fill ``moves`` for a step under a command."""

    def stop(self) -> None:
        """Stand still: a contact ended the last step, or the robot was carried elsewhere."""


def _unfit_kept(motion: SimulatedMotion) -> str:
    moves = kept(motion, "moves")
    wrong = unfit_array(moves, 3) or ("" if len(moves) else f"an array {moves.shape}")
    if wrong:
        return f"moves {wrong}"
    spins_on, release_m = (kept(motion, name) for name in ("spins_on", "release_m"))
    if not isinstance(spins_on, bool | np.bool_):
        return f"spins_on {told(spins_on)}"
    return unfit_number(release_m) and f"release_m {unfit_number(release_m)}"


def _count(motion: SimulatedMotion) -> int:
    return len(motion.moves)


def _unfit(_: None, motion: SimulatedMotion, before: int, *__: object) -> str:
    wrong = unfit_array(motion.moves, 3)
    # The body's arrays are as long as the first moves.
    if wrong or len(motion.moves) != before:
        return wrong or f"{len(motion.moves)} moves instead of {before}"
    most = float(np.abs(motion.moves).max())
    return f"a move of {most:g} m or rad" if most > MOST_A_STEP else ""


MOVES = f"moves (K, 3) of numbers up to {MOST_A_STEP:,.0f} (m and rad a step)"

SIMULATED_MOTIONS: ByConfig[SimulatedMotion] = ByConfig(
    "motion",
    "pilotage.sim.bodies",
    keeps("moves (K, 3) of numbers, K never another, spins_on and release_m", _unfit_kept),
    Gives("command", MOVES, _unfit, before=_count),
    Gives("stop", MOVES, _unfit, before=_count),
)
"""Data sheets to what they truly do."""


def as_twist(command: Command, motion: str) -> Twist:
    """The command of a motion that follows twists only.

    Raises
    ------
    InputError
        For wheel speeds.
    """
    if type(command) is Twist:
        return command
    raise InputError(f"{motion}: expected a twist as command, found {type(command).__name__}")
