"""Which topic of a bag is meant: the one named, else the usual one among those of its kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pilotage.core.errors import InputError
from pilotage.logs.bag_messages import OpenBag, Topic


@dataclass(frozen=True, slots=True)
class Kind:
    """What a topic may hold.

    Attributes
    ----------
    what
        For messages.
    types
        Message types, ``package/msg/Name``.
    usual
        Names that are taken before others of the types.
    never
        Names that are not taken unless they are asked for.
    """

    what: str
    types: tuple[str, ...]
    usual: tuple[str, ...] = ()
    never: tuple[str, ...] = ()
    by_name_only: bool = False
    """Whether a topic of another than the usual names is taken only where it is asked for."""

    def __str__(self) -> str:
        return f"{self.what} in {' or '.join(self.usual)}" if self.by_name_only else " or ".join(self.types)


def full_name(topic: str) -> str:
    """A topic's name with the slash that is often left out."""
    return "/" + topic.lstrip("/")


def sorted_out(bag: OpenBag, path: Path, topics: Sequence[str], kinds: Sequence[Kind]) -> list[str | None]:
    """Which of the topics asked for by name alone is of which kind, by their types; the last one counts.

    Raises
    ------
    InputError
        Where a topic is not in the bag or of none of the kinds.
    """
    types = {full_name(topic.name): topic.msgtype for topic in bag.topics if topic.count}
    out: list[str | None] = [None] * len(kinds)
    for asked in topics:
        wanted = full_name(asked)
        msgtype = types.get(wanted)
        if msgtype is None:
            raise InputError(f"{path}: expected the topic {wanted}, {holds(bag.topics)}")
        fitting = [k for k, kind in enumerate(kinds) if msgtype in kind.types]
        if not fitting:
            known = " or ".join(map(str, kinds))
            raise InputError(f"{path}: topic {wanted}: expected {known}, found {msgtype}")
        for k in fitting:
            out[k] = wanted
    return out


def pick(bag: OpenBag, path: Path, kind: Kind, asked: str | None, said: list[str]) -> str | None:
    """The bag's topic of a kind, by the name that the bag has for it; None where it holds none.

    Raises
    ------
    InputError
        Where the one asked for is not there; the message tells what the bag holds.
    """
    fitting = [topic for topic in bag.topics if topic.msgtype in kind.types and topic.count]
    if asked is not None:
        wanted = full_name(asked)
        found = next((topic.name for topic in fitting if full_name(topic.name) == wanted), None)
        if found is None:
            raise InputError(f"{path}: expected the topic {wanted} of {kind}, {holds(bag.topics)}")
        return found
    fitting = [
        topic
        for topic in fitting
        if full_name(topic.name) not in kind.never
        and (not kind.by_name_only or full_name(topic.name) in kind.usual)
    ]
    if not fitting:
        return None
    best = max(fitting, key=lambda topic: (full_name(topic.name) in kind.usual, topic.count))
    if len(fitting) > 1:
        others = ", ".join(topic.name for topic in fitting if topic is not best)
        said.append(f"{kind.what} are taken from {best.name} (also there: {others})")
    return best.name


def holds(topics: Sequence[Topic]) -> str:
    """What a bag holds, for messages."""
    return "found " + (", ".join(map(str, topics)) if topics else "no topics")
