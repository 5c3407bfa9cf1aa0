"""The true world: bodies, collisions, and what each sensor would read."""
