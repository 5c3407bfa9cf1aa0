"""Path following, reactions to what is near, and ways out of a trap."""
