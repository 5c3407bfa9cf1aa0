"""What a body touched, as events tell it."""

from __future__ import annotations

from collections.abc import Iterable


def contact_words(touched: Iterable[str]) -> str:
    """``touched`` of a body in a sentence about it."""
    return f"the body touched {' and '.join(touched) or 'something'}"
