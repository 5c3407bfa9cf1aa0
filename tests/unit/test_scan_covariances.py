"""How sure scans' poses are beyond breaks that nothing joins."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.models.pose_graph import PoseGraph
from pilotage.stack.mapping.slam.scan_covariances import UNKNOWN_RAD2, ScanCovariances

STEPS = 40


def chain(heading_std_rad: float, residual_m: float = 0.01) -> ScanCovariances:
    """A scan a metre, straight on, each known from the one before."""
    poses = np.column_stack([np.arange(STEPS + 1.0), np.zeros((STEPS + 1, 2))])
    i = np.arange(STEPS)
    motion = np.tile([1.0, 0.0, 0.0], (STEPS, 1))
    information = np.tile(np.diag([1e4, 1e4, heading_std_rad**-2]), (STEPS, 1, 1))
    graph = PoseGraph(poses, i, i + 1, motion, information)
    own = np.zeros((STEPS + 1, 3, 3))
    return ScanCovariances(graph, np.ones(STEPS), np.arange(STEPS + 1), poses, own, 0.0, residual_m)


def raw(known: ScanCovariances, monkeypatch: pytest.MonkeyPatch) -> FloatArray:
    """The marginals without a bound."""
    with monkeypatch.context() as patch:
        patch.setattr("pilotage.stack.mapping.slam.scan_covariances.UNKNOWN_RAD2", np.inf)
        return known.marginals()


def test_no_heading_is_less_known_than_one_of_which_nothing_is(monkeypatch: pytest.MonkeyPatch) -> None:
    known = chain(2.0)
    linear, bounded = raw(known, monkeypatch), known.marginals()
    assert linear[-1, 2, 2] > 50.0 * UNKNOWN_RAD2
    assert np.sqrt(linear[-1, 1, 1]) > 10.0 * STEPS  # far outside all that was driven
    assert (bounded[:, 2, 2] <= UNKNOWN_RAD2 * (1.0 + 1e-12)).all()
    assert np.sqrt(bounded[-1, 1, 1]) < 2.0 * STEPS
    assert (np.linalg.eigvalsh(bounded) > 0.0).all()
    # What hangs on the heading is scaled with it: along and across stay as related as they were.
    assert bounded[-1] / bounded[-1, 2, 2] == pytest.approx(linear[-1] / linear[-1, 2, 2])
    last = known.relative(np.array([0]), np.array([STEPS]))
    assert last[0, 2, 2] == pytest.approx(UNKNOWN_RAD2)


def test_what_is_known_stays_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    known = chain(0.02)
    assert np.array_equal(known.marginals(), raw(known, monkeypatch))


def test_a_scan_is_as_unsure_as_scans_fit_badly() -> None:
    """Between scans of one keyframe nothing else counts; no scan is surer than the least residual says."""
    here = np.array([3])
    fits = [chain(0.02, residual_m).relative(here, here)[0] for residual_m in (0.01, 0.02, 0.0, 1e-6)]
    assert fits[1] == pytest.approx(4.0 * fits[0])
    assert (fits[2] == fits[3]).all()
    assert (np.diag(fits[2]) > 0.0).all()
