"""``pilotage calibrate``: logs, or runs driven for it, to noise and bias parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from pilotage.cli.options import Json, Out, Overrides, Seed
from pilotage.cli.output import print_answer, stdout_for_json
from pilotage.core.errors import InputError, unknown_name

AXES = ("x", "y", "z")
KINDS = ("odometry", "range", "heading", "commands")


def calibrate(
    what: Annotated[
        str, typer.Argument(metavar="odometry|range|heading|commands", help="What to calibrate.")
    ],
    logs: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[LOG...]", help="Recordings; without any, runs are simulated (odometry, range)."
        ),
    ] = None,
    seed: Seed = None,
    overrides: Overrides = None,
    out: Out = Path("runs"),
    sensor: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="odometry: the sensor's name in the mission, for the parameter file."
        ),
    ] = None,
    wheel_base: Annotated[
        float | None, typer.Option(metavar="M", help="odometry: the wheel base that it was told, in metres.")
    ] = None,
    axis: Annotated[
        str | None,
        typer.Option(metavar="x|y|z", help="heading: the axis that the robot turns about; default z."),
    ] = None,
    form: Annotated[
        str | None, typer.Option("--format", metavar="mrclam|bag", help="commands: format of the recordings.")
    ] = None,
    robots: Annotated[
        list[int] | None,
        typer.Option("--robot", metavar="N", help="commands: from this robot; repeatable; default all."),
    ] = None,
    leave_one_out: Annotated[
        bool,
        typer.Option("--leave-one-out", help="commands: also write a set without each recording in turn."),
    ] = False,
    topics: Annotated[
        list[str] | None,
        typer.Option("--topic", metavar="NAME", help="Of bags: what is calibrated; default the usual one."),
    ] = None,
    truth: Annotated[
        str | None,
        typer.Option(
            metavar="TOPIC|FILE",
            help="odometry, heading, commands, of bags: the true poses; /tf:PARENT:CHILD or a TUM file too.",
        ),
    ] = None,
    landmarks: Annotated[
        Path | None,
        typer.Option(
            "--landmarks", metavar="CSV", help="commands, of bags: a table id, x_m, y_m, for the camera."
        ),
    ] = None,
    report: Annotated[bool, typer.Option(help="Write report.html into the calibration's folder.")] = True,
    json: Json = False,
) -> int:
    """Estimate noise and systematic errors of a sensor or a drive, each with a 95 % interval."""
    if what not in KINDS:
        raise unknown_name("calibration", what, KINDS)
    if what == "commands":
        _check_commands(logs, form, overrides is not None or seed is not None)
    elif form is not None or robots or leave_one_out:
        raise InputError("calibrate: --format, --robot and --leave-one-out are for 'calibrate commands'")
    if logs and (overrides or seed is not None):
        raise InputError(
            "calibrate: --set and --seed are for simulated runs; leave them out where logs are given"
        )
    if what != "odometry" and (sensor is not None or wheel_base is not None):
        raise InputError("calibrate: --sensor and --wheel-base are for 'calibrate odometry'")
    if truth is not None and what == "range":
        raise InputError("calibrate: --truth is for 'calibrate odometry', 'heading' and 'commands'")
    if landmarks is not None and what != "commands":
        raise InputError("calibrate: --landmarks is for 'calibrate commands'")
    if topics and not logs:
        raise InputError("calibrate: --topic is for bags")
    if axis is not None and what != "heading":
        raise InputError("calibrate: --axis is for 'calibrate heading'")
    if axis is not None and axis not in AXES:
        raise unknown_name("--axis", axis, AXES)
    if wheel_base is not None and not (math.isfinite(wheel_base) and wheel_base > 0.0):
        raise InputError(f"--wheel-base: expected metres above 0, found {wheel_base:g}")
    from pilotage.experiments import calibrate as lab

    places = logs or []
    with stdout_for_json(json):
        if what == "odometry":
            result = lab.odometry_from(
                places,
                out,
                overrides=overrides or (),
                seed=seed or 0,
                wheel_base_m=wheel_base,
                sensor=sensor or "odometry",
                topics=topics or (),
                truth=truth,
            )
        elif what == "range":
            result = lab.range_from(
                places, out, overrides=overrides or (), seed=seed or 0, topics=topics or ()
            )
        elif what == "heading":
            result = lab.heading_from(places, out, axis=axis or "z", topics=topics or (), truth=truth)
        else:
            from pilotage.experiments.calibrate_commands import commands_from

            result = commands_from(
                places,
                out,
                robots=robots or (),
                leave_one_out=leave_one_out,
                topics=topics or (),
                truth=truth,
                landmarks=landmarks,
            )
        answer: dict[str, Any] = dict(result.answer)
        if report:
            from pilotage.report import write_report

            answer["report"] = str(write_report(result.folder))
    print_answer(answer, _rows(answer), as_json=json)
    return 0


def _check_commands(logs: list[Path] | None, form: str | None, simulated: bool) -> None:
    if not logs:
        raise InputError("calibrate commands: expected folders of recordings with truth, found none")
    from pilotage.logs.bag_messages import is_bag

    bag = is_bag(logs[0])
    if form is None and not bag:
        raise InputError("calibrate commands: expected bags, or --format mrclam, found neither")
    if form is not None and form != ("bag" if bag else "mrclam"):
        raise unknown_name("--format", form, ("bag" if bag else "mrclam",))
    if simulated:
        raise InputError("calibrate commands: --set and --seed are for simulated runs; leave them out")


def _rows(answer: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """The estimates with their intervals, the offset's shape and where everything is."""
    rows: list[tuple[str, ...]] = []
    for key, value in answer.items():
        if isinstance(value, Mapping) and {"value", "low", "high"} <= set(value):
            rows.append((key, f"{value['value']:.5g}", f"{value['low']:.5g} to {value['high']:.5g}"))
        elif isinstance(value, str | bool):
            rows.append((key, str(value), ""))
    offset = answer.get("offset")
    if isinstance(offset, Mapping):
        rows.append(("offset", str(offset["shape"]), str(offset["explanation"])))
    for entry in answer.get("magnetometer", ()):
        rows += [
            (f"magnetometer_offset_{axis}_gauss", f"{e['value']:.5g}", f"{e['low']:.5g} to {e['high']:.5g}")
            for axis, e in entry["offset_gauss"].items()
        ]
    for entry in answer.get("gyroscope_while_driving", ()):
        rows += [
            (f"{entry['log']}_{key}", f"{e['value']:.5g}", f"{e['low']:.5g} to {e['high']:.5g}")
            for key in ("bias_rad_s", "bias_with_scale_rad_s", "scale")
            if (e := entry[key]) is not None
        ]
    rows += [
        (f"{entry['log']}_turn_rad", f"{entry['turn_rad']:.5g}", "about the axis, by the gyroscope alone")
        for entry in answer.get("gyroscope", ())
        if entry["moving"]
    ]
    return rows + [("warning", "", text) for text in answer.get("warnings", ())]
