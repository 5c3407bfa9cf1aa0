"""Trajectories judged by their references."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core import given
from pilotage.core.errors import InputError, unknown_name
from pilotage.core.given import FilePath
from pilotage.core.types import FloatArray
from pilotage.evaluation.trajectory import TrajectoryErrors, trajectory_errors
from pilotage.logs.trajectories import Trajectory3, TrajectoryFormat, guess_format, read_trajectory


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation(Mapping[str, float]):
    """How far an estimated trajectory is from its reference: ``evaluation["ate_rmse_m"]``.

    Attributes
    ----------
    errors
        Of every pose and of every step, and the alignment.
    format
        ``tum``, ``kitti`` or ``arrays``.
    """

    errors: TrajectoryErrors
    format: str

    def __getitem__(self, key: str) -> float:
        return self.errors.summary()[key]

    def __iter__(self) -> Any:
        return iter(self.errors.summary())

    def __len__(self) -> int:
        return len(self.errors.summary())

    def __repr__(self) -> str:
        told = ", ".join(f"{key}={value:.4g}" for key, value in self.items())
        return f"Evaluation({told})"


def evaluate(
    estimate: FilePath | FloatArray,
    reference: FilePath | FloatArray,
    *,
    format: str | None = None,  # noqa: A002 - as the command line calls it
    align: bool = False,
    scale: bool = False,
    topics: Sequence[str] = (),
) -> Evaluation:
    """Say how far an estimated trajectory is from its reference: absolute and relative errors.

    Parameters
    ----------
    estimate, reference
        Files of one format, bags, or arrays: (N, 3) x, y, theta of the same moments, or (N, 4) with times
        first.
    format
        Of the files, ``tum`` or ``kitti``; None: told by their columns.
    align, scale
        Rotate and shift the estimate first; correct its scale first.
    topics
        Of bags: the poses of each one in turn (``/tf:PARENT:CHILD`` for transforms), where the usual are not
        meant. A bag may be judged against another file with times, or against itself by two topics.

    Raises
    ------
    InputError
        Where the two have too few moments in common, or a file is not what it should be.

    Examples
    --------
    >>> import numpy as np, pilotage as pl
    >>> truth = np.column_stack([np.linspace(0.0, 5.0, 51), np.zeros(51), np.zeros(51)])
    >>> found = pl.evaluate(truth + [0.03, 0.04, 0.0], truth)
    >>> round(found["ate_rmse_m"], 6), round(found["rpe_rmse_m"], 6)
    (0.05, 0.0)
    """
    align, scale = given.flag("align", align), given.flag("scale", scale)
    topics, told = given.words("topics", topics), _told_format(format)
    files = isinstance(estimate, str | PathLike), isinstance(reference, str | PathLike)
    if not all(files):
        if any(files):
            raise InputError("evaluate: expected two files or two arrays, found one of each")
        found, true = _of_array("estimate", estimate), _of_array("reference", reference)
        return Evaluation(trajectory_errors(found, true, align=align, scale=scale), "arrays")
    paths = given.path("estimate", estimate), given.path("reference", reference)
    form = told or _format_by_columns(paths[0], paths[1])
    found, true = _read_both(paths, form, topics)
    if found.t_s is None and len(found) != len(true):
        short, full = paths if len(found) < len(true) else paths[::-1]
        raise InputError(
            f"{short}: without times expected as many poses as in {full} ({max(len(found), len(true))}), "
            f"found {min(len(found), len(true))}; is the file cut short?"
        )
    return Evaluation(trajectory_errors(found, true, align=align, scale=scale), str(form))


def _format_by_columns(estimate: Path, reference: Path) -> TrajectoryFormat:
    """The format of both files.

    Raises
    ------
    InputError
        Where the two differ by their columns.
    """
    formats = [
        TrajectoryFormat.TUM if _is_bag(path) else guess_format(path) for path in (estimate, reference)
    ]
    if formats[0] is not formats[1]:
        raise InputError(
            "evaluate: expected both files in one format, found by their columns "
            f"{estimate} as {formats[0]} and {reference} as {formats[1]}"
        )
    return formats[0]


def _told_format(told: str | None) -> TrajectoryFormat | None:
    names = [str(name) for name in TrajectoryFormat]
    if told is not None and given.word("--format", told) not in names:
        raise unknown_name("--format", told, names)
    return None if told is None else TrajectoryFormat(told)


def _is_bag(path: Path) -> bool:
    from pilotage.logs.bag_messages import is_bag

    return path.exists() and is_bag(path)


def _read_both(
    paths: tuple[Path, Path], form: TrajectoryFormat, topics: Sequence[str]
) -> tuple[Trajectory3, Trajectory3]:
    """Files of a format, or topics of bags: each bag takes the next one."""
    from pilotage.logs.bag_series import trajectory_of_bag

    bags = [path for path in paths if _is_bag(path)]
    if len(topics) > len(bags):
        raise InputError(f"evaluate: expected a topic for each bag, found {len(topics)} for {len(bags)}")
    if bags and form is not TrajectoryFormat.TUM:
        raise InputError("evaluate: expected files with times beside a bag, found --format kitti")
    if len(bags) == 2 and bags[0] == bags[1] and len(topics) < 2:
        raise InputError(f"{bags[0]}: expected two topics of the one bag, found {len(topics)}")
    left = iter(topics)
    first, second = (
        trajectory_of_bag(path, next(left, None)) if path in bags else read_trajectory(path, form)
        for path in paths
    )
    return first, second


def _of_array(name: str, values: Any) -> Trajectory3:
    """Planar poses as a path in space."""
    poses = given.array(name, values, None, None)
    if poses.shape[1] not in (3, 4):
        raise InputError(
            f"{name}: expected finite poses (N, 3) x, y, theta or (N, 4) t, x, y, theta, found {poses.shape}"
        )
    t_s = poses[:, 0].copy() if poses.shape[1] == 4 else None
    if t_s is not None and not (np.diff(t_s) > 0.0).all():
        raise InputError(f"{name}: expected times that grow, found one that does not")
    x, y, theta = poses[:, -3], poses[:, -2], poses[:, -1]
    c, s, zero, one = np.cos(theta), np.sin(theta), np.zeros(len(poses)), np.ones(len(poses))
    turns = np.stack([c, -s, zero, s, c, zero, zero, zero, one], axis=1).reshape(-1, 3, 3)
    return Trajectory3(t_s, np.column_stack([x, y, zero]), turns)
