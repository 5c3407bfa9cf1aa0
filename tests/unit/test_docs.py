"""The docs hold: links lead somewhere, and every registered name and every metric is told of."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from pilotage.evaluation.metrics import METRICS
from pilotage.experiments.roles import ROLES

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *(ROOT / "docs").rglob("*.md")]
DERIVED = frozenset({"planned_over_shortest"}) | {
    f"{pose}_{axis}" for pose in ("final_error", "end") for axis in ("x_m", "y_m", "theta_rad")
}
"""Rows of the table that are made from other metrics."""


def anchors(page: Path) -> set[str]:
    """The places in a page that a link can name, as forges make them from headings."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def broken_links(page: Path) -> Iterator[str]:
    for target, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([^)\s]*))?\)", page.read_text()):
        if "://" in target:
            continue
        place = page.parent / target if target else page
        if not place.exists() or (anchor and anchor not in anchors(place)):
            yield f"{page.name}: {target}#{anchor}"


def test_links_lead_somewhere() -> None:
    assert [link for page in PAGES for link in broken_links(page)] == []


def test_files_that_are_named_are_there() -> None:
    rooms = "|".join(sorted(path.name for path in (ROOT / "src/pilotage").iterdir() if path.is_dir()))
    named = re.compile(rf"`((?:src|tests|benchmarks|examples|docs|{rooms})/[\w/.-]+\.\w+)`")
    missing = [
        f"{page.name}: {path}"
        for page in PAGES
        for path in named.findall(page.read_text())
        if not ((ROOT / path).exists() or (ROOT / "src/pilotage" / path).exists())
    ]
    assert missing == []


def test_every_component_and_every_metric_is_told_of() -> None:
    told = "".join(page.read_text() for page in (ROOT / "docs").glob("*.md"))
    changes = (ROOT / "CHANGELOG.md").read_text()
    names = {entry.name for registry in ROLES.values() for entry in registry}
    assert sorted(name for name in names if f"`{name}`" not in told) == []
    assert sorted(name for name in names if f"`{name}`" not in changes) == []
    keys = {metric.key for metric in METRICS if metric.group}
    assert sorted(key for key in keys - DERIVED if f"`{key}`" not in told) == []
