"""The docs hold: links lead somewhere, and every registered name and every metric is told of."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from pilotage.core.errors import InputError
from pilotage.core.yaml_text import load_yaml
from pilotage.evaluation.metrics import METRICS
from pilotage.experiments import recorder
from pilotage.experiments.build.charts import load_chart
from pilotage.experiments.mission import load_mission
from pilotage.experiments.roles import ROLES
from pilotage.experiments.run import run_mission
from pilotage.maps.map_file import MapFile
from pilotage.missions.mission import Mission
from pilotage.missions.old_keys import OLD_KEYS

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


def test_every_column_of_a_trace_is_told_of() -> None:
    """Of what our components declare, as texts with a unit; students plot them."""
    told = (ROOT / "docs/run-folder.md").read_text()
    declared = re.compile(r'"([a-z]\w*)": "(?:1|m|s|rad|rad/s|m/s|m\^2)"')
    sources = [(path, path.read_text()) for path in (ROOT / "src/pilotage/stack").rglob("*.py")]
    names = {
        name
        for _, text in sources
        if "COLUMNS" in text or "channel(" in text
        for name in declared.findall(text)
    }
    names |= {
        name for name in vars(recorder) if name.endswith("_COLUMNS") for name in getattr(recorder, name)
    }
    assert len(names) > 50
    assert sorted(name for name in names if not name.startswith("region_") and f"`{name}`" not in told) == []


def test_every_component_and_every_metric_is_told_of() -> None:
    told = "".join(page.read_text() for page in (ROOT / "docs").glob("*.md"))
    changes = (ROOT / "CHANGELOG.md").read_text()
    names = {entry.name for registry in ROLES.values() for entry in registry}
    assert sorted(name for name in names if f"`{name}`" not in told) == []
    assert sorted(name for name in names if f"`{name}`" not in changes) == []
    keys = {metric.key for metric in METRICS if metric.group}
    assert sorted(key for key in keys - DERIVED if f"`{key}`" not in told) == []


def examples() -> list[dict[str, Any]]:
    """The mission files in the page about them."""
    text = (ROOT / "docs/missions.md").read_text()
    blocks = re.findall(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    return [load_yaml(block, "docs/missions.md") for block in blocks]


SHORT: tuple[list[str], list[str]] = (["run.time_limit_s=3.0"], [])
"""A few steps, and what is planned as a whole: that a mission comes to its end is for other tests."""
MISSIONS = {values["mission"]: values for values in examples() if "mission" in values}


def test_the_page_about_missions_shows_a_map_as_well() -> None:
    assert len(MISSIONS) >= 5
    (room,) = [values for values in examples() if "walls_m" in values]
    values = load_mission("museum-1").model_dump()
    values["world"]["map"] = room
    source = Mission.model_validate(values).world.map
    assert isinstance(source, MapFile)
    assert load_chart(source).walls.segments_m.shape == (4, 4)


@pytest.mark.parametrize("name", MISSIONS)
def test_every_mission_in_the_docs_runs(name: str, tmp_path: Path) -> None:
    path = tmp_path / f"{name}.yaml"
    path.write_text(yaml.safe_dump(MISSIONS[name]))
    metrics = run_mission(load_mission(str(path), SHORT[name == "my-crater"]), save=False).metrics
    assert metrics["mission"] == name
    if name != "my-crater":
        assert float(str(metrics["duration_s"])) > 0.0


@pytest.mark.parametrize("page", [page for page in PAGES if page.name != "CHANGELOG.md"], ids=str)
def test_no_page_sets_an_old_key(page: Path) -> None:
    if "decisions" in page.parts:
        return  # they tell of their day
    old = [key for key in OLD_KEYS if re.search(rf"\b{re.escape(key)}\b(?!_)", page.read_text())]
    assert old == []


def test_old_keys_are_told_with_the_new_ones() -> None:
    with pytest.raises(InputError, match=r"stack\.navigator"):
        load_mission("romi-explore", ["stack.explorer.name=frontier"])
