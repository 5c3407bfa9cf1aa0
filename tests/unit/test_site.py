"""The documentation site builds strictly, its links lead somewhere, and it asks nothing of the network."""

from __future__ import annotations

import ast
import importlib.util
import json
import sys
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree

import numpy as np
import pytest

import pilotage as pl
from support.browser import Browser

pytest.importorskip("mkdocs", reason="needs the extra 'docs'")
pytest.importorskip("material", reason="needs the extra 'docs'")
DOCS = Path(__file__).parents[2] / "docs"


class Page(HTMLParser):
    """What a page leads to, what it loads, and the places in it."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.places: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        found = {key: value or "" for key, value in attributes}
        self.places |= {found[key] for key in ("id", "name") if key in found}
        if tag == "a" and "href" in found:
            self.links.append(found["href"])
        elif tag == "link" and found.get("rel") not in ("canonical", "next", "prev"):
            self.loaded.append(found.get("href", ""))
        elif "src" in found:
            self.loaded.append(found["src"])


@pytest.fixture(scope="module")
def maker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_site", DOCS / "make_site.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["make_site"] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def site(maker: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    built = maker.build(tmp_path_factory.mktemp("build"), quick=True)
    assert isinstance(built, Path)
    return built


def test_a_site_opened_from_its_files_searches(site: Path, browser: Browser) -> None:
    browser.size(1280, 900)
    browser.call("Emulation.setFocusEmulationEnabled", enabled=True)
    for page in ("index.html", "decisions/index.html"):
        browser.open(site / page, f"document.readyState === 'complete' && location.href.endsWith('{page}')")
        where = "document.querySelector('.md-search__input').getBoundingClientRect()"
        browser.wait(f"{where}.width > 0")
        x, y = browser.js(f"(() => {{ const r = {where}; return [r.x + r.width / 2, r.y + 5]; }})()")
        browser.mouse("mousePressed", x, y)
        browser.mouse("mouseReleased", x, y)
        browser.call("Input.insertText", text="particle filte")
        browser.key("r", "r")
        browser.wait("document.querySelector('.md-search-result').innerText.includes('matching')")


def test_a_site_keeps_to_the_system_and_its_drawings_can_be_read(site: Path, browser: Browser) -> None:
    """It stayed light for good where the first visit was, and dark lines had a dark ground."""
    for scheme, kept in (("light", "default"), ("dark", "slate")):
        browser.call(
            "Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}]
        )
        browser.open(
            site / "index.html", "document.readyState === 'complete' && location.href.includes('site')"
        )
        browser.wait(f"document.body.dataset.mdColorScheme === '{kept}'")
    drawn = "getComputedStyle(document.querySelector('img[src$=\".svg\"]')).backgroundColor"
    assert browser.js(drawn) == "rgb(255, 255, 255)"
    browser.call("Emulation.setEmulatedMedia", features=[])


def test_no_link_is_dead_and_nothing_is_fetched(site: Path) -> None:
    pages = {path: Page(path) for path in site.rglob("*.html")}
    assert len(pages) > 60
    dead, fetched = [], []
    for path, page in pages.items():
        for target in (*page.links, *page.loaded):
            if target.startswith(("http:", "https:", "//")):
                continue
            name, _, anchor = target.partition("#")
            if target.startswith(("data:", "mailto:", "javascript:")) or (path.name == "404.html"):
                continue
            place = (path.parent / unquote(name)).resolve() if name else path
            there = place.is_file() and (
                not anchor or place not in pages or unquote(anchor) in pages[place].places
            )
            if not there and anchor != "__skip":
                dead.append(f"{path.relative_to(site)}: {target}")
        fetched += [f"{path.name}: {target}" for target in page.loaded if target.startswith(("http", "//"))]
    assert dead == []
    assert fetched == []


def test_every_page_is_in_it(site: Path, maker: ModuleType) -> None:
    for place in maker.pages().values():
        assert (site / place.with_suffix(".html")).is_file(), place
    for folder in ("gallery", "notebooks", "decisions", "api"):
        assert (site / folder / "index.html").is_file()


def test_the_gallery_shows_shipped_missions(maker: ModuleType) -> None:
    shipped = {path.stem for path in (DOCS.parent / "src/pilotage/missions/files").glob("*.yaml")}
    assert {name for name, _ in maker.GALLERY} <= shipped


@pytest.mark.parametrize("path", sorted((DOCS / "notebooks").glob("*.ipynb")), ids=lambda path: path.stem)
def test_notebooks_are_stored_without_outputs(path: Path) -> None:
    """They are executed by ``make docs``; here they are looked at."""
    book = json.loads(path.read_text(encoding="utf-8"))
    assert "".join(book["cells"][0]["source"]).startswith("# ")
    for cell in book["cells"]:
        if cell["cell_type"] == "code":
            assert (cell["outputs"], cell["execution_count"]) == ([], None)
            ast.parse("".join(cell["source"]))


@pytest.mark.parametrize("path", sorted((DOCS / "notebooks").glob("*.ipynb")), ids=lambda path: path.stem)
def test_notebooks_words_are_read_without_a_typesetter(path: Path) -> None:
    """The site loads none: of a formula in dollars its source is seen."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    words = "".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    assert "$" not in words


def test_every_setting_of_the_notebook_that_compares_filters_has_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Filters that believe their beacons ten times too much notice soon: half of its figure was empty."""
    book = json.loads((DOCS / "notebooks" / "4-comparing-filters.ipynb").read_text(encoding="utf-8"))
    source = next("".join(cell["source"]) for cell in book["cells"] if cell["cell_type"] == "code")
    for of_eight, of_one in (("trials=8", "trials=1"), ("workers=2", "workers=1")):
        assert of_eight in source
        source = source.replace(of_eight, of_one)
    names: dict[str, Any] = {}
    monkeypatch.chdir(tmp_path)
    exec(source, names)
    for metric in ("position_rmse_m", "nees_mean"):
        assert np.isfinite(names["study"].rows.values[metric]).all()


def test_a_drawing_is_a_file_of_its_own(maker: ModuleType) -> None:
    """Browsers show nothing of one with a prefix without a name space, such as a shaded terrain's."""
    drawn = '<svg viewBox="0 0 1 1"><image xlink:href="data:image/png;base64,AA=="/><text>x</text></svg>'
    root = ElementTree.fromstring(maker.as_file(drawn))
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    assert [child.tag.rpartition("}")[2] for child in root] == ["style", "image", "text"]


def test_the_gallery_has_a_card_for_each_run(
    maker: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """That of the other tests is empty: ``make docs`` ended at the first run's picture."""
    monkeypatch.setattr(maker, "ROOT", tmp_path)
    page = maker._gallery(tmp_path, (("barn-course", 0),))
    assert '<a class="card" href="barn-course.html"><img loading="lazy" src="barn-course.svg"' in page
    assert ElementTree.parse(tmp_path / "barn-course.svg").getroot().tag.endswith("svg")
    assert (tmp_path / "barn-course.html").is_file()


def test_durations_are_told_as_one_says_them(maker: ModuleType) -> None:
    assert [maker.lasted(t) for t in (96.4, 594.0, 338150.0)] == ["96 s", "9.9 min", "93.9 h"]


def test_the_whole_public_face_is_in_a_notebook() -> None:
    shown = set()
    for path in (DOCS / "notebooks").glob("*.ipynb"):
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        for cell in (cell for cell in cells if cell["cell_type"] == "code"):
            for node in ast.walk(ast.parse("".join(cell["source"]))):
                if isinstance(node, ast.Attribute):
                    shown.add(node.attr)
    results = {"Mission", "Plan", "Run", "Simulation", "Study"}  # what calls return
    commands = {"WheelSpeeds"}  # taken as a Twist is
    members = {"success", "reason", "metrics", "trace", "folder", "report", "table", "to_arrow", "to_pandas"}
    parts = {"reset", "step", "truth", "path", "extract", "on_cells", "on_walls", "EkfLandmarks", "update"}
    wanted = {name for name in pl.__all__ if not name.startswith("_")} - results - commands
    assert (wanted | members | parts) - shown == set()


def test_there_are_five_notebooks() -> None:
    assert len(list((DOCS / "notebooks").glob("*.ipynb"))) == 5
