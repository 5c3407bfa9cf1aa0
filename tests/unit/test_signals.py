"""Ctrl-C, SIGTERM and SIGHUP, wherever they strike: one line, 130, 143 or 129."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
import warnings
import weakref
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated

import pytest
from pydantic import Discriminator, Tag, TypeAdapter

from pilotage.cli import app
from pilotage.cli.main import main
from pilotage.core import interruptions
from pilotage.core.interruptions import Terminated, answered, ended_by, interruptible, interruption_in
from support.endless_runs import endless
from support.warm_commands import start

SIGNALS = 12
LONGEST_WAIT_S = 0.15


def test_a_signal_at_any_moment_of_a_run_is_one_line(tmp_path: Path) -> None:
    """The moments are random: a fault that shows once in twenty signals is found in half the runs."""
    moments = random.Random(5)
    child = start(tmp_path / "streams", endless, False, folder=tmp_path)
    codes = []
    sent = [moments.choice([signal.SIGINT, signal.SIGTERM, signal.SIGHUP]) for _ in range(SIGNALS)]
    try:
        for k, number in enumerate(sent):
            assert child.line(2 * k) == "ready\n", child.err.read_text()
            time.sleep(moments.uniform(0.0, LONGEST_WAIT_S))
            os.kill(child.pid, number)
            code = child.line(2 * k + 1)
            assert code, "ended by itself"
            codes.append(int(code))
    finally:
        child.process.kill()
        err = child.ended().stderr
    assert codes == [128 + number for number in sent], err
    lines = {
        130: "pilotage: interrupted",
        143: "pilotage: ended by SIGTERM",
        129: "pilotage: ended by SIGHUP",
    }
    assert err.splitlines() == [lines[code] for code in codes]


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_a_second_signal_changes_nothing(number: int, code: int, tmp_path: Path) -> None:
    child = start(tmp_path / "streams", endless, True, folder=tmp_path)
    assert child.line(0) == "ready\n"
    os.kill(child.pid, number)
    with suppress(ProcessLookupError):  # on a busy machine it may have ended by the first
        os.kill(child.pid, number)
    done = child.ended()
    assert done.returncode == code
    assert done.stderr.count("\n") == 1


HALF_MADE = """
import os, signal, sys
from llvmlite.binding.ffi import ObjectRef
from pilotage.cli import app
from pilotage.cli.main import main

class HalfMade(ObjectRef):
    def __init__(self):
        os.kill(os.getpid(), signal.SIGTERM)

sys.argv[1:] = ["missions"]
app.dispatch = lambda _: HalfMade()
sys.exit(main())
"""


def test_what_an_interruption_leaves_half_made_is_not_told() -> None:
    """Compiled code that is just loaded: its destructor misses what its beginning was to make."""
    child = subprocess.run([sys.executable, "-c", HALF_MADE], capture_output=True, text=True, check=False)
    assert (child.returncode, child.stderr) == (143, "pilotage: ended by SIGTERM\n")


COMPILED = """
import sys
from pilotage.cli import app
from pilotage.cli.main import main

sys.argv[1:] = ["missions"]
app.dispatch = lambda _: exec("import os, signal, time; os.kill(os.getpid(), signal.SIGINT); time.sleep(60)")
sys.exit(main())
"""


def test_one_that_strikes_in_code_compiled_from_text_has_its_exit_code(tmp_path: Path) -> None:
    """As libraries make it: ``python -m pilotage`` ended by SIGINT, two of five times as workers started."""
    (tmp_path / "compiled.py").write_text(COMPILED)
    child = subprocess.run(
        [sys.executable, "-m", "compiled"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (child.returncode, child.stderr) == (130, "pilotage: interrupted\n")


CAST = """
import ctypes, os, signal, sys
import pilotage
from pilotage.cli.main import main

cast, struck = ctypes.cast, []
striking = '''
def strike(*arguments):
    by = sys._getframe(1).f_code.co_filename
    if not struck and by.endswith("rrt_star_dubins.py") and arguments[1] is ctypes.c_void_p:
        struck.append(None)  # its kernel called, for the functions of a random generator
        os.kill(os.getpid(), signal.SIGINT)
    return cast(*arguments)
'''
names = dict(ctypes=ctypes, os=os, sys=sys, signal=signal, cast=cast, struck=struck)
exec(compile(striking, ctypes.__file__, "exec"), names)
ctypes.cast = names["strike"]
if len(sys.argv) > 2:
    try:
        pilotage.run(pilotage.load("museum-1", set={"run.time_limit_s": 3.0}), out=sys.argv[1])
    except KeyboardInterrupt:
        ours = signal.getsignal(signal.SIGINT) is signal.default_int_handler
        sys.exit(f"interrupted, {len(struck)}, {ours}")
code = main(["run", "museum-1", "--set", "run.time_limit_s=3", "--quiet", "--out", sys.argv[1]])
sys.exit(code if struck else 3)
"""


def test_a_signal_in_what_a_kernel_calls_waits_until_it_is_over(tmp_path: Path) -> None:
    """Numba goes on with what ``ctypes.cast`` did not return: one signal in a thousand ended the process."""
    child = subprocess.run(
        [sys.executable, "-c", CAST, str(tmp_path)], capture_output=True, text=True, check=False
    )
    assert (child.returncode, child.stderr) == (130, "pilotage: interrupted\n")


def test_so_it_does_in_a_script(tmp_path: Path) -> None:
    child = subprocess.run(
        [sys.executable, "-c", CAST, str(tmp_path), "script"], capture_output=True, text=True, check=False
    )
    assert (child.returncode, child.stderr) == (1, "interrupted, 1, True\n")


LOADED = """
import os, signal, sys
from numba.core.codegen import CPUCodeLibrary
from pilotage.cli import app
from pilotage.cli.main import main

handed, struck = CPUCodeLibrary._object_getbuffer_hook.__func__, []

def strike(cls, module):
    code = handed(cls, module)
    if code is not None and "loaded_in_a_test" in module.name and not struck:
        struck.append(None)
        os.kill(os.getpid(), signal.SIGTERM)
    return code

def call(_):
    from pilotage.kernels.jit import kernel
    from kept import loaded_in_a_test

    kernel(loaded_in_a_test)(1.0)
    return 0

CPUCodeLibrary._object_getbuffer_hook = classmethod(strike)
sys.argv[1:] = ["missions"]
app.dispatch = call
code = main()
sys.exit(code if struck else 3)
"""


def test_one_that_strikes_as_a_kept_kernel_is_loaded_waits_until_it_is(tmp_path: Path) -> None:
    """LLVM asks for its code, takes what is raised there for none, and numba writes to address zero."""
    (tmp_path / "kept.py").write_text("def loaded_in_a_test(x):\n    return 2.0 * x\n")
    env = {**os.environ, "PILOTAGE_CACHE_DIR": str(tmp_path)}
    for code, said in ((3, ""), (143, "pilotage: ended by SIGTERM\n")):
        child = subprocess.run(
            [sys.executable, "-c", LOADED], cwd=tmp_path, env=env, capture_output=True, text=True, check=False
        )
        assert (child.returncode, child.stderr) == (code, said)


WENT_ON: list[bool] = []
"""Work that an interruption was to end came to its own end."""


def from_a_kernel() -> None:
    """As the interpreter does where a C function returns a result though an exception is set."""
    try:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(60.0)
    except KeyboardInterrupt as stop:
        raise SystemError("CPUDispatcher(<function f>) returned a result with an exception set") from stop


def dropped_by_c() -> None:
    """As NumPy does where it compares arrays of several fields."""
    try:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(60.0)
    except KeyboardInterrupt:
        dropped = TypeError("Cannot compare structured arrays unless they have a common dtype.")
    raise dropped


def from_clearing_up() -> None:
    try:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(60.0)
    finally:
        raise OSError("the folder is gone")


def in_a_destructor() -> None:
    """Where nothing can be raised: the interpreter prints it and goes on."""

    class Held:
        pass

    def strike(_: object) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(60.0)

    held = Held()
    kept = weakref.ref(held, strike)
    del held
    assert kept() is None
    time.sleep(60.0)
    WENT_ON.append(True)


def taken_for_an_answer() -> None:
    """As pydantic does where it asks which member of a union a value is."""

    def kind(_: object) -> str:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(60.0)
        return "whole"

    member = Annotated[int, Tag("whole")] | Annotated[float, Tag("real")]
    with warnings.catch_warnings(action="ignore"):
        TypeAdapter(Annotated[member, Discriminator(kind)]).dump_python(3)
    time.sleep(60.0)
    WENT_ON.append(True)


@pytest.mark.parametrize(
    ("strike", "code"),
    [
        (from_a_kernel, 130),
        (dropped_by_c, 143),
        (from_clearing_up, 143),
        (in_a_destructor, 130),
        (taken_for_an_answer, 143),
    ],
)
def test_an_interruption_in_disguise_is_recognized(
    strike: Callable[[], None], code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(app, "dispatch", lambda _: strike())
    assert main(["run"]) == code
    assert not WENT_ON
    assert capsys.readouterr().err.count("\n") == 1


def test_what_it_ends_is_not_struck_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """However long clearing up takes, and what who answers it does afterwards."""
    done = []

    @contextmanager
    def held() -> Iterator[None]:
        try:
            yield
        finally:
            with suppress(ValueError):
                try:
                    raise ValueError
                finally:
                    _spend(10 * interruptions._LOST_S)
                    done.append("cleared")

    def clear(_: object) -> int:
        try:
            with held():
                os.kill(os.getpid(), signal.SIGHUP)
                time.sleep(60.0)
        except KeyboardInterrupt as stop:
            answered()
            code = ended_by(stop)[1]
        _spend(10 * interruptions._LOST_S)
        done.append("told")
        return code

    monkeypatch.setattr(interruptions, "_LOST_S", 0.02)
    monkeypatch.setattr(app, "dispatch", clear)
    assert main(["run"]) == 129
    assert (done, capsys.readouterr().err) == (["cleared", "told"], "")


def _spend(duration_s: float) -> None:
    """Time in which the interpreter looks for signals again and again."""
    until = time.monotonic() + duration_s
    while time.monotonic() < until:
        time.sleep(0.001)


def test_the_chain_of_causes_may_be_a_circle_or_a_group() -> None:
    one, two = ValueError(), ValueError()
    one.__context__, two.__context__ = two, one
    assert interruption_in(one) is None
    assert isinstance(interruption_in(BaseExceptionGroup("", [one, Terminated()])), Terminated)


def test_no_memory_is_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def swell(_: object) -> None:
        raise MemoryError

    monkeypatch.setattr(app, "dispatch", swell)
    assert main(["run"]) == 2
    assert capsys.readouterr().err.startswith("pilotage: this needs more memory than there is")


class TestInterruptible:
    """For who calls from Python: Ctrl-C is a KeyboardInterrupt, in whatever guise libraries let it out."""

    def test_what_comes_out_is_an_interruption(self) -> None:
        with pytest.raises(KeyboardInterrupt), interruptible():
            from_a_kernel()

        @interruptible()
        def dropped() -> None:
            try:
                os.kill(os.getpid(), signal.SIGINT)
                time.sleep(60.0)
            except KeyboardInterrupt:
                pass
            raise TypeError("of NumPy's own")

        with pytest.raises(KeyboardInterrupt):
            dropped()
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
        assert signal.getsignal(signal.SIGALRM) is signal.SIG_DFL

    def test_one_that_was_swallowed_comes_out_at_the_end(self) -> None:
        @interruptible()
        def swallowed() -> None:
            with suppress(KeyboardInterrupt):
                os.kill(os.getpid(), signal.SIGINT)
                time.sleep(60.0)

        with pytest.raises(KeyboardInterrupt):
            swallowed()

    def test_other_errors_are_what_they_were(self) -> None:
        with pytest.raises(ZeroDivisionError), interruptible():
            raise ZeroDivisionError

    @pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGALRM])
    def test_a_handler_of_the_callers_stays(self, number: int) -> None:
        def own(*_: object) -> None:
            pass

        before = signal.signal(number, own)
        try:
            with interruptible():
                assert signal.getsignal(number) is own
                assert signal.getsignal(signal.SIGINT) is (
                    own if number == signal.SIGINT else signal.default_int_handler
                )
        finally:
            signal.signal(number, before)

    def test_another_thread_may_call(self) -> None:
        with ThreadPoolExecutor(1) as pool:
            assert pool.submit(interruptible()(lambda: 3)).result() == 3
