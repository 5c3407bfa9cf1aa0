"""The page of a BARN benchmark: controllers side by side, courses by difficulty, others' results."""
