"""What robots come through that others come through against them."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.stack.patrol.graph import PatrolGraph
from pilotage.stack.patrol.partition import Plan
from pilotage.stack.patrol.passages import OPEN
from pilotage.stack.patrol.sections import Section, sections, until_m
from pilotage.stack.patrol.tours import Round
from support.patrol_floors import on_floor, row, two_doors, walled, with_corridor, with_door


def plan_of(graph: PatrolGraph, *walks: tuple[list[int], int]) -> Plan:
    rounds = tuple(Round.through(graph, np.array(order)) for order, _ in walks)
    return Plan(rounds, tuple(size for _, size in walks), (1.0,) * len(walks), 0.0, 0.0)


def spans(found: list[Section]) -> list[tuple[float, float]]:
    return [(section.begin_m, section.end_m) for section in found]


def test_who_goes_by_himself_meets_nobody_and_two_on_one_round_do() -> None:
    graph, passages = row(with_door(1.0), (2.0, 2.5), (6.0, 2.5))
    assert sections(plan_of(graph, ([0, 1], 1)), passages) == [[]]
    (found,) = sections(plan_of(graph, ([0, 1], 2)), passages)
    (there, back) = spans(found)
    assert there[0] <= 2.0 <= there[1]
    assert back == pytest.approx((8.0 - there[1], 8.0 - there[0]))
    assert sections(plan_of(graph, ([0, 1], 2)), OPEN) == [[]]
    # Either keeps out of the other until it is through, and nobody who comes the same way.
    through_m = there[1] - there[0]
    assert until_m([found], passages) == pytest.approx(np.array([[0.0, through_m], [through_m, 0.0]]))


def test_who_turns_within_a_corridor_is_in_it_once() -> None:
    graph, passages = row(with_corridor(), (2.0, 2.5), (7.0, 2.5), (12.0, 2.5))
    for order in ([0, 1], [1, 0]):  # also a walk that begins there
        (found,) = sections(plan_of(graph, (order, 2)), passages)
        ((begin_m, end_m),) = spans(found)
        assert end_m - begin_m == pytest.approx(6.0, abs=1.0)
        assert 0.0 <= begin_m < 10.0
        assert until_m([found], passages)[0, 0] == pytest.approx(end_m - begin_m)
    (found,) = sections(plan_of(graph, ([0, 1, 2], 2)), passages)
    assert [end_m - begin_m for begin_m, end_m in spans(found)] == pytest.approx([6.0, 6.0], abs=1.0)


def test_who_go_round_one_way_meet_nobody() -> None:
    graph, passages = two_doors()
    assert passages.pieces == 2
    there, back = [0, 1, 2, 3], [3, 2, 1, 0]
    assert sections(plan_of(graph, (there, 8)), passages) == [[]]
    assert sections(plan_of(graph, (there, 3), (there, 5)), passages) == [[], []]
    assert [len(found) for found in sections(plan_of(graph, (there, 1), (back, 1)), passages)] == [2, 2]


def test_of_a_long_passage_only_the_door_is_shared_with_who_turns_in_there() -> None:
    """A corridor, two doors: one goes out of the first, along and in at the second, both ways apart."""
    walls = [(0.0, 1.1, 3.5, 1.1), (4.5, 1.1, 9.5, 1.1), (10.5, 1.1, 14.0, 1.1), (7.0, 1.1, 7.0, 5.0)]
    places = [(4.0, 3.5), (4.0, 0.55), (10.0, 0.55), (10.0, 3.5)]
    graph, passages = on_floor(walled(14, 5, *walls), places, [(0, 1), (1, 2), (2, 3)])
    one, other = sections(plan_of(graph, ([0, 1, 2, 3], 1), ([0, 1], 1)), passages)
    # There and back it meets the other one at the first door alone.
    assert [end_m - begin_m for begin_m, end_m in spans(one)] == pytest.approx([1.4, 1.4], abs=1.1)
    whole, _ = sections(plan_of(graph, ([0, 1, 2, 3], 2), ([0, 1], 1)), passages)
    assert max(end_m - begin_m for begin_m, end_m in spans(whole)) > 6.0
    assert len(other) == 1


def test_paths_of_different_edges_that_lie_on_each_other_are_met_in() -> None:
    """Along a corridor that two edges lead through, from door to door, from different places."""
    walls = [(4, 0, 4, 2.05), (4, 2.95, 4, 5), (10, 0, 10, 2.05), (10, 2.95, 10, 5)]
    world = walled(14, 5, *walls, (4, 2.05, 10, 2.05), (4, 2.95, 10, 2.95))
    places = [(1.0, 1.0), (13.0, 1.0), (1.0, 4.0), (13.0, 4.0)]
    graph, passages = on_floor(world, places, [(0, 1), (1, 3), (3, 2), (2, 0)])
    assert passages.pieces == 2
    (one,), (other,) = passages.overlaps[0], passages.overlaps[1]
    assert (one.piece, other.piece, one.sign, other.sign) == (1, 0, 1, 1)  # both by the smaller number first
    assert one.end - one.begin == pytest.approx(1.0, abs=0.1)
    # Once around comes through it by the one edge and back by the other.
    (found,) = sections(plan_of(graph, ([0, 1, 3, 2], 2)), passages)
    assert [end_m - begin_m for begin_m, end_m in spans(found)] == pytest.approx([6.0, 6.0], abs=1.0)
    assert (until_m([found], passages) > 5.0).tolist() == [[False, True], [True, False]]


def test_paths_that_cross_are_not_met_in() -> None:
    """Two corridors with room for one that cross."""
    low, high = (0.0, 2.5), (3.5, 6.0)
    walls = [(x, *ends) for x in (2.5, 3.5) for ends in (low, high)]
    world = walled(6, 6, *((x, a, x, b) for x, a, b in walls), *((a, y, b, y) for y, a, b in walls))
    places = [(0.6, 3.0), (5.4, 3.0), (3.0, 0.6), (3.0, 5.4)]
    _, passages = on_floor(world, places, [(0, 1), (2, 3), (1, 2)])
    (one,), (other,) = passages.stretches[0, 1], passages.stretches[2, 3]
    assert other.piece not in {overlap.piece for overlap in passages.overlaps.get(one.piece, ())}
    # Who turns off lies on both.
    assert {overlap.piece for overlap in passages.overlaps[one.piece]} == {
        stretch.piece for stretch in passages.stretches[1, 2]
    }


def test_no_passages_at_all() -> None:
    graph, passages = row(walled(8, 5), (2.0, 2.5), (6.0, 2.5))
    assert (passages.pieces, passages.overlaps) == (0, {})
    assert until_m([[]], passages).shape == (0, 0)
    assert sections(plan_of(graph, ([0, 1], 2)), passages) == [[]]
