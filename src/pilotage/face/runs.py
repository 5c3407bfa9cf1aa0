"""A mission run, and what it left: the same object after the run and from its folder years later."""

from __future__ import annotations

import html
import shutil
import tempfile
import weakref
from functools import cached_property
from pathlib import Path
from typing import Any

from pilotage.core import given
from pilotage.core.errors import InputError
from pilotage.core.given import FilePath
from pilotage.core.interruptions import interruptible
from pilotage.core.types import Event
from pilotage.experiments.run import run_mission
from pilotage.face.metrics import Metrics
from pilotage.face.missions import MissionLike, as_mission
from pilotage.face.progress import showing_progress
from pilotage.face.traces import Trace
from pilotage.missions.mission import Mission
from pilotage.records.events import read_events
from pilotage.records.metrics import METRICS_FILE, read_metrics
from pilotage.records.mission import read_mission
from pilotage.records.trace import TRACE_FILE, read_trace

MOST_TOLD = 12
"""Rows of the metrics that a notebook shows beside the map."""


class Run:
    """A run by its folder; its files are read when they are asked for.

    Attributes
    ----------
    folder
        Where its evidence is.
    """

    def __init__(self, folder: Path, passing: Path | None = None) -> None:
        self.folder = folder
        if passing is not None:  # a folder that lives as long as the run that is in it
            weakref.finalize(self, shutil.rmtree, passing, ignore_errors=True)

    def __repr__(self) -> str:
        word = "success" if self.success else f"failed: {self.reason}"
        return f"Run({self.name!r}, {word}, folder={str(self.folder)!r})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Run) and self.folder.resolve() == other.folder.resolve()

    def __hash__(self) -> int:
        return hash(self.folder.resolve())

    @cached_property
    def metrics(self) -> Metrics:
        """Numbers by key; ``metrics.table()`` has their units and what they mean."""
        return Metrics(read_metrics(self.folder))

    @cached_property
    def trace(self) -> Trace:
        """What was recorded, columns by name; ``trace.to_pandas()`` is all of it as a table."""
        return Trace(read_trace(self.folder))

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """What happened, in order: ``t_s``, ``kind``, ``text``."""
        return tuple(read_events(self.folder))

    @cached_property
    def mission(self) -> Mission:
        """The mission in full; run again, it gives the same run.

        Raises
        ------
        InputError
            Where it was no mission: a recording, say.
        """
        values, _ = read_mission(self.folder)
        if not values:
            raise InputError(f"{self.folder}: expected the run of a mission, found none in its folder")
        return as_mission(values)

    @property
    def name(self) -> str:
        """The mission's name."""
        return str(self.metrics.as_dict().get("mission", self.folder.name))

    @property
    def success(self) -> bool:
        """Whether the task succeeded."""
        return bool(self.metrics.as_dict().get("success", False))

    @property
    def reason(self) -> str:
        """Why the run ended as it did, in words; empty where there is nothing to say."""
        return str(self.metrics.as_dict().get("reason") or "")

    def report(self, path: FilePath | None = None) -> Path:
        """Write the run's page: one self-contained HTML file with replay, figures and every metric.

        Parameters
        ----------
        path
            Where to; None: ``report.html`` in the run's folder.

        Returns
        -------
        The page's path.
        """
        from pilotage.report import write_report

        page = write_report(self.folder)
        if path is None:
            return page
        wanted = given.path("report", path)
        if wanted.is_dir():
            raise InputError(f"report: expected a file to write, found the folder '{wanted}'")
        wanted.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(page, wanted)
        return wanted

    def _repr_html_(self) -> str:
        """The summary and the map, for a notebook."""
        return _summary_html(self) + _map_html(self.folder)


@interruptible()
def run(
    mission: MissionLike,
    *,
    seed: int | None = None,
    out: FilePath = "runs",
    save: bool = True,
    progress: bool | None = None,
) -> Run:
    """Run a mission to its end and judge it.

    Parameters
    ----------
    mission
        What ``load`` gives, or what it takes.
    seed
        Replaces the mission's seed where given.
    out
        Folder that the run's own folder is made in.
    save
        Whether to keep that folder; else it lives as long as the returned object.
    progress
        Whether to show how far it is; None: on a terminal and in a notebook.

    Returns
    -------
    Run
        Whether it succeeded, its metrics, its trace, its report.

    Raises
    ------
    InputError
        Where the mission cannot be built; nothing has been written then.

    Examples
    --------
    >>> import pilotage as pl
    >>> run = pl.run(pl.load("museum-route", seed=4), save=False)
    >>> run.success, run.metrics["position_rmse_m"] < 0.05
    (True, True)
    """
    save, progress = given.flag("save", save), None if progress is None else given.flag("progress", progress)
    place, loaded = given.folder("out", out), as_mission(mission, seed)
    passing = None if save else Path(tempfile.mkdtemp(prefix="pilotage-run-"))
    folder = place if passing is None else passing
    try:
        with showing_progress(progress, loaded.run.time_limit_s) as on_progress:
            result = run_mission(loaded, out=folder, on_progress=on_progress)
    except BaseException:
        if passing is not None:
            shutil.rmtree(passing, ignore_errors=True)
        raise
    assert result.run_dir is not None, "asked for above"
    return Run(result.run_dir, passing)


def open_run(folder: FilePath) -> Run:
    """Open a run's folder: the object that ``run`` gave.

    Raises
    ------
    InputError
        Where it is no run's folder.

    Examples
    --------
    >>> import pilotage as pl
    >>> run = pl.run("museum-route", seed=4, save=False)
    >>> pl.open_run(run.folder).metrics["steps"] == run.metrics["steps"]
    True
    """
    path = given.path("folder", folder)
    missing = [name for name in (METRICS_FILE, TRACE_FILE) if not (path / name).is_file()]
    if missing:
        found = "nothing" if not path.exists() else "a file" if path.is_file() else f"no {missing[0]} in it"
        raise InputError(f"'{path}': expected a run's folder, found {found}")
    return Run(path)


def _summary_html(run: Run) -> str:
    from pilotage.report.metrics_table import metric_rows

    answer = run.metrics.as_dict()
    seed = f" &middot; seed {answer['seed']}" if answer.get("seed") is not None else ""
    word = "success" if run.success else f"failed: {html.escape(run.reason)}"
    rows: list[Any] = [row for _, group in metric_rows(answer) for row in group][:MOST_TOLD]
    body = "".join(
        f'<tr title="{html.escape(row.meaning, quote=True)}"><td style="text-align:left">'
        f"{html.escape(row.name)}</td><td>{html.escape(row.value)}</td></tr>"
        for row in rows
    )
    return f"<p><b>{html.escape(run.name)}</b>{seed} &middot; {word}</p><table>{body}</table>"


def _map_html(folder: Path) -> str:
    """The first figure of the run's page."""
    from pilotage.report.drawn import picture_of

    picture = picture_of(folder)
    if not picture.svg:
        return f"<p>{html.escape(picture.caption)}</p>"
    return f'<div style="max-width:760px;background:#fff">{picture.svg}</div>'
