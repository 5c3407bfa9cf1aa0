"""Workers of a Dask cluster, by its scheduler's address."""

from __future__ import annotations

import asyncio
import functools
import json
import logging
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any

from pilotage.core.errors import InputError
from pilotage.core.extras import missing
from pilotage.experiments.studies.database import StudyStoppedError
from pilotage.experiments.studies.trial import Outcome, Task, TrialRunner
from pilotage.experiments.studies.workers import AHEAD, WAIT_S, hung

CONNECT_S = 10
POLL_S = 0.005


class DaskWorkers:
    """Runs tasks on a cluster; the rows are those that local workers give.

    A trial that hangs is given up here; its thread over there is the cluster's to end.

    Raises
    ------
    InputError
        Where the extra is not installed or nobody answers at the address.
    StudyStoppedError
        From the methods, where the cluster is lost.
    """

    def __init__(self, base: Mapping[str, Any], address: str, timeout_s: float) -> None:
        try:
            import distributed
            from distributed.comm.addressing import resolve_address
        except ImportError:
            raise missing("--dask needs the library distributed, which is not installed", "cluster") from None
        # A cluster that is lost is told in one line, not at length.
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
        try:
            # A client that could not be made complains at length when it is thrown away.
            resolve_address(address)
            connect: Any = distributed.Client
            self._client: Any = connect(address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise InputError(f"--dask {address}: expected a scheduler there, found: {error}") from None
        self._address, self._is_lost = address, False
        self._base = json.dumps(dict(base))
        self._timeout_s = timeout_s
        self._futures: dict[Any, tuple[Task, float]] = {}

    @property
    def room(self) -> int:
        """Two tasks for each thread of the cluster."""
        with self._in_touch():
            threads = int(sum(self._client.nthreads().values()))
        return max(0, AHEAD * max(1, threads) - len(self._futures))

    def give(self, task: Task) -> None:
        """Submit one task; every submission is run, whatever was computed before."""
        with self._in_touch():
            future = self._client.submit(run_on_cluster, self._base, task, pure=False, retries=0)
        self._futures[future] = task, time.monotonic()

    def outcomes(self) -> Iterator[Outcome]:
        """Those that are ready; a task whose worker is gone is told."""
        until = time.monotonic() + WAIT_S
        while True:
            ready = [future for future in self._futures if future.done()]
            if ready or time.monotonic() > until or not self._futures:
                break
            time.sleep(POLL_S)
        for future in ready:
            task, _ = self._futures.pop(future)
            if future.cancelled():  # by nobody here: its scheduler does not answer any more
                raise self._lost("it does not answer")
            with self._in_touch():
                error = future.exception()
                outcome: Outcome | None = future.result() if error is None else None
            if outcome is not None:
                yield outcome
            else:
                words = " ".join(str(error).split())
                yield Outcome(
                    task.row, {}, {}, f"its worker died ({type(error).__name__}: {words})", retry=True
                )

        yield from self._hung()

    def _hung(self) -> Iterator[Outcome]:
        """Give up what has been away for the time of all tasks that wait before it and its own."""
        begun_s = time.monotonic() - AHEAD * self._timeout_s
        for future in [future for future, (_, given_s) in self._futures.items() if given_s < begun_s]:
            task, _ = self._futures.pop(future)
            with self._in_touch():
                self._client.cancel([future])
            yield hung(task.row, self._timeout_s)

    @contextmanager
    def _in_touch(self) -> Iterator[None]:
        try:
            yield
        except (Exception, asyncio.CancelledError) as error:
            raise self._lost(" ".join(str(error).split()) or type(error).__name__) from None

    def _lost(self, why: str) -> StudyStoppedError:
        self._is_lost = True
        return StudyStoppedError(f"--dask {self._address}: the cluster is lost ({why}); go on with --resume")

    def stop(self) -> None:
        """Cancel what is left; a scheduler that is gone has nothing to cancel."""
        if not self._is_lost:
            with suppress(Exception):
                self._client.cancel(list(self._futures))
        self._futures.clear()
        with suppress(Exception):
            self._client.close()


@functools.lru_cache(maxsize=4)
def _runner(base: str) -> TrialRunner:
    return TrialRunner(json.loads(base))


def run_on_cluster(base: str, task: Task) -> Outcome:
    """One task, wherever it comes to; the study's missions are validated once a process."""
    return _runner(base).run(task)
