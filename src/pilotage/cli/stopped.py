"""What ends a command from outside, and its exit codes."""

from __future__ import annotations

INTERRUPTED = 130
TERMINATED = 143


class Terminated(KeyboardInterrupt):
    """SIGTERM, raised where Ctrl-C would be, so that what is half-written is cleared away."""
