"""Who of a team was heard lately, and what a scan shows that is of nobody of it."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import Pose2
from pilotage.kernels.control.disc_returns import is_near_beside
from pilotage.stack.navigator.patrol.mates import Mates
from pilotage.stack.patrol.last_words import LastWords
from pilotage.stack.patrol.messages import PatrolMemory, PatrolState
from pilotage.stack.patrol.word import Talk, TeamWord

NEWS = PatrolMemory(2, 1, 2, 0, 1.0).message(0.0)
HERE = Pose2(3.0, 4.0, 0.7)


def word(x_m: float = 0.0, y_m: float = 0.0, radius_m: float = 0.3, talk: Talk | None = None) -> TeamWord:
    return TeamWord(x_m, y_m, False, None, None, NEWS, radius_m, talk=talk)


def test_who_was_heard_lately_is_what_going_through_all_would_find() -> None:
    """Both answers are kept from one step to the next, and every word may change them."""
    rng, mates = np.random.default_rng(5), Mates()
    said: dict[int, tuple[float, TeamWord]] = {}
    within_s, patience_s = 3.0, 2.0
    for step in range(3000):
        t_s = 0.1 * step
        # Delayed words are older than others that were heard before.
        for number in np.flatnonzero(rng.random(6) < [0.1, 0.05, 0.03, 0.02, 0.01, 0.0]).tolist():
            said[number] = (max(said.get(number, (0.0,))[0], t_s - rng.choice([0.0, 1.0])), word(step))
            mates.hear(number, *said[number])
        lately = [(n, w) for n, (sent_s, w) in said.items() if sent_s > t_s - within_s]
        assert list(mates.lately(t_s, within_s)) == lately
        assert mates.silent(t_s - patience_s) == [w for s, w in said.values() if s <= t_s - patience_s]
    assert len(said) == len(mates) == 5


class TestNobody:
    """What is within 0.3 m of a mate's body where it said it is, and 1 m/s since, is the mate."""

    def of_nobody(self, words: LastWords, points: np.ndarray, t_s: float = 10.0) -> np.ndarray:
        return words.of_nobody(points, HERE, 0, t_s, 0.3, 1.0)

    def test_is_what_no_mate_may_be(self) -> None:
        rng, words = np.random.default_rng(6), LastWords(4, (0.0, 0.0, 9.0, 9.0))
        places, sent_s = rng.uniform(0.0, 9.0, (4, 2)), np.array([0.0, 9.9, 9.5, 9.0])
        radii_m, speeds_m_s = np.array([0.3, 0.1, 0.9]), np.array([1.0, 2.0, 0.2])
        for number in range(1, 4):
            talk = None if number == 1 else Talk(1.0, 60.0, 0.0, speeds_m_s[number - 1])
            x, y = places[number].tolist()
            words.hear(number, sent_s[number], word(x, y, float(radii_m[number - 1]), talk))
        points = rng.uniform(-6.0, 6.0, (400, 2))
        c, s = math.cos(HERE.theta_rad), math.sin(HERE.theta_rad)
        there = points @ np.array([[c, s], [-s, c]]) + [HERE.x_m, HERE.y_m]
        away = np.linalg.norm(there[:, None] - places[None, 1:], axis=2)
        expected = (away > radii_m + 0.3 + speeds_m_s * (10.0 - sent_s[1:])).all(axis=1)
        assert 100 < expected.sum() < 390
        assert np.array_equal(self.of_nobody(words, points), points[expected])

    def test_is_seen_by_who_has_no_mates_and_not_while_a_mate_may_be_anywhere(self) -> None:
        points = np.array([[1.0, 0.0], [5.0, 5.0]])
        assert np.array_equal(self.of_nobody(LastWords(1, (0.0, 0.0, 9.0, 9.0)), points), points)
        words = LastWords(3, (0.0, 0.0, 9.0, 9.0))
        words.hear(1, 10.0, word(0.0, 0.0))
        assert not len(self.of_nobody(words, points))  # the other was never heard
        words.hear(2, 10.0, word(math.nan, math.nan))
        assert not len(self.of_nobody(words, points))  # and does not know where it is
        words.hear(2, 10.0, word(0.0, 1.0))
        assert np.array_equal(self.of_nobody(words, points), points)


def test_what_is_near_counts_beside_those_who_stay() -> None:
    pose, near = np.array([HERE.x_m, HERE.y_m, HERE.theta_rad]), np.array([[0.8, 0.0]])
    there = HERE.x_m + 0.8 * math.cos(HERE.theta_rad), HERE.y_m + 0.8 * math.sin(HERE.theta_rad)
    discs = np.array([[*there, 0.3]])
    assert is_near_beside(near, pose, 0.9, discs[:0], 0.2)
    assert not is_near_beside(near, pose, 0.7, discs[:0], 0.2)
    assert not is_near_beside(near, pose, 0.9, discs, 0.2)
    assert is_near_beside(near, pose, 0.9, discs + np.array([0.6, 0.0, 0.0]), 0.2)
    assert not is_near_beside(near, pose, 0.9, discs + np.array([0.4, 0.0, 0.0]), 0.2)


def test_news_read_together_are_what_one_after_the_other_tells() -> None:
    """Of six robots that hear half of what is said, at first of few, asked now and then."""
    rng, team = np.random.default_rng(8), 6
    memories = [PatrolMemory(9, k, team, k, 1.0) for k in range(team)]
    visited_s = np.zeros((team, 9))
    newest: list[dict[int, PatrolState]] = [{} for _ in range(team)]
    for step in range(1, 400):
        sender = int(rng.integers(team))
        vertex = int(rng.integers(9))
        memories[sender].visit(vertex, float(step))
        visited_s[sender, vertex] = step
        message = memories[sender].message(float(step))
        assert np.array_equal(message.visited_s, visited_s[sender])
        assert {s.robot: s for s in message.states if s.robot != sender} == newest[sender]
        for other in np.flatnonzero(rng.random(team) < 0.5).tolist():
            if other == sender:
                continue
            memories[other].receive(message)
            visited_s[other] = np.maximum(visited_s[other], message.visited_s)
            for state in message.states:
                known = newest[other].get(state.robot)
                if state.robot != other and (known is None or state.t_s > known.t_s):
                    newest[other][state.robot] = state
    for k, memory in enumerate(memories):
        knowledge = memory.knowledge(400.0)
        assert np.array_equal(knowledge.visited_s, visited_s[k])
        assert [knowledge.states[j] for j in range(team) if j != k] == [
            newest[k].get(j) for j in range(team) if j != k
        ]
