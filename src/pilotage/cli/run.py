"""``pilotage run``: one mission, from its file to its run folder and report."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pilotage.cli.options import Json, Out, Overrides, Plugins, Quiet, RunReport, Seed
from pilotage.cli.output import print_json, print_line, progress_line, stdout_for_json, tell_if_cold
from pilotage.core.errors import InputError
from pilotage.core.shown import visible

if TYPE_CHECKING:
    from pilotage.missions.mission import Mission


def run(
    mission: Annotated[
        str | None, typer.Argument(metavar="MISSION|FILE", help="A shipped name or a YAML file.")
    ] = None,
    seed: Seed = None,
    overrides: Overrides = None,
    out: Out = Path("runs"),
    json: Json = False,
    plugin: Plugins = None,  # noqa: ARG001 - loaded while the options are read
    report: RunReport = True,
    quiet: Quiet = False,
    row: Annotated[
        str | None, typer.Option("--from", metavar="STUDY:ROW", help="One trial of a study again.")
    ] = None,
) -> int:
    """Run a mission and report on it."""
    loaded = _mission(mission, overrides or (), seed, row)
    from pilotage.experiments.run import run_mission

    if not quiet:
        tell_if_cold()
    with stdout_for_json(json), progress_line(not quiet) as on_progress:
        result = run_mission(loaded, out=out, on_progress=on_progress)
    page = _write_report(result.run_dir, json) if report and result.run_dir is not None else None
    if json:
        print_json(result.metrics)
    elif not quiet:
        _print_summary(result.metrics, page or result.run_dir)
    return 0 if result.success else 1


def _mission(name: str | None, overrides: Sequence[str], seed: int | None, row: str | None) -> Mission:
    """The mission that is meant: a named one, or that of a study's row."""
    if row is None:
        if name is None:
            raise InputError(
                "missing argument 'MISSION|FILE', or --from STUDY:ROW; see 'pilotage run --help'"
            )
        from pilotage.experiments.mission import load_mission

        return load_mission(name, overrides, seed)
    if name is not None or overrides or seed is not None:
        raise InputError(
            "run --from: expected nothing beside it: the study's row says mission, settings and seed"
        )
    from pilotage.experiments.studies.replay import mission_from

    return mission_from(row)


def _write_report(run_dir: Path, json: bool) -> Path:
    from pilotage.report import write_report

    with stdout_for_json(json):
        return write_report(run_dir)


def _print_summary(metrics: dict[str, Any], result_path: Path | None) -> None:
    from rich.console import Console

    from pilotage.report import summary_table

    shown = {key: visible(value) if isinstance(value, str) else value for key, value in metrics.items()}
    Console(file=sys.stdout).print(summary_table(shown))
    if result_path is not None:
        print_line(f"{'report' if result_path.suffix == '.html' else 'run'}: {result_path}")
