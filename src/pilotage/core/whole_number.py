"""Whole numbers in text."""

MOST_DIGITS = 18
"""What is counted, numbered or indexed fits into 64 bits."""


def whole_number(text: str, most_digits: int = MOST_DIGITS) -> int | None:
    """Read a whole number of at least 0, of ASCII digits alone; None where it is none.

    Superscripts and other alphabets' digits, which ``str.isdigit`` takes for digits, are none, nor are
    numbers of more digits than an index may have: ``int`` would refuse some and take long for others.
    """
    return int(text) if text.isascii() and text.isdigit() and len(text) <= most_digits else None
