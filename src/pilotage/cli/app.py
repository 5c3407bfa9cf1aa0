"""The table of commands, and one call of one of them."""

from __future__ import annotations

from functools import cache
from typing import Annotated

import typer

from pilotage.cli.attribute import attribute
from pilotage.cli.bench import bench, bench_scen
from pilotage.cli.calibrate import calibrate
from pilotage.cli.components import components, missions, schema
from pilotage.cli.draw import draw, vectorize
from pilotage.cli.evaluate import evaluate
from pilotage.cli.export import export
from pilotage.cli.live import drive, serve
from pilotage.cli.localize import localize
from pilotage.cli.map_score import map_score
from pilotage.cli.new import new
from pilotage.cli.plan import plan
from pilotage.cli.report import report
from pilotage.cli.run import run
from pilotage.cli.slam import slam
from pilotage.cli.study import study, sweep
from pilotage.cli.track import track
from pilotage.core.errors import InputError
from pilotage.core.version import __version__

app = typer.Typer(
    name="pilotage",
    help="The open navigation lab for mobile robots: one mission file in, a run and its evidence out.",
    epilog="Exit codes: 0 done, 1 the task failed in the field, 2 bad input.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

COMMANDS = (
    run,
    plan,
    bench_scen,
    evaluate,
    calibrate,
    localize,
    slam,
    study,
    sweep,
    attribute,
    track,
    map_score,
    draw,
    vectorize,
    report,
    export,
    serve,
    drive,
    new,
    missions,
    components,
    schema,
)

for _command in COMMANDS:
    app.command()(_command)
app.add_typer(bench)


def _version(wanted: bool) -> None:
    if wanted:
        print(f"pilotage {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Take the options that stand before the command."""


@cache
def _commands() -> typer.core.TyperGroup:
    """The commands with their options, read from their signatures once a process."""
    return typer.main.get_group(app)


def dispatch(arguments: list[str]) -> int:
    """Run the command that ``arguments`` name and return its exit code.

    Raises
    ------
    InputError
        What cannot be parsed, in one line with the nearest right name.
    """
    command = _commands()
    try:
        with command.make_context("pilotage", arguments or ["--help"]) as context:
            return int(command.invoke(context) or 0)
    except typer.Exit as stop:
        return stop.exit_code
    except typer.TyperException as error:
        raise InputError(_one_line(error)) from None


def _one_line(error: typer.TyperException) -> str:
    """Render a usage error as what is wrong and where the right usage is told."""
    text = error.format_message().rstrip(".")
    text = text[:1].lower() + text[1:]
    context = getattr(error, "ctx", None)
    return f"{text}; see '{context.command_path} --help'" if context is not None else text
