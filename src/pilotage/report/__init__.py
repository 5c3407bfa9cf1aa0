"""Figures, tables and pages from saved runs: reads run folders, never live objects.

``import pilotage.report`` is cheap; matplotlib is loaded when a report is written.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table


def write_report(run_dir: Path, on_damage: Callable[[str], None] | None = None) -> Path:
    """Write ``report.html`` into a run or calibration folder: self-contained, vector figures.

    A study's page shows trials that are run again for it, which no report does by itself: that is
    ``pilotage report STUDY``.

    Parameters
    ----------
    run_dir
        Folder that a run left behind: ``metrics.json`` and ``trace.parquet`` at least; without the other
        files the figures that need them are left out, with a word. A calibration's folder is told by its
        ``calibration.json``, a mapped recording's by its ``closures.json``.
    on_damage
        Told one line for each file of a run that cannot be read; the page is written without it and says so.
        None makes it an error, as it always is for what a run is told by (see ``records.run_data.read_run``).

    Returns
    -------
    The path of the page. An older page is replaced in one go.

    Raises
    ------
    InputError
        One line, where the folder is not a run folder or one of its files is broken.
    """
    from pilotage.records.folder import check_folder

    check_folder(run_dir)
    from pilotage.records.calibration import is_calibration

    if is_calibration(run_dir):
        from pilotage.report.calibration.page import write_calibration_report

        return write_calibration_report(run_dir)
    from pilotage.records.slam_folder import is_slam_folder

    if is_slam_folder(run_dir):
        from pilotage.report.slam.page import write_slam_report

        return write_slam_report(run_dir)
    from pilotage.report.page import write_report as write

    return write(run_dir, on_damage)


def summary_table(metrics: Mapping[str, object]) -> Table:
    """Return a run's metrics as a table for the terminal: grouped, aligned, in humane units.

    Parameters
    ----------
    metrics
        The run's object, the keys of ``metrics.json``; whatever is missing is left out.
    """
    from pilotage.report.terminal import summary_table as table

    return table(metrics)


__all__ = ["summary_table", "write_report"]
