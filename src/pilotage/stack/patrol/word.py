"""What a robot on patrol broadcasts: what its strategy has to tell, and where it is in the others' way."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.core.types import FloatArray
from pilotage.stack.patrol.messages import PatrolMessage


@dataclass(frozen=True, slots=True, eq=False)
class Claim:
    """That a robot is in a passage that has room for one, or about to enter it.

    Attributes
    ----------
    line_xy_m
        (K, 2) from where it enters, or is, to where it leaves, in order; one place of who stands there.
    turn, since_s
        Who claims first goes first, by turns: those who claim within some seconds in one direction together.
    inside
        Whether it is in the passage.
    """

    line_xy_m: FloatArray
    turn: int
    since_s: float
    inside: bool


@dataclass(frozen=True, slots=True, eq=False)
class Clearing:
    """That a robot has not got on for long, goes first now, and where others are to go for that.

    Attributes
    ----------
    since_s
        From when on it has not got on: of several the one of the earliest goes first.
    orders
        Numbers of robots, and the place x_m, y_m that each is to go to and to wait at.
    """

    since_s: float
    orders: tuple[tuple[int, float, float], ...]


@dataclass(frozen=True, slots=True)
class Talk:
    """How a robot talks, by its data sheets: who hears it knows what to expect.

    Attributes
    ----------
    period_s
        At least one word in so long.
    reach_m, loss
        Of its radio.
    speed_m_s
        It drives no faster.
    """

    period_s: float
    reach_m: float
    loss: float
    speed_m_s: float


@dataclass(frozen=True, slots=True, eq=False)
class TeamWord:
    """One broadcast.

    Attributes
    ----------
    x_m, y_m
        Where it believes to be; NaN while it does not know.
    blocked
        Whether something that moves keeps it from getting on.
    claim
        Of a passage; None: it is near none.
    clearing
        None unless it goes first.
    news
        Of the patrol.
    radius_m
        Of the disc around its body.
    standing
        Places of bodies that it saw stand for long, who say nothing: it plans around them, and how much more
        than from others it keeps from each.
    talk
        When to expect more; None: nothing is known of that.
    braking_m_s2
        What it can be relied on to brake with; None: what its data sheet says.
    """

    x_m: float
    y_m: float
    blocked: bool
    claim: Claim | None
    clearing: Clearing | None
    news: PatrolMessage
    radius_m: float
    standing: tuple[tuple[float, float, float], ...] = ()
    talk: Talk | None = None
    braking_m_s2: float | None = None
