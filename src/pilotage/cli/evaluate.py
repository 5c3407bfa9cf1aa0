"""``pilotage evaluate``: an estimated trajectory against its reference, or against true relations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from pilotage.cli.options import Json
from pilotage.cli.output import print_answer, worded
from pilotage.core.errors import InputError


def evaluate(
    estimate: Annotated[
        Path, typer.Argument(metavar="ESTIMATE", help="The trajectory to judge: TUM, KITTI or a bag.")
    ],
    reference: Annotated[Path, typer.Argument(metavar="REFERENCE", help="The true one, or relations.")],
    form: Annotated[
        str | None,
        typer.Option("--format", metavar="tum|kitti", help="Format of both; by default told by the columns."),
    ] = None,
    align: Annotated[bool, typer.Option("--align", help="Rotate and shift the estimate first.")] = False,
    scale: Annotated[bool, typer.Option("--scale", help="Correct the estimate's scale first.")] = False,
    relations: Annotated[
        bool, typer.Option("--relations", help="REFERENCE holds the SLAM benchmark's relations.")
    ] = False,
    tolerance: Annotated[
        float | None,
        typer.Option(
            "--tolerance",
            metavar="SECONDS",
            help="A pose this near is that of a relation (by default 0.001).",
        ),
    ] = None,
    topics: Annotated[
        list[str] | None,
        typer.Option(
            "--topic", metavar="NAME", help="A bag's poses; /tf:PARENT:CHILD too; once a bag, in their order."
        ),
    ] = None,
    json: Json = False,
) -> int:
    """Say how far an estimated trajectory is from its reference (absolute and relative errors)."""
    if relations:
        if align or scale or form not in {None, "tum"}:
            raise InputError(
                "evaluate: expected --relations without --align, --scale and --format kitti: "
                "relations need neither alignment nor scale, but times"
            )
        return _print(_relations(estimate, reference, tolerance, topics or ()), json)
    if tolerance is not None:
        raise InputError("evaluate: expected --tolerance together with --relations only")
    from pilotage.face.evaluating import evaluate as judged_by

    errors = judged_by(estimate, reference, format=form, align=align, scale=scale, topics=topics or ())
    answer: dict[str, float | int | str | bool] = {
        **errors,
        "format": errors.format,
        "align": align,
        "scale_corrected": scale,
    }
    return _print(answer, json)


def _relations(
    estimate: Path, reference: Path, tolerance: float | None, topics: Sequence[str]
) -> dict[str, float | int | str]:
    from pilotage.evaluation.relations import MAX_TIME_DIFFERENCE_S, relation_errors
    from pilotage.evaluation.slam_consistency import nees_summary
    from pilotage.logs.bag_messages import is_bag
    from pilotage.logs.bag_series import trajectory_of_bag
    from pilotage.logs.relations import read_relations
    from pilotage.logs.trajectories import read_tum

    within_s = MAX_TIME_DIFFERENCE_S if tolerance is None else tolerance
    if not 0.0 <= within_s < float("inf"):
        raise InputError(f"--tolerance: expected seconds of at least 0, found {within_s}")
    if len(topics) > 1:
        raise InputError(f"evaluate: expected one topic beside relations, found {len(topics)}")
    bag = estimate.exists() and is_bag(estimate)
    found = trajectory_of_bag(estimate, next(iter(topics), None)) if bag else read_tum(estimate)
    errors = relation_errors(found, read_relations(reference), within_s)
    sure = {} if bag else nees_summary(errors, estimate)
    return {**errors.summary(), **sure, "tolerance_s": within_s}


def _print(answer: Mapping[str, float | int | str | bool], json: bool) -> int:
    print_answer(answer, [(key, worded(value, 6)) for key, value in answer.items()], as_json=json)
    return 0
