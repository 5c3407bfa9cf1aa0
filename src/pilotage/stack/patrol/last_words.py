"""The last words of team mates: where each may be by now, and how unlikely its silence is by chance."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.patrol import words
from pilotage.stack.patrol.word import Talk, TeamWord

PRIOR_WORDS, PRIOR_LOST = 10.0, 1.0
"""Before words were counted it is taken that so many of so many were lost."""
LEAST_LOSS = 0.1
"""However good a radio is, silences of a few words happen."""
UNTOLD = (math.nan, math.nan, math.nan, math.nan)


class LastWords:
    """Of each robot its last word of its own, and how many it should have been heard to say since.

    A mate is surely in reach while it cannot have driven out of it since it last said where it is, or where
    the whole floor is within reach. Words are lost one by one, by the share that the radios' data sheets say
    or that was lost of late, whichever is more.
    """

    def __init__(self, team: int, bounds_m: tuple[float, float, float, float]) -> None:
        xmin, ymin, xmax, ymax = bounds_m
        self._corners = np.array([(x, y) for x in (xmin, xmax) for y in (ymin, ymax)])
        self._words, self._t_s = np.full((team, words.WIDTH), math.nan), 0.0

    def hear(self, number: int, sent_s: float, word: TeamWord) -> None:
        """A mate said something itself."""
        talk, x, y = word.talk, word.x_m, word.y_m
        habit = UNTOLD if talk is None else (talk.reach_m, talk.period_s, talk.speed_m_s, talk.loss)
        words.hear(self._words, number, sent_s, x, y, word.radius_m, *habit, PRIOR_WORDS, PRIOR_LOST)

    def of_nobody(
        self, points: FloatArray, pose: Pose2, own: int, t_s: float, told_m: float, speed_m_s: float
    ) -> FloatArray:
        """Those of returns (M, 2), base frame, that are of no mate; none while one may be anywhere."""
        return words.of_nobody(points, pose.as_array(), self._words, own, t_s, told_m, speed_m_s)

    def step(self, t_s: float, pose: Pose2, own: Talk, *, lost: bool) -> None:
        """Time has passed; who is ``lost`` does not know how far from a mate it is."""
        x, y = (math.nan, math.nan) if lost else (pose.x_m, pose.y_m)
        words.await_words(self._words, t_s, t_s - self._t_s, x, y, own.reach_m, self._corners)
        self._t_s = t_s

    def chances_log(self, own: Talk) -> FloatArray:
        """(N,) logarithm of the probability that each robot's silence is chance; 0 of who was never heard."""
        found = np.empty(len(self._words))
        words.chances_log(self._words, own.loss, LEAST_LOSS, found)
        return found

    def whereabouts(self, t_s: float, heard_within_s: float, told_m: float, speed_m_s: float) -> FloatArray:
        """(N, 4) where each robot is: x, y, within what distance of that, and its radius (m).

        NaN for who does not know or was not heard within so long. Places are told ``told_m`` wrong, and
        mates drive on at the speed that they tell, else at ``speed_m_s``.
        """
        found = np.empty((len(self._words), 4))
        words.whereabouts(self._words, t_s, heard_within_s, told_m, speed_m_s, found)
        return found
