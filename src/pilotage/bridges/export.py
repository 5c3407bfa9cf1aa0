"""A run handed on: to Foxglove and ROS as a bag, to Rerun, to evo as trajectories, to anything as a table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.bridges.words import file_words
from pilotage.core import given
from pilotage.core.errors import InputError, unknown_name
from pilotage.core.given import FilePath
from pilotage.core.whole_file import draft_of
from pilotage.face.runs import Run, open_run
from pilotage.face.traces import Trace
from pilotage.logs.trajectories import write_planar_tum
from pilotage.records.run_folder import draft_folder


@dataclass(frozen=True, slots=True)
class _Form:
    """How one format is written.

    Attributes
    ----------
    usual
        What the file or folder is called inside the run's folder.
    folder
        Whether it is a folder.
    """

    usual: str
    folder: bool
    write: Callable[[Run, Path], None]


def export(run: Run | FilePath, to: str, out: FilePath | None = None) -> Path:
    """Hand a run on to another program.

    Parameters
    ----------
    run
        A run, or its folder.
    to
        ``mcap``: one file for Foxglove and ROS 2, every column of the trace in messages of a type of its own.
        ``rosbag``: the folder of a ROS 2 bag, or a ROS 1 bag where ``out`` ends in ``.bag``.
        ``rerun``: a recording for the Rerun viewer. ``tum``: a folder with the estimated and the true
        trajectory of each robot. ``csv``: the trace as a table.
    out
        Where to; None: inside the run's folder. Scans are those that the run kept for its replay (five a
        second, about a hundred beams).

    Returns
    -------
    The file or folder written.

    Raises
    ------
    InputError
        Where it is no run's folder, the format is unknown, its library is not installed, or something else
        stands where a folder is to be written; nothing has been written then.

    Examples
    --------
    >>> import pilotage as pl
    >>> run = pl.run("museum-route", seed=4, save=False)
    >>> pl.export(run, "csv").name
    'trace.csv'
    """
    if not isinstance(to, str) or to not in FORMS:
        raise unknown_name("format", str(to), FORMS)
    form, opened = FORMS[to], run if isinstance(run, Run) else open_run(run)
    path = opened.folder / form.usual if out is None else given.path("--out", out)
    if not path.parent.is_dir():
        raise InputError(f"--out: expected a folder that is there, found none: '{path.parent}'")
    as_folder = form.folder and path.suffix != ".bag"
    if path.is_dir() and not as_folder:
        raise InputError(f"--out: expected a file to write, found the folder '{path}'")
    if as_folder and out is not None and path.exists():
        raise InputError(f"--out: expected a folder that is not there yet, found '{path}'")
    form.write(opened, path)
    return path


def _mcap(run: Run, path: Path) -> None:
    from pilotage.bridges.ros.bag_files import write_mcap
    from pilotage.bridges.ros.run_messages import run_messages

    write_mcap(path, run_messages(run.folder))


def _rosbag(run: Run, path: Path) -> None:
    from pilotage.bridges.ros.bag_files import write_ros1, write_ros2
    from pilotage.bridges.ros.run_messages import run_messages

    write = write_ros1 if path.suffix == ".bag" else write_ros2
    write(path, run_messages(run.folder))


def _rerun(run: Run, path: Path) -> None:
    from pilotage.bridges.rerun_file import write_rerun

    write_rerun(path, run.folder)


def _tum(run: Run, folder: Path) -> None:
    with draft_folder(folder) as draft:
        for robot, name in enumerate(file_words(run.trace.robots) or ("",)):
            trace = run.trace.of(robot)
            for kind, prefix in (("estimate", "est"), ("truth", "true")):
                names = [f"{prefix}_{part}" for part in ("x_m", "y_m", "theta_rad")]
                if not set(names) <= set(trace):
                    continue
                poses = np.column_stack([trace[column] for column in names])
                known = np.isfinite(poses).all(axis=1)
                if "localized" in trace and kind == "estimate":
                    known = known & (trace["localized"] > 0.5)
                stem = f"{name}-{kind}" if name else kind
                write_planar_tum(draft / f"{stem}.tum", trace["t_s"][known], poses[known])


def _csv(run: Run, path: Path) -> None:
    import pyarrow.csv

    trace: Trace = run.trace
    # Opened here: what the system refuses is told in its words and of this file.
    with draft_of(path) as draft, draft.open("wb") as file:
        pyarrow.csv.write_csv(trace.to_arrow(), file)


FORMS = {
    "mcap": _Form("run.mcap", False, _mcap),
    "rosbag": _Form("rosbag", True, _rosbag),
    "rerun": _Form("run.rrd", False, _rerun),
    "tum": _Form("tum", True, _tum),
    "csv": _Form("trace.csv", False, _csv),
}
