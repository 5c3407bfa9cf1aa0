"""What ends a computation from outside, and how it is recognized wherever it strikes."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

STRUCK = 128
"""The exit code of a process that a signal ended is its number beyond this."""
ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""What asks a process to end: Ctrl-C, a supervisor, a terminal that is gone."""
_SOON_S = 0.01
_LOST_S = 2.0
"""So long after an interruption was raised it is on its way, answered, or some library has dropped it."""
_raised: list[KeyboardInterrupt] = []
"""What was raised and has not ended anything yet that is known of."""
_UNGUARDED = tuple(
    str(Path(*names))
    for names in (
        ("ctypes", "__init__.py"),
        ("llvmlite", "binding", "executionengine.py"),
        ("numba", "core", "serialize.py"),
        ("numpy", "_core", "_internal.py"),
    )
)
"""Files of Python's that C calls functions of, and takes their being interrupted for an answer. Compiled
kernels go on with a null pointer: they ask ``ctypes.cast`` for a random generator's functions, and numba for
the types of what they return. LLVM takes a kept kernel that it was not handed for one without code. NumPy
takes fields that are being compared for fields that cannot be."""


class Terminated(KeyboardInterrupt):
    """SIGTERM or SIGHUP, raised where Ctrl-C would be, so that what is half-written is cleared away."""

    def __init__(self, number: int = signal.SIGTERM) -> None:
        super().__init__()
        self.number = number


def ended_by(stop: KeyboardInterrupt) -> tuple[str, int]:
    """What is said of a process that an interruption ended, and its exit code."""
    if isinstance(stop, Terminated):
        return f"ended by {signal.Signals(stop.number).name}", STRUCK + stop.number
    return "interrupted", STRUCK + signal.SIGINT


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


def _is_unguarded(frame: FrameType | None) -> bool:
    """Whether an interruption in a frame would end the interpreter."""
    while frame is not None:
        if frame.f_code.co_filename.endswith(_UNGUARDED):
            return True
        frame = frame.f_back
    return False


def answered() -> None:
    """Said by who catches an interruption and goes on to an end of its own: it is not raised once more."""
    _raised.clear()


@contextmanager
def never_swallowed() -> Iterator[Callable[[KeyboardInterrupt, FrameType | None], None]]:
    """Raise an interruption once more where it was lost, and what was to end would go on.

    The interpreter prints and forgets one in a destructor or a C callback; a library may call us back and
    take whatever is raised for an answer, as pydantic does where it chooses among a union's members. So one
    that no code is unwinding for after a while, and that nobody has ``answered``, strikes again. For a
    process's main thread. What is yielded raises an interruption that strikes in a frame, a little later
    where the frame cannot bear it.
    """
    if not hasattr(signal, "setitimer"):
        yield _raise_at_once
        return
    lost: list[KeyboardInterrupt] = []

    def hook(unraisable: sys.UnraisableHookArgs) -> None:
        found = None if unraisable.exc_value is None else interruption_in(unraisable.exc_value)
        if found is None:
            before_hook(unraisable)
            return
        raise_later(found)

    def raise_later(stop: KeyboardInterrupt) -> None:
        lost.append(stop)
        signal.setitimer(signal.ITIMER_REAL, _SOON_S)

    def raise_in(stop: KeyboardInterrupt, frame: FrameType | None) -> None:
        if _is_unguarded(frame):
            raise_later(stop)
            return
        _raised[:] = [stop]
        signal.setitimer(signal.ITIMER_REAL, _LOST_S, _LOST_S)
        raise stop

    def again(signum: int, frame: FrameType | None) -> None:  # noqa: ARG001 - as signal calls it
        if lost:
            raise_in(lost.pop(), frame)
        elif _raised and not _is_unwinding():
            raise_in(_raised[0], frame)

    before_hook, before_alarm = sys.unraisablehook, signal.signal(signal.SIGALRM, again)
    sys.unraisablehook = hook
    _raised.clear()
    try:
        yield raise_in
        if lost or _raised:
            raise [*lost, *_raised][0]
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        sys.unraisablehook = before_hook
        signal.signal(signal.SIGALRM, before_alarm)
        _raised.clear()


def _is_unwinding() -> bool:
    """Whether the code that runs now is an interruption's clearing up."""
    handled = sys.exception()
    return handled is not None and interruption_in(handled) is not None


def _raise_at_once(stop: KeyboardInterrupt, frame: FrameType | None) -> None:  # noqa: ARG001 - as it is called
    raise stop


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C be a KeyboardInterrupt wherever it strikes, for who calls from Python or a notebook.

    Without it compiled kernels make a SystemError of it, and one of a thousand ends the interpreter. Nothing
    is changed where Ctrl-C or SIGALRM is in other hands than Python's, or in another thread than the first.
    """
    mine = threading.current_thread() is threading.main_thread() and hasattr(signal, "setitimer")
    if not (
        mine
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
        and signal.getsignal(signal.SIGALRM) is signal.SIG_DFL
    ):
        yield
        return
    with never_swallowed() as raise_in:

        def strike(signum: int, frame: FrameType | None) -> None:  # noqa: ARG001 - as signal calls it
            struck.append(KeyboardInterrupt())
            raise_in(struck[-1], frame)

        struck: list[KeyboardInterrupt] = []
        signal.signal(signal.SIGINT, strike)
        try:
            yield
        except Exception as error:
            # C code may drop an interruption for an error of its own, which tells nothing of it.
            stopped = interruption_in(error) or (struck[0] if struck else None)
            if stopped is None:
                raise
            raise stopped from None
        finally:
            signal.signal(signal.SIGINT, signal.default_int_handler)
