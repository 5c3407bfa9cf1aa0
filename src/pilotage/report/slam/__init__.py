"""The page of a mapped recording."""
