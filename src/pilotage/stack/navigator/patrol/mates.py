"""The last word of each team mate: who was heard lately, and who fell silent."""

from __future__ import annotations

import math
from collections.abc import ItemsView

from pilotage.stack.patrol.word import TeamWord


class Mates:
    """Keeps them by number, in the order in which they were heard first.

    Asked at every step, and what a mate says changes the answers once a second at most: both remember from
    when on they may be others.
    """

    def __init__(self) -> None:
        self._said: dict[int, tuple[float, TeamWord]] = {}
        self._lately: dict[int, TeamWord] = {}
        self._lately_until_s, self._oldest_s = -math.inf, math.inf

    def __len__(self) -> int:
        return len(self._said)

    def __contains__(self, number: int) -> bool:
        return number in self._said

    def __getitem__(self, number: int) -> tuple[float, TeamWord]:
        """When a mate's last word was sent, and the word."""
        return self._said[number]

    def items(self) -> ItemsView[int, tuple[float, TeamWord]]:
        """Of all who were ever heard."""
        return self._said.items()

    def hear(self, number: int, sent_s: float, word: TeamWord) -> None:
        """A mate said something."""
        self._said[number] = sent_s, word
        self._oldest_s = min(self._oldest_s, sent_s)
        if number in self._lately:
            self._lately[number] = word
        else:
            self._lately_until_s = -math.inf

    def lately(self, t_s: float, within_s: float) -> ItemsView[int, TeamWord]:
        """Of those whose last word was sent within so long, always the same, before ``t_s``."""
        if t_s >= self._lately_until_s:
            fresh = [(number, *said) for number, said in self._said.items() if said[0] > t_s - within_s]
            self._lately = {number: word for number, _, word in fresh}
            self._lately_until_s = min((sent_s for _, sent_s, _ in fresh), default=math.inf) + within_s
        return self._lately.items()

    def silent(self, latest_s: float) -> list[TeamWord]:
        """Of those whose last word is not newer."""
        if self._oldest_s > latest_s:
            return []
        self._oldest_s = min((sent_s for sent_s, _ in self._said.values()), default=math.inf)
        return [word for sent_s, word in self._said.values() if sent_s <= latest_s]
