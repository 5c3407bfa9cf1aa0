"""Text from outside made fit for a terminal: no control characters, and of bounded length."""

from __future__ import annotations

import unicodedata

LONGEST_WORD = 160
"""Characters of one word (a name, a number, a path) that are shown; longer ones lose their middle."""
LONGEST_TEXT = 1500

_HIDDEN = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"})
"""Unicode categories that a terminal obeys or cannot show: controls, bidi marks, half surrogates."""


def visible(text: str, keep: str = "") -> str:
    r"""Write what a terminal would obey or could not show as an escape such as ``\x1b``.

    Parameters
    ----------
    keep
        Characters that are let through, such as a table's own line ends.
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(
        character
        if character in keep or unicodedata.category(character) not in _HIDDEN
        else _escape(character)
        for character in text
    )


def shown(text: str, most: int = LONGEST_TEXT) -> str:
    """One line of bounded length: white space in a row is one blank, long words and lines lose their middle.

    A message begins with the place and ends with what is wrong there.
    """
    if len(text) > 20 * most:  # what is between is never looked at
        text = f"{text[: 10 * most]} {text[-10 * most :]}"
    # Split first: the line ends of a message are blanks, not escapes.
    words = [_short(visible(word)) for word in text.split()]
    line = " ".join(words)
    return line if len(line) <= most else f"{line[: most - most // 3 - 3]}...{line[-(most // 3) :]}"


def _short(word: str) -> str:
    if len(word) <= LONGEST_WORD:
        return word
    tail = LONGEST_WORD // 3
    return f"{word[: LONGEST_WORD - tail - 3]}...{word[-tail:]}"


def _escape(character: str) -> str:
    code = ord(character)
    if code < 0x100:
        return f"\\x{code:02x}"
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
