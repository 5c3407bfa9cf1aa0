"""Judging: trajectory errors, consistency, path quality. The only place where truth meets estimate."""
