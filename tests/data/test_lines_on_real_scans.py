"""Lines of real scans: most returns lie on one, the points lie near it, and the next scan shows it again."""

from __future__ import annotations

import importlib.util
import itertools
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from pilotage.logs.carmen import read_carmen
from support.recordings import recording


def example() -> ModuleType:
    """The example that draws them."""
    path = Path(__file__).parents[2] / "examples" / "lines_on_real_scans.py"
    spec = importlib.util.spec_from_file_location("lines_on_real_scans", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    # Its dataclass looks its own module up.
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(__import__("sys").modules, spec.name, module)
        spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("log", "least_share", "most_off_m", "least_again"),
    [
        ("intel/intel-corrected.log.gz", 0.55, 0.015, 0.8),
        ("fhw_museum/fhw-corrected.log.gz", 0.45, 0.025, 0.7),
    ],
)
def test_real_walls_are_lines_and_are_seen_again(
    log: str, least_share: float, most_off_m: float, least_again: float
) -> None:
    lines = example()
    scans = lines.lines_of(read_carmen(recording(log)))
    share = np.mean([(scan.found.members >= 0).sum() / max(len(scan.returned), 1) for scan in scans])
    assert share > least_share
    off = np.concatenate([lines.residuals_m(scan) for scan in scans])
    assert np.sqrt(np.mean(off**2)) < most_off_m
    pairs = np.array([lines.seen_again(a, b) for a, b in itertools.pairwise(scans)])
    assert pairs[:, 0].sum() > least_again * pairs[:, 1].sum()
    assert max(len(scan.found) for scan in scans) < 20
