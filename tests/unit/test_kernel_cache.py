"""Compiled kernels: one process compiles, the others that need them wait, wherever their files lie."""

from __future__ import annotations

import gc
import importlib
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any, cast
from unittest.mock import Mock

import numba
import numpy as np
import pytest
from numba.core import event, types
from numba.core.errors import TypingError
from numba.core.typing import templates
from numba.extending import overload

from pilotage.core.types import FloatArray
from pilotage.kernels import code_cache, dispatchers
from pilotage.kernels.arrays import read_only
from pilotage.kernels.geometry import plane
from pilotage.kernels.jit import kernel
from pilotage.kernels.user_cache import user_cache
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.stack.control.local.body import make_body
from pilotage.stack.mapping.slam.odometry import recording_of
from pilotage.stack.navigator.own_map import OwnMap
from support.laser_rooms import furnished, recording

typeof: Any = numba.typeof

TOY = """
from pilotage.kernels.jit import kernel

@kernel
def twice(x):
    return 2 * x

if __name__ == "__main__":
    assert twice(21) == 42
    print(sum(twice.stats.cache_misses.values()), sum(twice.stats.cache_hits.values()))
"""


def test_of_processes_that_begin_together_one_compiles(tmp_path: Path) -> None:
    """In two clones of the same source: the cache knows what is in a file, not where it lies."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "PILOTAGE_CACHE_DIR": str(tmp_path)}
    children = []
    for clone in ("one", "two"):
        (tmp_path / clone).mkdir()
        (tmp_path / clone / "toy.py").write_text(TOY)
        words = [sys.executable, str(tmp_path / clone / "toy.py")]
        children.append(subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=environment))
    told = sorted(child.communicate()[0].split() for child in children)
    assert told == [["0", "1"], ["1", "0"]]
    (tmp_path / "one" / "toy.py").write_text(TOY.replace("2 *", "1 * 2 *"))
    again = subprocess.run(
        [sys.executable, str(tmp_path / "one" / "toy.py")],
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
        check=True,
    )
    assert again.stdout.split() == ["1", "0"]  # another source is compiled anew


@pytest.mark.usefixtures("nothing_compiled")
@pytest.mark.parametrize("when", ["before", "while it is compiled"])
def test_a_kernel_whose_cache_is_gone_is_compiled(
    when: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who emptied the cache beside a first run ended it with "No such file"; so did a disk that was full."""

    @kernel
    def lost(x: float) -> float:
        return x + 3.0

    def lose() -> None:
        shutil.rmtree(tmp_path, ignore_errors=True)
        tmp_path.write_text("no folder")

    if when == "before":
        lose()
    else:
        making: Any = dispatchers._Locator.ensure_cache_path
        times = iter([lambda: None, lose])

        def made(self: Any) -> None:
            making(self)
            next(times)()

        monkeypatch.setattr(dispatchers._Locator, "ensure_cache_path", made)
    assert lost(1.0) == 4.0
    tmp_path.unlink()


@pytest.mark.usefixtures("nothing_compiled")
@pytest.mark.parametrize("end", ["nbi", "nbc"])
def test_a_damaged_cache_is_compiled_anew(end: str, tmp_path: Path) -> None:
    """A power cut leaves files of no bytes: each later run ended in a traceback."""

    def make() -> Any:
        @kernel
        def cut(x: float) -> float:
            return x + 4.0

        return cut

    assert make()(1.0) == 5.0
    (kept,) = tmp_path.rglob(f"*.{end}")
    kept.write_bytes(b"")
    again = make()
    assert again(1.0) == 5.0
    assert sum(again.stats.cache_hits.values()) == 0
    healed = make()
    assert healed(1.0) == 5.0
    assert sum(healed.stats.cache_hits.values()) == 1


@pytest.mark.parametrize(("home", "xdg"), [("", ""), ("here", "there")])
def test_a_home_that_is_no_place_is_not_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, home: str, xdg: str
) -> None:
    """An empty HOME was the root of the file system, a relative one a folder wherever one stands."""
    monkeypatch.delenv("PILOTAGE_CACHE_DIR", raising=False)
    monkeypatch.setenv("HOME", home)
    monkeypatch.setenv("XDG_CACHE_HOME", xdg)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    folder = user_cache("toys")
    assert folder is not None
    assert folder.is_relative_to(tmp_path)
    assert folder.parent.name.startswith("pilotage-")
    assert [path.name for path in tmp_path.iterdir()] == [folder.parent.name]


@pytest.mark.usefixtures("nothing_compiled")
def test_a_kernel_that_nobody_calls_has_no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    """To make one took a folder, a temporary file and the digest of a source for each of five hundred."""
    made: list[str] = []
    making: Any = dispatchers._Cache.__init__

    def counted(self: Any, function: Any) -> None:
        made.append(function.__name__)
        making(self, function)

    monkeypatch.setattr(dispatchers._Cache, "__init__", counted)

    @kernel
    def called(x: float) -> float:
        return x + 1.0

    @kernel
    def left(x: float) -> float:
        return x - 1.0

    assert not made
    assert called(1.0) == 2.0
    assert called(2.0) == 3.0
    assert made == ["called"]
    assert left(1.0) == 0.0
    assert made == ["called", "left"]


@pytest.mark.usefixtures("nothing_compiled")
def test_a_source_that_is_edited_before_the_first_call_is_not_taken_for_what_was_imported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "edited_toy.py"
    file.write_text(TOY)
    monkeypatch.syspath_prepend(str(tmp_path))
    toy = importlib.import_module("edited_toy")
    file.write_text(TOY.replace("2 *", "3 *"))
    assert toy.twice(21) == 42
    code_cache._read.cache_clear()
    code_cache.sources_of.cache_clear()
    code_cache._digest.cache_clear()
    folder = toy.twice.stats.cache_path
    assert folder != str(code_cache.folder_of(file)), "the new source would be given the old one's code"


def test_how_numba_compiles_is_part_of_what_compiled_code_is_named_by() -> None:
    file = Path(str(plane.__file__))
    names = {source.name for source in code_cache.sources_of(file)}
    assert {"plane.py", "jit.py", "dispatchers.py"} <= names


@pytest.fixture
def nothing_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(code_cache, "_CACHE", tmp_path)


@pytest.mark.usefixtures("nothing_compiled")
def test_a_kernel_is_compiled_for_a_type_not_for_each_number_in_a_call() -> None:
    @kernel
    def scaled(x: float, by: int) -> float:
        return x * by

    @kernel
    def both(x: float, by: int) -> float:
        return scaled(x, 2) + scaled(x, 3) + scaled(x, by)

    assert both(1.0, 4) == 9.0
    assert len(cast(Any, scaled).signatures) == 1


@pytest.mark.usefixtures("nothing_compiled")
def test_garbage_is_looked_for_as_before_once_a_kernel_is_compiled() -> None:
    during = []

    class Looks(event.Listener):
        def on_start(self, _: object) -> None:
            during.append(gc.get_threshold())

        def on_end(self, _: object) -> None:
            during.append(gc.get_threshold())

    @kernel
    def half(x: float) -> float:
        return 0.5 * x

    @kernel
    def quarter(x: float) -> float:
        return half(half(x))

    before = gc.get_threshold()
    gc.set_threshold(600, 9, 9)
    try:
        with event.install_listener("numba:compile", Looks()):
            assert quarter(4.0) == 1.0
        assert gc.get_threshold() == (600, 9, 9)
    finally:
        gc.set_threshold(*before)
    assert sum(threshold[0] > 10_000 for threshold in during) >= 3, "of the one within the other and back"


@pytest.mark.usefixtures("nothing_compiled")
def test_a_slice_of_another_shape_is_refused_without_compiling_functions_on_text() -> None:
    compiled: list[str] = []

    class Names(event.Listener):
        def on_start(self, start: Any) -> None:
            compiled.append(start.data["dispatcher"].py_func.__module__)

        def on_end(self, _: object) -> None:
            pass

    @kernel
    def copied(into: FloatArray, row: FloatArray) -> None:
        into[1] = row

    into = np.zeros((2, 3))
    with event.install_listener("numba:compile", Names()):
        copied(into, np.arange(3.0))
    assert into.tolist() == [[0.0, 0.0, 0.0], [0.0, 1.0, 2.0]]
    with pytest.raises(ValueError, match="cannot assign slice from input of different size"):
        copied(into, np.arange(4.0))
    assert not any("unicode" in name for name in compiled)


@pytest.mark.usefixtures("nothing_compiled")
def test_what_numba_leaves_out_while_it_compiles() -> None:
    """Each of these took a part of the processor time and made no other code."""

    @kernel
    def summed(values: FloatArray) -> float:
        total = 0.0
        for value in values:
            total = total + value
        return total

    assert summed(np.arange(4.0)) == 6.0
    (version,) = cast(Any, summed).overloads.values()
    assert version.library.is_light, "no pass over each function beside those over the module"
    assert templates._OverloadFunctionTemplate.generic.__module__ == "pilotage.kernels.compiling"


@pytest.mark.usefixtures("nothing_compiled")
def test_an_overload_that_refused_some_types_is_asked_for_others() -> None:
    @overload(_doubled, strict=False)
    def _(x: Any) -> Any:
        return (lambda x: 2.0 * x) if x == types.float64 else None

    @kernel
    def asks(x: Any) -> Any:
        return _doubled(x)

    for refused in (True, False):
        with pytest.raises(TypingError):
            asks(refused)
    assert asks(1.5) == 3.0


def _doubled(x: Any) -> Any:
    """A function that a kernel cannot call but for its overload."""
    raise NotImplementedError(x)


def test_bodies_and_walls_are_of_one_type_wherever_they_come_from() -> None:
    """Kernels were compiled twice: for corners that a caller could write to, and in clockwise order."""
    corners = np.array([[0.2, 0.1], [-0.2, 0.1], [-0.2, -0.1], [0.2, -0.1]])
    bodies = [make_body(given) for given in (corners, corners[::-1], corners.tolist(), read_only(corners))]
    (kind,) = {typeof(body) for body in bodies}
    assert kind == typeof(make_body(Footprint.polygon(corners.copy()).points_m))
    corners[0] = 0.3, 0.1
    told = WorldMap("room", (0.0, 0.0, 4.0, 4.0), geometry=SegmentMap.of(np.array([[0.0, 0.0, 4.0, 4.0]])))
    found = Mock(circles_m=np.zeros((0, 3)))
    own = OwnMap(told, found)
    before = typeof(own.circles_m)
    found.circles_m = np.array([[1.0, 2.0, 0.1]])
    assert own.circles_m.tolist() == [[1.0, 2.0, 0.1]]
    assert typeof(own.circles_m) == before


def test_a_recording_is_of_one_type_however_its_columns_lie() -> None:
    log = recording(furnished(), np.array([[2.0, 4.0, 0.1 * k] for k in range(4)]), np.random.default_rng(0))
    table = np.column_stack([log.first_angle_rad, log.angle_step_rad])
    apart = replace(log, first_angle_rad=table[:, 0], angle_step_rad=table[:, 1])
    assert typeof(recording_of(apart, used=True)) == typeof(recording_of(log, used=True))
