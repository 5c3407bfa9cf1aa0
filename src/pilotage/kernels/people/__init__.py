"""People who walk: how they push each other, and what touches them."""
