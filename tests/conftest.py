"""Settings that every test shares."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from support.warm_workers import warm_context

# No test opens a window, and figures look the same on every machine.
os.environ["MPLBACKEND"] = "Agg"

# Matrices here are small: a second thread of BLAS only waits for its turn, long on a busy machine.
# Set before NumPy is imported, and for all processes that tests start.
for _library in ("OPENBLAS", "OMP", "MKL"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"

# numba would colour each word of what its overloads say where they do not apply; nobody reads most of it.
os.environ["NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING"] = "1"

# Where bytecode may not lie beside the source, it lies in pytest's own folder: else each worker and each of
# the processes that tests start would compile all of pilotage and its libraries, at every run anew.
if os.environ.pop("PYTHONDONTWRITEBYTECODE", "") and "PYTHONPYCACHEPREFIX" not in os.environ:
    os.environ["PYTHONPYCACHEPREFIX"] = str(Path(__file__).parents[1] / ".pytest_cache" / "bytecode")
    sys.pycache_prefix, sys.dont_write_bytecode = os.environ["PYTHONPYCACHEPREFIX"], False

# A shell's background job ignores Ctrl-C, and so would all that tests start; those of Ctrl-C need it heard.
signal.signal(signal.SIGINT, signal.default_int_handler)

# All that nohup starts ignores SIGHUP. A handler keeps these processes alive, and is not inherited.
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, lambda *_: None)

# With thousands of tests in memory, looking for garbage as often as Python does takes a tenth of the time.
gc.set_threshold(50_000, 20, 20)

# Drawn examples are the same at every run and for every worker; compiling a kernel may take its time.
settings.register_profile("pilotage", derandomize=True, deadline=None)
settings.load_profile("pilotage")


@pytest.fixture(autouse=True, scope="session")
def _nothing_is_timed() -> Iterator[None]:
    """Missions are not built twice here so that their times are right: no test looks at times.

    Commands in processes of their own warm up as ever.
    """
    run = sys.modules.get("pilotage.experiments.run")
    with pytest.MonkeyPatch.context() as patch:
        if run is not None:
            patch.setattr(run, "warm_up", lambda _: None)
        yield


@pytest.fixture(autouse=True, scope="session")
def _workers_are_forked() -> Iterator[None]:
    """Workers that are started from this process do not import everything anew (``support.warm_workers``)."""
    from pilotage.experiments import worker_processes

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(worker_processes, "context", warm_context)
        yield


@pytest.fixture(autouse=True)
def _registered_for_one_test_only() -> Iterator[None]:
    """What a test brings in by a plugin leaves with it: other tests look at all that is registered."""
    roles = sys.modules.get("pilotage.experiments.roles")
    registries = [] if roles is None else list(roles.ROLES.values())
    before = [set(registry._entries) for registry in registries]
    files = os.environ.get("PILOTAGE_PLUGINS")
    yield
    if files is None:
        os.environ.pop("PILOTAGE_PLUGINS", None)  # processes that later tests start would load them
    else:
        os.environ["PILOTAGE_PLUGINS"] = files
    if roles is None:
        roles = sys.modules.get("pilotage.experiments.roles")
        registries = [] if roles is None else list(roles.ROLES.values())
        before = [set() for _ in registries]
    for registry, names in zip(registries, before, strict=True):
        for name in set(registry._entries) - names:
            if not registry._entries[name].factory.__module__.startswith("pilotage."):
                del registry._entries[name]
