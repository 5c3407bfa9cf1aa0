"""Planar pose graphs as g2o text.

``VERTEX_SE2 id x y theta`` and ``EDGE_SE2 i j dx dy dtheta I11 I12 I13 I22 I23 I33``; comments (#) and
``FIX`` lines are read past. A file may leave vertices out: their poses follow from the edges then.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, IntArray
from pilotage.core.whole_file import write_whole
from pilotage.core.whole_number import whole_number
from pilotage.kernels.slam.spanning_tree import spanning_tree_poses
from pilotage.logs.text import read_text
from pilotage.models.pose_graph import LARGEST, PoseGraph, is_information

VERTEX, EDGE = "VERTEX_SE2", "EDGE_SE2"
WORDS = {VERTEX: 5, EDGE: 12}
IGNORED = {"FIX"}
ROWS, COLUMNS = np.triu_indices(3)


@dataclass(frozen=True, slots=True)
class G2oGraph:
    """A pose graph and the ids (N,), ascending, that its poses have in the file."""

    graph: PoseGraph
    ids: IntArray


def read_g2o(path: Path) -> G2oGraph:
    """Read a graph; poses without a vertex are laid out along the edges, from the least id of each part.

    Raises
    ------
    InputError
        File and line of what is cut short, no number, not finite, a vertex given twice, an edge from a pose
        to itself, an information matrix that is not positive semi-definite, or another kind of vertex; or
        where there is nothing.
    """
    vertices: dict[int, list[float]] = {}
    ends: list[tuple[int, int]] = []
    numbers: list[list[float]] = []
    places: list[int] = []
    text = read_text(path)
    lines = text.splitlines()
    for number, line in enumerate(lines, start=1):
        words = line.partition("#")[0].split()
        if not words or words[0] in IGNORED:
            continue
        where = f"{path} line {number}"
        if words[0] not in WORDS:
            raise InputError(f"{where}: expected {VERTEX} or {EDGE} (planar graphs), found {words[0]}")
        if len(words) != WORDS[words[0]]:
            cut = "; the file seems to be cut short" if number == len(lines) else ""
            raise InputError(
                f"{where}: {words[0]}: expected {WORDS[words[0]]} words, found {len(words)}{cut}"
            )
        if words[0] == VERTEX:
            name = _id(words[1], where)
            if name in vertices:
                raise InputError(f"{where}: expected each vertex once, found {name} again")
            vertices[name] = _floats(words[2:], where)
        else:
            pair = _id(words[1], where), _id(words[2], where)
            if pair[0] == pair[1]:
                raise InputError(f"{where}: expected an edge between two poses, found {pair[0]} twice")
            ends.append(pair)
            numbers.append(_floats(words[3:], where))
            places.append(number)
    if not vertices and not ends:
        raise InputError(
            f"{path} line {len(lines) + 1}: expected {VERTEX} or {EDGE} lines, found the end of the file"
        )
    return _graph(path, vertices, ends, np.array(numbers).reshape(-1, 9), places)


def _graph(
    path: Path,
    vertices: dict[int, list[float]],
    ends: list[tuple[int, int]],
    numbers: FloatArray,
    places: list[int],
) -> G2oGraph:
    information = np.zeros((len(ends), 3, 3))
    information[:, ROWS, COLUMNS] = numbers[:, 3:]
    information[:, COLUMNS, ROWS] = numbers[:, 3:]
    bad = np.flatnonzero(~is_information(information))
    if bad.size:
        raise InputError(
            f"{path} line {places[int(bad[0])]}: expected a positive semi-definite information matrix"
        )
    pairs = np.array(ends, dtype=np.int64).reshape(-1, 2)
    ids = np.unique(np.concatenate([np.array(list(vertices), dtype=np.int64), pairs.ravel()]))
    i, j = np.searchsorted(ids, pairs[:, 0]), np.searchsorted(ids, pairs[:, 1])
    poses = np.zeros((ids.size, 3))
    known = np.zeros(ids.size, dtype=np.bool_)
    if vertices:
        at = np.searchsorted(ids, np.array(list(vertices), dtype=np.int64))
        poses[at] = np.array(list(vertices.values()))
        known[at] = True
    measurements = np.ascontiguousarray(numbers[:, :3])
    while not known.all():
        poses, known = spanning_tree_poses(poses, known, i, j, measurements)
        if not known.all():
            known[int(np.flatnonzero(~known)[0])] = True
    return G2oGraph(PoseGraph(poses, i, j, measurements, information), ids)


def write_g2o(path: Path, graph: PoseGraph, ids: IntArray | None = None) -> None:
    """Write a graph with as many digits as the numbers need: it is read back as it is.

    Parameters
    ----------
    ids
        (N,) of the poses; by default 0 to N - 1.

    Raises
    ------
    InputError
        Where the ids are not as many as the poses.
    OSError
        Where the file cannot be written.
    """
    names = np.arange(len(graph)) if ids is None else ids
    if names.shape != (len(graph),):
        raise InputError(f"{path}: expected {len(graph)} ids, found {names.size}")
    lines = [f"{VERTEX} {name} {_text(pose)}" for name, pose in zip(names.tolist(), graph.poses, strict=True)]
    upper = graph.information[:, ROWS, COLUMNS]
    lines += [
        f"{EDGE} {names[graph.i[k]]} {names[graph.j[k]]} {_text(graph.measurements[k])} {_text(upper[k])}"
        for k in range(graph.i.size)
    ]
    write_whole(path, "\n".join(lines) + "\n")


def _text(values: FloatArray) -> str:
    return " ".join(map(repr, values.tolist()))


def _id(word: str, where: str) -> int:
    number = whole_number(word)
    if number is None:
        raise InputError(f"{where}: expected the number of a vertex, found '{word}'")
    return number


def _floats(words: list[str], where: str) -> list[float]:
    values = []
    for word in words:
        try:
            values.append(float(word.replace("_", "?")))
        except ValueError:
            raise InputError(f"{where}: expected a number, found '{word}'") from None
    if not all(math.isfinite(value) for value in values):
        raise InputError(f"{where}: expected finite numbers, found NaN or infinity")
    if max(map(abs, values[:3])) > LARGEST:
        raise InputError(f"{where}: expected metres and radians within {LARGEST:g}, found more")
    return values
