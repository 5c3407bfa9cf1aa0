"""README and docs quote what docs/claims.json measured, and no number that nothing accounts for."""

from __future__ import annotations

import datetime
import importlib.util
import json
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[2]


def _module() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_claims", ROOT / "docs" / "make_claims.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


MAKER = _module()
CLAIMS: dict[str, Any] = json.loads((ROOT / "docs" / "claims.json").read_text())
GIVEN: dict[str, Any] = json.loads((ROOT / "docs" / "given.json").read_text())
REGISTRY: dict[str, Any] = yaml.safe_load((ROOT / "docs" / "claims.yaml").read_text())


def test_every_claim_says_when_how_and_of_how_many() -> None:
    assert CLAIMS.keys() == REGISTRY.keys(), "measured: all that is registered, and nothing else"
    for name, claim in CLAIMS.items():
        assert datetime.date.fromisoformat(claim["date"]), name
        assert claim["command"].split()[0] in ("pilotage", "python"), name
        assert claim["seeds"], name
        assert claim["n"] >= 1, name
        assert claim["values"], name


@pytest.mark.parametrize("page", MAKER.PAGES, ids=lambda page: page.name)
def test_pages_quote_what_was_measured(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert MAKER.quoted(text, CLAIMS) == text, "write the numbers anew: python docs/make_claims.py --quote"


@pytest.mark.parametrize("page", MAKER.PAGES, ids=lambda page: page.name)
def test_pages_hold_no_other_number(page: Path) -> None:
    remedy = (
        "quote a claim as docs/make_claims.py says, or add a definition or a parameter to docs/given.json"
    )
    assert MAKER.unaccounted(page, GIVEN) == [], remedy


def test_some_numbers_are_quoted() -> None:
    count = sum(len(list(MAKER.quotes(page.read_text(encoding="utf-8")))) for page in MAKER.PAGES)
    assert count >= 20


CLAIM = {"it": {"values": {"a :: b": {"value": 0.94512, "low": 0.9, "high": -0.25, "n": 30}}}}
QUOTE = "<!--= it :: a :: b :: %1 -->"


@pytest.mark.parametrize(
    ("form", "text"),
    [
        ("%1", "94.5"),
        ("2", "0.95"),
        ("m0", "945"),
        ("low %0", "90"),
        ("n 0", "30"),
        ("ci 1", "0.9 (0.9 to \u22120.2)"),
    ],
)
def test_values_are_written_as_asked(form: str, text: str) -> None:
    assert MAKER.rendered(CLAIM, "it", "a :: b", form) == text
    page = f"About {text}<!--= it :: a :: b :: {form} --> of it."
    assert MAKER.quoted(page, CLAIM) == page


def test_another_number_before_a_quote_is_put_right_and_noticed() -> None:
    assert MAKER.quoted(f"**93.1{QUOTE} %**", CLAIM) == f"**94.5{QUOTE} %**"
    assert MAKER.quoted(f"of 12 it is {QUOTE} %", CLAIM) == f"of 12 it is 94.5{QUOTE} %"


@pytest.mark.parametrize("form", ["%", "x1", "largest 1", "1 1"])
def test_what_cannot_be_written_is_refused(form: str) -> None:
    with pytest.raises(MAKER.ClaimError):
        MAKER.rendered(CLAIM, "it", "a :: b", form)
    with pytest.raises(MAKER.ClaimError, match="register"):
        MAKER.rendered(CLAIM, "it", "a :: c", "%1")


def test_numbers_are_found_outside_code_and_quotes(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"It takes 3.5 s in `12` of 44 of 50, 94.5{QUOTE} %, see [7](9.md)\n\n    code 13\n")
    assert MAKER.loose(page.read_text()) == ["3.5 s", "44 of 50", "7"]
    assert MAKER.unaccounted(page, {"page.md": ["7", "3.5 s"]}) == ["44 of 50"]


@pytest.mark.parametrize("study", ["museum-planner-first", "museum-planner"])
def test_planned_paths_are_no_longer_and_no_rougher_than_the_reports(study: str) -> None:
    """At each of the annex's 31 settings: after the first path and the smoother, and optimized."""
    values = CLAIMS[study]["values"]
    definition = yaml.safe_load((ROOT / f"src/pilotage/missions/studies/{study}.yaml").read_text())
    assert len(definition["published"]) == 31
    for published in definition["published"]:
        ((factor, value),) = published["cell"].items()
        for metric in ("planned_length_m", "smoothness"):
            ours = values[f"{factor}={value:g} :: {metric}"]
            assert ours["value"] <= published["metrics"][metric], (factor, value, metric)


@pytest.mark.parametrize("task", ["third task", "optional task"])
def test_the_rovers_ellipses_hold_what_they_say(task: str) -> None:
    """Over all steps of a thousand runs: 95 % of them, by odometry alone a little less."""
    for estimator, off in (("EKF", 0.005), ("dead reckoning", 0.015)):
        share = CLAIMS["gale"]["values"][f"{task} :: {estimator} :: in ellipse"]
        assert share["n"] >= 1000
        assert abs(share["value"] - 0.95) <= off, estimator
