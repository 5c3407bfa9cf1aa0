"""Dead reckoning over a rover's stops: made-up rovers whose truth is known, and the reader's complaints."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from pilotage.calibration.stop_legs import LegModel, Legs
from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.experiments.recordings.stops import reckon, textbook
from pilotage.face.localizing import localize
from pilotage.logs.stops_csv import COLUMNS, read_stops


def rover(
    seed: int, legs: int = 400, share: float = 0.93, drift: float = 0.0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Stops of a rover that drives along its final yaw, but for a scatter, with slip; ``drift`` is shared."""
    rng = np.random.default_rng(seed)
    heading = 0.6 * np.cumsum(rng.normal(0.0, 0.3, legs + 1)) % (2.0 * math.pi)
    odometer = rng.uniform(5.0, 80.0, legs)
    course = heading[1:] + rng.normal(0.0, 0.3, legs)
    steps = share * odometer[:, None] * np.column_stack([np.cos(course), np.sin(course)])
    common = np.repeat(rng.normal(0.0, drift, (legs // 40, 2)), 40, axis=0)
    position = np.vstack([[0.0, 0.0], np.cumsum(steps + common * odometer[:, None], axis=0)])
    return position, heading, np.concatenate([[0.0], odometer])


def written(path: Path, position: FloatArray, heading: FloatArray, odometer: FloatArray) -> Path:
    yaw = 0.5 * math.pi - heading
    rows = [
        f"{k},{8e6 + x:.4f},{y:.4f},{a:.6f},{o:.4f},final"
        for k, ((x, y), a, o) in enumerate(zip(position, yaw, odometer, strict=True))
    ]
    path.write_text("\n".join([",".join([*COLUMNS, "drive_type"]), *rows]) + "\n")
    return path


@pytest.mark.parametrize("drift", [0.0, 0.15])
def test_the_ellipse_holds_what_it_says_also_where_errors_are_alike(drift: float) -> None:
    """Over 12 rovers of 10 stretches the mean coverage is 95 % by 0.02 to 0.03 (one standard deviation)."""
    found = [reckon(Legs.between(*rover(seed, drift=drift))) for seed in range(12)]
    assert 0.88 < np.mean([one.inside.mean() for one in found]) <= 0.995
    assert 1.3 < np.mean([one.nees.mean() for one in found]) < 2.7
    if drift:
        assert np.mean([one.factors.mean() for one in found]) > 2.0


def test_slip_is_found_and_the_textbook_holds_nothing() -> None:
    legs = Legs.between(*rover(3, share=0.8))
    found = reckon(legs)
    assert found.shares == pytest.approx(0.8, abs=0.01)
    assert textbook(legs, found.stretch).mean() < 0.3


def test_no_stretch_teaches_itself() -> None:
    """A stretch with another odometer changes the others' covariances and not its own estimate."""
    position, heading, odometer = rover(5)
    plain = reckon(Legs.between(position, heading, odometer))
    moved = position.copy()
    moved[:41] *= 1.5
    moved[41:] += moved[40] - position[40]
    other = reckon(Legs.between(moved, heading, odometer))
    first = plain.stretch == 0
    chords = np.cumsum(np.diff(position, axis=0)[first], axis=0)
    stretched = np.cumsum(np.diff(moved, axis=0)[first], axis=0)
    assert np.allclose(plain.error_m[first] + chords, other.error_m[first] + stretched, atol=1e-9)
    assert not np.allclose(plain.error_m[~first], other.error_m[~first])


def test_the_model_gives_back_what_made_the_legs() -> None:
    position, heading, odometer = rover(1, legs=4000)
    legs = Legs.between(position, heading, odometer)
    chords, covs = LegModel.fitted(legs, np.arange(4000)).predicted(legs)
    error = chords - legs.chord_m
    squared = np.einsum(
        "ni,nij,nj->n",
        *(
            np.column_stack([error.real, error.imag]),
            np.linalg.inv(covs),
            np.column_stack([error.real, error.imag]),
        ),
    )
    assert squared.mean() == pytest.approx(2.0, abs=0.1)
    assert np.linalg.eigvalsh(covs).min() > 0.0


def test_the_command_writes_a_run_and_its_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = written(tmp_path / "stops.csv", *rover(2))
    run = localize(log, format="stops", out=tmp_path)
    assert 0.0 <= run.metrics["ellipse_coverage_low"] <= run.metrics["ellipse_coverage"] <= 1.0
    assert run.trace["est_x_m"].shape == (401,)
    assert "The map" in run.report().read_text()
    assert main(["localize", str(log), "--format", "stops", "--out", str(tmp_path), "--robot", "1"]) == 2
    assert "takes no --robot" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (lambda rows: rows[:50], "at least 100 stops"),
        (lambda rows: [rows[0].replace("yaw_rad", "yaw"), *rows[1:]], "yaw_rad"),
        (lambda rows: [*rows[:60], "3," + rows[60].partition(",")[2], *rows[61:]], "sols in order"),
        (lambda rows: [*rows[:9], rows[9].replace(",final", "x,final"), *rows[10:]], "line 10"),
        (lambda rows: [*rows[:9], rows[9].rsplit(",", 2)[0] + ",-4.0,final", *rows[10:]], "mobtrav_id"),
    ],
)
def test_damaged_logs_are_refused_with_their_line(damage: object, says: str, tmp_path: Path) -> None:
    log = written(tmp_path / "stops.csv", *rover(2))
    rows = log.read_text().splitlines()
    log.write_text("\n".join(damage(rows)) + "\n")  # type: ignore[operator]
    with pytest.raises(InputError, match=says):
        read_stops(log)
