"""Builds the documentation site into ``build/site``: pages, reference, executed notebooks, gallery.

``python docs/make_site.py [--quick | --notebooks]``; quick leaves notebooks unexecuted and the gallery empty,
which is what the test of the links does; notebooks executes these and builds nothing, which is what CI does.
"""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
GALLERY = (
    ("museum-1", 0),
    ("museum-concave", 3),
    ("museum-rounds", 0),
    ("museum-hall", 1),
    ("museum-walls", 0),
    ("museum-kidnap", 0),
    ("museum-lost", 0),
    ("car-park", 0),
    ("barn-course", 0),
    ("romi-explore", 0),
    ("gale-pose", 0),
    ("gale-astar-ekf", 0),
)
"""Missions of the gallery, and the seed of the replay that is shown."""


def pages() -> dict[Path, Path]:
    """Where each page of the repository stands in the site."""
    found = {ROOT / "README.md": Path("index.md")}
    for name in ("CONTRIBUTING.md", "CHANGELOG.md"):
        found[ROOT / name] = Path(name)
    for path in sorted(DOCS.rglob("*.md")):
        place = path.relative_to(DOCS)
        found[path] = place.with_name("index.md") if place.name == "README.md" else place
    return found


def build(folder: Path, *, quick: bool = False) -> Path:
    """Write the site's pages below ``folder`` and build them; return the site's own folder."""
    source, site = folder / "site-pages", folder / "site"
    for old in (source, site):
        shutil.rmtree(old, ignore_errors=True)
    places = pages()
    for page, place in places.items():
        _write(source / place, rewritten(page, places))
    for picture in (DOCS / "images").iterdir():
        _copy(picture, source / "images" / picture.name)
    for beside in ("site.css", "narrow.css", "search-from-files.js"):
        _copy(DOCS / beside, source / beside)
    _write(source / "decisions" / "index.md", _decisions())
    _write(source / "notebooks" / "index.md", _notebooks(source / "notebooks", quick=quick))
    _write(source / "gallery" / "index.md", _gallery(source / "gallery", () if quick else GALLERY))
    config = folder / "mkdocs.yml"
    settings = (DOCS / "mkdocs.yml").read_text(encoding="utf-8")
    _write(config, settings.replace("../build/", ""))
    command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--config-file", str(config)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(done.stdout + done.stderr)
    # A page that is opened from its file may load a script, and no other file.
    index = site / "search" / "search_index.json"
    _write(index.with_suffix(".js"), f"var __index = {index.read_text(encoding='utf-8')}")
    return site


def rewritten(page: Path, places: dict[Path, Path]) -> str:
    """A page's text with its links as they are in the site; a link to what is no page becomes its words."""
    here = places[page].parent

    def moved(match: re.Match[str]) -> str:
        mark, words, target = match.groups()
        if "://" in target or target.startswith("#"):
            return match.group(0)
        name, _, anchor = target.partition("#")
        path = (page.parent / name).resolve()
        path = path / "README.md" if (path / "README.md") in places else path
        if path == DOCS / "decisions":
            place = Path("decisions/index.md")
        elif path in places:
            place = places[path]
        elif path.is_relative_to(DOCS / "images") and path.is_file():
            place = path.relative_to(DOCS)
        else:
            return words
        steps = Path(*[".."] * len(here.parts)) / place
        return f"{mark}[{words}]({steps.as_posix()}{'#' + anchor if anchor else ''})"

    parts = re.split(r"(^```.*?^```$)", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    # In a table's code forges want the bar escaped, and Python-Markdown does not.
    bare = [part if part.startswith("```") else LINK.sub(moved, part) for part in parts]
    return "".join(
        part
        if part.startswith("```")
        else re.sub(r"`[^`\n]*`", lambda code: code[0].replace("\\|", "|"), part)
        for part in bare
    )


def _decisions() -> str:
    lines = ["# Decisions", "", "Why things are as they are.", ""]
    for path in sorted((DOCS / "decisions").glob("*.md")):
        title = path.read_text(encoding="utf-8").split("\n", 1)[0].removeprefix("# ")
        lines.append(f"- [{title}]({path.name})")
    return "\n".join(lines) + "\n"


def _notebooks(folder: Path, *, quick: bool) -> str:
    """Write every notebook as a page with its outputs, and return the page that lists them."""
    lines = ["# Notebooks", "", "Executed as they stand when this site was built.", ""]
    for path in sorted((DOCS / "notebooks").glob("*.ipynb")):
        book = json.loads(path.read_text(encoding="utf-8"))
        if not quick:
            book = executed(path)
        _copy(path, folder / path.name)
        _write(folder / f"{path.stem}.md", "\n".join(_cells(book, path.name)))
        title = "".join(book["cells"][0]["source"]).split("\n", 1)[0].removeprefix("# ")
        lines.append(f"- [{title}]({path.stem}.md)")
    return "\n".join(lines) + "\n"


def executed(path: Path) -> Any:
    """A notebook with the outputs of its cells; an error in one of them ends the program."""
    import nbformat
    from nbclient import NotebookClient

    book = nbformat.read(path, as_version=4)
    folder = ROOT / "build" / "notebooks" / path.stem
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    resources = {"metadata": {"path": str(folder)}}
    NotebookClient(book, timeout=1200, kernel_name="python3", resources=resources).execute()
    return book


def _cells(book: Any, name: str) -> Iterator[str]:
    for number, cell in enumerate(book["cells"]):
        text = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            yield text + "\n"
            if number == 0:
                yield f"[The notebook itself]({name})\n"
            continue
        yield f"```python\n{text}\n```\n"
        for output in cell.get("outputs", ()):
            yield from _output(output)


def _output(output: Any) -> Iterator[str]:
    data = output.get("data", {})
    if "text/html" in data:
        # One block without blank lines: Markdown would take what follows one for its own.
        body = re.sub(r"\n\s*\n", "\n", "".join(data["text/html"]))
        # A data frame's own style is for notebooks; the site has one for all tables.
        body = re.sub(r"<style scoped>.*?</style>", "", body, flags=re.DOTALL)
        body = body.replace(' border="1" class="dataframe"', "")
        if body:
            yield f'<div class="output">{body}</div>\n'
    elif "image/png" in data:
        yield f'<img alt="figure" src="data:image/png;base64,{"".join(data["image/png"]).strip()}">\n'
    elif "text/plain" in data or (output.get("name") == "stdout"):
        text = "".join(data.get("text/plain", output.get("text", "")))
        yield f"```text\n{text.rstrip()}\n```\n"


def _gallery(folder: Path, missions: tuple[tuple[str, int], ...]) -> str:
    """Run the missions, keep their pages, and return the page of cards."""
    import pilotage as pl

    cards = []
    for name, seed in missions:
        run = pl.run(name, seed=seed, out=ROOT / "build" / "gallery", progress=False)
        place = f"{name}.html"
        folder.mkdir(parents=True, exist_ok=True)
        run.report(folder / place)
        _write(folder / f"{name}.svg", picture(run.folder))
        word = "success" if run.success else html.escape(run.reason)
        told = html.escape(run.mission.description)
        cards.append(
            f'<a class="card" href="{place}"><img loading="lazy" src="{name}.svg" alt="{told}">'
            f"<p><b>{name}</b>, seed {seed}: {told}. {word}, {lasted(run.metrics['duration_s'])}.</p></a>"
        )
    text = "Every card is the page of a real run, with its replay; it needs no network.\n"
    head = "---\nhide: [toc, navigation]\n---\n\n# Gallery\n"
    return f'{head}\n{text}\n<div class="gallery">{"".join(cards)}</div>\n'


def lasted(duration_s: float) -> str:
    """A duration as one says it: "96 s", "9.9 min", "93.9 h"."""
    for unit, seconds in (("h", 3600.0), ("min", 60.0)):
        if duration_s >= 2.0 * seconds:
            return f"{duration_s / seconds:.1f} {unit}"
    return f"{duration_s:.0f} s"


def picture(folder: Path) -> str:
    """A run's map as a file of its own."""
    from pilotage.report.drawn import picture_of

    return as_file(picture_of(folder).svg)


def as_file(drawn: str) -> str:
    """A drawing with what its page gives it elsewhere: name spaces, and the style of narrow ones."""
    spaces = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    style = (DOCS / "narrow.css").read_text(encoding="utf-8")
    return drawn.replace("<svg ", f"<svg {spaces} ", 1).replace(">", f"><style>{style}</style>", 1)


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def _copy(source: Path, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, path)


def run_notebooks() -> None:
    """Execute all of them, and say how long each took."""
    for path in sorted((DOCS / "notebooks").glob("*.ipynb")):
        begin = time.perf_counter()
        executed(path)
        sys.stdout.write(f"{path.name}: {time.perf_counter() - begin:.0f} s\n")
        sys.stdout.flush()


if __name__ == "__main__":
    if "--notebooks" in sys.argv[1:]:
        run_notebooks()
        sys.exit()
    built = build(ROOT / "build", quick="--quick" in sys.argv[1:])
    sys.stdout.write(f"{built / 'index.html'}\n")
