"""What a run leaves: each file's dataclass, writer and reader side by side; the only door to run folders."""
