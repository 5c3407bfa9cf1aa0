"""``pilotage slam``: a map from a recording of a building that nobody has mapped."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from pilotage.cli.options import Json, Out, Quiet, RunReport
from pilotage.cli.output import print_columns, print_json, stdout_for_json, worded
from pilotage.face.progress import StatusLine

_TOLD = (
    "log",
    "reason",
    "scans",
    "duration_s",
    "path_length_m",
    "keyframes",
    "closures_searched",
    "closures_accepted",
    "position_std_max_m",
    "beam_spacing",
    "extends",
    "stretches",
    "stretches_agreeing",
    "closures_joining",
    "walls_agreement",
    "keyframes_kept",
    "keyframes_dropped",
    "times_real_time",
)


def slam(
    log: Annotated[
        Path, typer.Argument(metavar="LOG", help="A ROS bag, an MCAP file, a CARMEN log or a run's folder.")
    ],
    config: Annotated[
        Path | None, typer.Option("--config", metavar="FILE", help="YAML file with the few parameters.")
    ] = None,
    topics: Annotated[
        list[str] | None,
        typer.Option("--topic", metavar="NAME", help="A bag's scans or odometry by name; repeatable."),
    ] = None,
    extend: Annotated[
        Path | None,
        typer.Option(metavar="RUN", help="Extend the map of an earlier run; begin anywhere in it."),
    ] = None,
    out: Out = Path("runs"),
    report: RunReport = True,
    json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Map a recording: scans to a map, a path, and how sure both are."""
    from pilotage.experiments.slam import read_slam_config, slam_log

    settings = read_slam_config(config)
    with stdout_for_json(json), _stages(not quiet) as on_stage:
        run = slam_log(log, out, settings, on_stage, topics or (), extend)
        page: Path | None = None
        if report and run.run_dir is not None:
            from pilotage.report.slam.page import write_slam_report

            page = write_slam_report(run.run_dir)
    where = None if run.run_dir is None else str(run.run_dir)
    metrics = {**run.metrics, "run_dir": where}
    if json:
        print_json(metrics)
    elif not quiet:
        rows = [(key, worded(metrics[key])) for key in _TOLD if key in metrics]
        rows += [("warning", str(text)) for text in run.warnings]
        if where is not None:
            rows.append(("report" if page else "run_dir", str(page or where)))
        print_columns(rows)
    return 0 if run.metrics["success"] else 1


@contextmanager
def _stages(wanted: bool) -> Iterator[Callable[[str, float], None] | None]:
    """Yield what shows where the mapping stands on standard error, one line that rewrites itself."""
    if not (wanted and sys.stderr.isatty()):
        yield None
        return
    line, shown = StatusLine(sys.stderr), [-1.0]

    def show(text: str, share: float) -> None:
        if text == "matching" and share - shown[0] < 0.01 and share < 1.0:
            return
        shown[0] = share if text == "matching" else -1.0
        line.show(f"{text} {share:.0%}" if text == "matching" else text)

    try:
        yield show
    finally:
        line.close()
