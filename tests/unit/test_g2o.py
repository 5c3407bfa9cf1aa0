"""g2o files: read, written, and refused with file and line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.errors import InputError
from pilotage.logs.g2o import read_g2o, write_g2o
from pilotage.models.pose_graph import PoseGraph

TWO = """# a pair
VERTEX_SE2 3 0 0 0
VERTEX_SE2 7 1 0 0.5
FIX 3
EDGE_SE2 3 7 1 0.25 0.5 4 1 0 3 0 2
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "graph.g2o"
    path.write_text(text)
    return path


def test_a_small_file(tmp_path: Path) -> None:
    found = read_g2o(written(tmp_path, TWO))
    assert found.ids.tolist() == [3, 7]
    assert found.graph.poses.tolist() == [[0, 0, 0], [1, 0, 0.5]]
    assert (found.graph.i.tolist(), found.graph.j.tolist()) == ([0], [1])
    assert found.graph.information[0].tolist() == [[4, 1, 0], [1, 3, 0], [0, 0, 2]]


def test_vertices_left_out_follow_from_the_edges(tmp_path: Path) -> None:
    text = "EDGE_SE2 0 1 1 0 1.5707963267948966 1 0 0 1 0 1\nEDGE_SE2 2 1 1 0 0 1 0 0 1 0 1\n"
    text += "EDGE_SE2 8 9 2 0 0 1 0 0 1 0 1\n"
    found = read_g2o(written(tmp_path, text))
    expected = [[0, 0, 0], [1, 0, np.pi / 2], [1, -1, np.pi / 2], [0, 0, 0], [2, 0, 0]]
    np.testing.assert_allclose(found.graph.poses, np.array(expected), atol=1e-12)
    assert found.graph.squared_errors().max() < 1e-24


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(2, 12), m=st.integers(0, 20))
@settings(max_examples=30, deadline=None)
def test_a_round_trip_keeps_every_bit(
    tmp_path_factory: pytest.TempPathFactory, seed: int, n: int, m: int
) -> None:
    rng = np.random.default_rng(seed)
    i = rng.integers(0, n, m)
    j = (i + rng.integers(1, n, m)) % n
    a = rng.normal(size=(m, 3, 3))
    graph = PoseGraph(rng.normal(size=(n, 3)), i, j, rng.normal(size=(m, 3)), a @ a.transpose(0, 2, 1))
    symmetric = np.triu(graph.information) + np.triu(graph.information, 1).transpose(0, 2, 1)
    graph = PoseGraph(graph.poses, i, j, graph.measurements, symmetric)
    path = tmp_path_factory.mktemp("g2o") / "graph.g2o"
    write_g2o(path, graph)
    again = read_g2o(path).graph
    for name in ("poses", "i", "j", "measurements", "information"):
        assert getattr(again, name).tobytes() == getattr(graph, name).tobytes()


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("VERTEX_SE3:QUAT 1 0 0 0 0 0 0 1", "planar"),
        ("VERTEX_SE2 8 0 0", "expected 5 words, found 4; the file seems to be cut short"),
        ("VERTEX_SE2 8 0 0 x", "expected a number"),
        ("VERTEX_SE2 8 0 0 1_0", "expected a number"),
        ("VERTEX_SE2 8 0 0 nan", "finite"),
        ("VERTEX_SE2 8 0 1e30 0", "within"),
        ("VERTEX_SE2 -8 0 0 0", "number of a vertex"),
        ("VERTEX_SE2 7 0 0 0", "7 again"),
        ("EDGE_SE2 3 3 0 0 0 1 0 0 1 0 1", "3 twice"),
        ("EDGE_SE2 3 7 0 0 0 1 0 0 1 0", "expected 12 words"),
        ("EDGE_SE2 3 7 0 0 0 1 5 0 1 0 1", "semi-definite"),
    ],
)
def test_what_cannot_be_read_is_told_by_line(tmp_path: Path, line: str, words: str) -> None:
    path = written(tmp_path, TWO + line)
    with pytest.raises(InputError, match=words) as told:
        read_g2o(path)
    assert f"{path} line 6" in str(told.value)
    assert "\n" not in str(told.value)


def test_nothing_and_wrong_ids(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="found the end of the file"):
        read_g2o(written(tmp_path, "# nothing\n"))
    graph = read_g2o(written(tmp_path, TWO)).graph
    with pytest.raises(InputError, match="expected 2 ids"):
        write_g2o(tmp_path / "out.g2o", graph, np.array([1]))
