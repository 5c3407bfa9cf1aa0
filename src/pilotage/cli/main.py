"""The entry point: run one command, turn what went wrong into one line and an exit code.

Exit codes: 0 done, 1 the task failed in the field, 2 bad input, 130 interrupted, 143 and 129 asked to end by
SIGTERM and SIGHUP, 141 the reader of the output went away, 70 a bug (it alone shows our traceback; a plugin's
bug is bad input and shows the plugin's).
"""

from __future__ import annotations

import io
import os
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from pilotage.core.interruptions import (
    ENDING,
    STRUCK,
    Terminated,
    ended_by,
    interruption_in,
    never_swallowed,
)

BAD_INPUT = 2
BUG = 70
BROKEN_PIPE = 141
NO_MEMORY = "this needs more memory than there is; take a smaller or coarser input"
UNMAPPED = ("failed to map segment", "cannot allocate memory")
"""What the system's loader says of a library for which there is no memory."""
LEAST_ADDRESSES = 600 * 2**20
"""Bytes of address space below which NumPy's and SciPy's libraries end the process, or never end loading."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code.

    Parameters
    ----------
    arguments
        The words after ``pilotage``; None takes them from the process.
    """
    # Everything is imported inside, so that Ctrl-C during an import is one line as well.
    try:
        _steady_streams()
        if arguments is None:
            if _few_addresses():
                return _without_memory()
            _steady_environment()
        with _ended_once(for_good=arguments is None) as struck:
            return _run(sys.argv[1:] if arguments is None else list(arguments), struck)
    except KeyboardInterrupt as stop:
        # One that struck in code compiled from text, as libraries make it, has `python -m pilotage` end by
        # SIGINT, whatever the exit code: other code from text takes that back.
        exec("")
        if arguments is None:
            # The process ends: of objects left half made, whose destructors fail, there is nothing to tell.
            sys.unraisablehook = lambda _: None
        return _say(*ended_by(stop))
    except MemoryError:
        # Where even to tell of a fault there was none.
        return _without_memory()
    except BrokenPipeError:
        _to_nowhere_if_full()
        return BROKEN_PIPE


@contextmanager
def _ended_once(for_good: bool) -> Iterator[list[KeyboardInterrupt]]:
    """Let SIGTERM and SIGHUP unwind as Ctrl-C does, and none of them twice; what struck is yielded.

    A second one must not cut the clearing away short, nor the interpreter's own end where the process ends
    with the command (``for_good``). Only a process's main thread can ask for that.
    """
    struck: list[KeyboardInterrupt] = []
    if threading.current_thread() is not threading.main_thread():
        yield struck
        return

    def end(signum: int, frame: FrameType | None) -> None:
        for number in before:
            signal.signal(number, signal.SIG_IGN)
        struck.append(KeyboardInterrupt() if signum == signal.SIGINT else Terminated(signum))
        raise_in(struck[0], frame)

    before = {number: signal.getsignal(number) for number in ENDING}
    # What is ignored from the start stays so: Ctrl-C by a shell's background job, SIGHUP by nohup.
    caught = [number for number in before if before[number] is not signal.SIG_IGN]
    with never_swallowed() as raise_in:
        try:
            for number in caught:
                signal.signal(number, end)
            yield struck
        finally:
            # Where the process ends now, nothing is left that a signal could spare it.
            for number in caught:
                signal.signal(number, signal.SIG_IGN if for_good else before[number])


def _steady_streams() -> None:
    """A stream that was closed leads nowhere; a character that its encoding lacks is shown as '?'."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115 - open until the process ends
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _steady_environment() -> None:
    """Pictures go to files, whatever was set for a notebook; a number that is none ends Numba and NumPy.

    Matplotlib's words on a folder of its own that cannot be written are nothing to who asked for a run.
    """
    import logging

    from pilotage.core.memory import look_seldom
    from pilotage.core.whole_number import whole_number

    look_seldom()
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    os.environ["MPLBACKEND"] = "Agg"
    if not whole_number(os.environ.get("NUMBA_NUM_THREADS", "1")):
        del os.environ["NUMBA_NUM_THREADS"]
    if whole_number(os.environ.get("SOURCE_DATE_EPOCH", "0")) is None:
        del os.environ["SOURCE_DATE_EPOCH"]


def _run(arguments: list[str], struck: list[KeyboardInterrupt]) -> int:
    from pilotage.cli.app import dispatch
    from pilotage.core.errors import InputError
    from pilotage.core.plugins import consequence_of, fault_of, refusal_of, take_nothing

    take_nothing()
    try:
        code = dispatch(arguments)
        sys.stdout.flush()
        if struck and code < STRUCK:  # it has ended what was to go on, and told of it
            raise struck[0]
        return code
    except BrokenPipeError:
        raise
    except BaseException as error:
        fault = fault_of(error)
        # C code may drop an interruption for an error of its own, which tells nothing of it. One that no
        # signal struck is a plugin's own.
        stopped = struck[0] if struck else interruption_in(error)
        if stopped is not None and (struck or fault is None):
            raise stopped from None
        if isinstance(error, InputError):
            return _say(refusal_of(error), BAD_INPUT)
        if fault is not None:
            print(fault.traceback, file=sys.stderr)
            return _say(fault.line, BAD_INPUT)
        if isinstance(error, SystemExit):
            raise
        if _for_want_of_memory(error):
            return _without_memory()
        if isinstance(error, OSError):
            return _say(_told(error), BAD_INPUT)
        fault = consequence_of(error)
        if fault is not None:
            print(fault.traceback, file=sys.stderr)
            return _say(fault.line, BAD_INPUT)
        import traceback

        traceback.print_exc()
        return _say("this is a bug in pilotage; please report it with the lines above", BUG)


def _for_want_of_memory(error: BaseException) -> bool:
    """Whether an error says that there is no memory, or that a library could not be loaded into any."""
    if isinstance(error, MemoryError):
        return True
    before = error.__cause__ or error.__context__
    told = str(error).lower() if isinstance(error, ImportError | OSError) else ""
    return any(word in told for word in UNMAPPED) or (
        isinstance(error, ImportError | OSError) and before is not None and _for_want_of_memory(before)
    )


def _few_addresses() -> bool:
    """Whether the process was given an address space (``ulimit -v``) in which nothing can be computed."""
    try:
        import resource
    except ImportError:  # a system without such limits
        return False
    most, _ = resource.getrlimit(resource.RLIMIT_AS)
    return most != resource.RLIM_INFINITY and most < LEAST_ADDRESSES


def _without_memory() -> int:
    """One line; what the interpreter's end has no memory for either is nothing to tell."""
    sys.unraisablehook = lambda _: None
    return _say(NO_MEMORY, BAD_INPUT)


def _told(error: OSError) -> str:
    """What the system refused, and where; relative paths lead nowhere from a folder that was deleted."""
    if isinstance(error, FileNotFoundError) and not error.filename:
        return "the current folder is gone; change into one that exists"
    place = f"{error.filename}: " if error.filename else ""
    return f"{place}{error.strerror or error}"


def _say(text: str, code: int) -> int:
    """One line on standard error, without what a terminal would obey; where it is full, the code alone."""
    from contextlib import suppress

    from pilotage.core.shown import shown

    with suppress(OSError):
        print(f"pilotage: {shown(text)}", file=sys.stderr)
    _to_nowhere_if_full()
    return code


def _to_nowhere_if_full() -> None:
    """What a full device did not take is flushed once more at exit, whose failure would be the code: 120."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
