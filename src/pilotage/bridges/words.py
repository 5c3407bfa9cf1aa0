"""Names as other programs take them: words of topics and fields, and beginnings of files' names."""

from __future__ import annotations

import re
from collections.abc import Iterable
from keyword import iskeyword

LONGEST = 50
"""Characters of a file's name that come from a robot's: they may take four bytes each, of 255."""


def topic_words(names: Iterable[str]) -> list[str]:
    """Small letters, digits and single underscores, each name's own."""
    return _apart(_topic_word(name) for name in names)


def file_words(names: Iterable[str]) -> list[str]:
    """What is no path, no hidden file and no option, each name's own where capitals are small letters too."""
    words = (re.sub(r"[^\w ()+=-]+", "_", name)[:LONGEST].strip(" _-") for name in names)
    return _apart(word or "robot" for word in words)


def _topic_word(name: str) -> str:
    word = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
    # Who reads messages in Python has fields as attributes.
    return word if word[:1].isalpha() and not iskeyword(word) else f"n_{word}".rstrip("_")


def _apart(words: Iterable[str]) -> list[str]:
    """A number after those that were there before."""
    taken: dict[str, str] = {}
    for base in words:
        word, number = base, 2
        while word.casefold() in taken:
            word, number = f"{base}_{number}", number + 1
        taken[word.casefold()] = word
    return list(taken.values())
