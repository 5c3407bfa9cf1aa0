"""What ends a command from outside, its exit codes, and how it is recognized wherever it strikes."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

INTERRUPTED = 130
TERMINATED = 143
_SOON_S = 0.01


class Terminated(KeyboardInterrupt):
    """SIGTERM, raised where Ctrl-C would be, so that what is half-written is cleared away."""


def interruption_in(error: BaseException) -> KeyboardInterrupt | None:
    """The interruption that an error comes from, or None.

    One that strikes while a compiled kernel is called comes out as a SystemError, a library may wrap it in an
    error of its own, and clearing up may fail on the way: the chain of causes tells.
    """
    seen: set[int] = set()
    waiting: list[BaseException | None] = [error]
    while waiting:
        found = waiting.pop()
        if found is None or id(found) in seen:
            continue
        if isinstance(found, KeyboardInterrupt):
            return found
        seen.add(id(found))
        waiting += [found.__cause__, found.__context__]
        if isinstance(found, BaseExceptionGroup):
            waiting += found.exceptions
    return None


@contextmanager
def never_swallowed() -> Iterator[None]:
    """Raise an interruption once more where the interpreter could not: in a destructor or a C callback.

    There it would be printed and forgotten, and the command would go on. For a process's main thread.
    """
    if not hasattr(signal, "setitimer"):
        yield
        return
    lost: list[KeyboardInterrupt] = []

    def hook(unraisable: sys.UnraisableHookArgs) -> None:
        found = None if unraisable.exc_value is None else interruption_in(unraisable.exc_value)
        if found is None:
            before_hook(unraisable)
            return
        lost.append(found)
        signal.setitimer(signal.ITIMER_REAL, _SOON_S)

    def again(signum: int, frame: object) -> None:  # noqa: ARG001 - as signal calls it
        if lost:
            raise type(lost[-1])

    before_hook, before_alarm = sys.unraisablehook, signal.signal(signal.SIGALRM, again)
    sys.unraisablehook = hook
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        sys.unraisablehook = before_hook
        signal.signal(signal.SIGALRM, before_alarm)
