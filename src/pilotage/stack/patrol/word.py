"""What a robot on patrol broadcasts: what its strategy has to tell, and where it is in the others' way."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.stack.patrol.messages import PatrolMessage


@dataclass(frozen=True, slots=True, eq=False)
class TeamWord:
    """One broadcast.

    Attributes
    ----------
    x_m, y_m
        Where it believes to be; NaN while it does not know.
    blocked
        Whether something that moves keeps it from getting on.
    news
        Of the patrol.
    """

    x_m: float
    y_m: float
    blocked: bool
    news: PatrolMessage
