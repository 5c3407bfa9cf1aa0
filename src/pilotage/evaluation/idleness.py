"""Idleness of a patrol's vertices from the visits to them, and what a tour promises."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray, IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Idleness:
    """Time since a vertex's last visit, over vertices and time (Machado et al. 2002).

    Attributes
    ----------
    mean_s, std_s
        Over all vertices and the time looked at, continuously.
    worst_s
        The largest that any vertex had in that time.
    vertex_mean_s, vertex_worst_s
        (V,) the same of each vertex.
    visits
        (V,) visits in that time.
    """

    mean_s: float
    std_s: float
    worst_s: float
    vertex_mean_s: FloatArray
    vertex_worst_s: FloatArray
    visits: IntArray


def idleness(
    vertices: IntArray,
    times_s: FloatArray,
    count: int,
    end_s: float,
    begin_s: float = 0.0,
    warm_s: float = 0.0,
) -> Idleness:
    """Idleness between ``warm_s`` and the end.

    Parameters
    ----------
    vertices, times_s
        (K,) which vertex was visited when; in any order. A robot that stays says so again and again.
    count
        Number of vertices.
    begin_s
        When the patrol began; all vertices count as visited then.
    warm_s
        What came before is the beginning, and is not looked at. Idleness itself goes on from there.
    """
    span_s = end_s - warm_s
    first, second = np.zeros(count), np.zeros(count)
    worst, visits = np.zeros(count), np.zeros(count, dtype=np.int64)
    for vertex in range(count):
        seen_s = np.sort(times_s[vertices == vertex])
        marks = np.concatenate([[begin_s], seen_s[(seen_s > begin_s) & (seen_s < end_s)], [end_s]])
        # Idleness rises from a to b within each gap, as far as it lies in the time looked at.
        until = marks[1:] > warm_s
        b = (marks[1:] - marks[:-1])[until]
        a = (np.maximum(marks[:-1], warm_s) - marks[:-1])[until]
        first[vertex] = ((b**2 - a**2) / 2.0).sum() / span_s
        second[vertex] = ((b**3 - a**3) / 3.0).sum() / span_s
        worst[vertex] = b.max()
        visits[vertex] = int(np.count_nonzero((seen_s > warm_s) & (seen_s <= end_s)))
    mean = float(first.mean())
    std = math.sqrt(max(0.0, float(second.mean()) - mean**2))
    return Idleness(mean, std, float(worst.max()), first, worst, visits)
