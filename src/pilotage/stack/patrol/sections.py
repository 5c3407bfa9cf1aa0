"""What robots on closed walks come through that others come through against them, with room for one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple, TypeAlias

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.stack.patrol.partition import Plan
from pilotage.stack.patrol.passages import ASIDE_M, Passages
from pilotage.stack.patrol.tours import Round

Way: TypeAlias = tuple[int, int]
"""A piece of a passage, and the direction in which it is come through, 1 or -1."""


class Section(NamedTuple):
    """Once through what others come through the other way, from where to where along a walk.

    ``ends_m`` has the ways that it goes, and where along the walk the others' part of each ends.
    """

    begin_m: float
    end_m: float
    ends_m: dict[Way, float]


def sections(plan: Plan, passages: Passages) -> list[list[Section]]:
    """Of each of a plan's walks the sections, by where they begin from its first stop on, below its length.

    A robot that goes round a walk by itself does not meet itself.
    """
    ways = [{way for _, way, _, _ in _passed(walk, passages)} for walk in plan.rounds]
    found = []
    for group, walk in enumerate(plan.rounds):
        others = set().union(*(w for k, w in enumerate(ways) if k != group or plan.sizes[k] > 1))
        found.append(_of_walk(walk, passages, others))
    return found


def until_m(walks: list[list[Section]], passages: Passages) -> FloatArray:
    """(S, S) of all walks' sections, in order: how far through the second one keeps out of the first.

    That is where its last part ends that is come through the other way in the first; 0 where there is none.
    """
    every = [section for walk in walks for section in walk]
    through: dict[Way, list[int]] = {}
    for number, section in enumerate(every):
        for way in section.ends_m:
            through.setdefault(way, []).append(number)
    found = np.zeros((len(every), len(every)))
    for one, section in enumerate(every):
        for way in section.ends_m:
            for against in _against(way, passages):
                for other in through.get(against, ()):
                    behind_m = every[other].ends_m[against] - every[other].begin_m
                    found[one, other] = max(found[one, other], behind_m)
    return found


def _passed(walk: Round, passages: Passages) -> Iterator[tuple[int, Way, float, float]]:
    """Numbers of passages, ways, and from where to where along a walk it goes them, in order."""
    for k, here in enumerate(walk.stops.tolist()):
        there = int(walk.stops[(k + 1) % len(walk.stops)])
        for piece, number, begin_m, end_m in passages.stretches.get((here, there), ()):
            at_m = float(walk.at_m[k])
            yield number, (piece, 1 if here < there else -1), at_m + begin_m, at_m + end_m


def _against(way: Way, passages: Passages) -> Iterator[Way]:
    """The ways against one."""
    piece, direction = way
    yield piece, -direction
    for overlap in passages.overlaps.get(piece, ()):
        yield overlap.piece, -overlap.sign * direction


def _of_walk(walk: Round, passages: Passages, others: Iterable[Way]) -> list[Section]:
    met = set(others)
    found: list[tuple[int, Section]] = []
    for number, way, begin_m, end_m in _passed(walk, passages):
        shares = _contested(way, passages, met)
        if shares is None:
            continue
        since_m, until_m = (begin_m + share * (end_m - begin_m) for share in shares)
        if found and found[-1][0] == number and since_m - found[-1][1].end_m < ASIDE_M:
            before = found.pop()[1]
            joined = Section(before.begin_m, max(before.end_m, until_m), before.ends_m | {way: until_m})
            found.append((number, joined))
        else:
            found.append((number, Section(since_m, until_m, {way: until_m})))
    if len(found) > 1 and found[0][0] == found[-1][0]:
        (_, first), (number, last) = found[0], found[-1]
        if first.begin_m + walk.length_m - last.end_m < ASIDE_M:  # the walk begins within it
            later = {way: end_m + walk.length_m for way, end_m in first.ends_m.items()}
            joined = Section(last.begin_m, first.end_m + walk.length_m, last.ends_m | later)
            found = [*found[1:-1], (number, joined)]
    return [section for _, section in found]


def _contested(way: Way, passages: Passages, others: set[Way]) -> tuple[float, float] | None:
    """From which share of a way to which others go the other way; None where nobody does."""
    piece, direction = way
    if (piece, -direction) in others:
        return 0.0, 1.0
    shares = [
        (overlap.begin, overlap.end) if direction > 0 else (1.0 - overlap.end, 1.0 - overlap.begin)
        for overlap in passages.overlaps.get(piece, ())
        if (overlap.piece, -overlap.sign * direction) in others
    ]
    return (min(begin for begin, _ in shares), max(end for _, end in shares)) if shares else None
