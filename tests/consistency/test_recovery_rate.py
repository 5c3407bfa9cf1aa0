"""How often a lost robot finds itself, and how often it is wrong: a sample of the study's 100 poses."""

from __future__ import annotations

from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission

RUNS = 20


def numbers(name: str, seed: int, limit_s: float) -> dict[str, object]:
    """Metrics of one run."""
    return run_mission(load_mission(name, [f"run.time_limit_s={limit_s}"], seed), save=False).metrics


def test_lost_robots_find_themselves_and_are_never_wrong() -> None:
    # At the rate that is asked for, 95 of 100, fewer than 16 of 20 would come once in 400.
    runs = [numbers("museum-lost", seed, 15.0) for seed in range(RUNS)]
    assert sum("found_after_s" in run for run in runs) >= 16
    # At 1 wrong run in 100, two or more of 20 would come once in 60.
    assert sum(run["wrong_s"] != 0.0 for run in runs) <= 1
    assert all(run["collisions"] == 0 for run in runs)


def test_carried_robots_notice_and_find_themselves() -> None:
    runs = [numbers("museum-kidnap", seed, 75.0) for seed in range(8)]
    assert sum("found_after_s" in run for run in runs) >= 6
    assert sum(float(str(run["wrong_s"])) > 0.5 for run in runs if "wrong_s" in run) <= 1
