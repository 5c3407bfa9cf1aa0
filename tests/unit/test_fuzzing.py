"""What damages inputs does not hang on what it has damaged before."""

from __future__ import annotations

from random import Random

from support import damage
from support.damage_text import exchanged


def test_a_word_of_a_million_letters_is_damaged_in_time() -> None:
    """A key was looked for from each of its letters on: ``make fuzz`` hung for an hour and more."""
    for seed in range(12):
        exchanged(damage.WHOLE["a long word"], Random(seed))
