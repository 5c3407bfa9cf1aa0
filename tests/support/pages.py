"""What every page must be: whole, well formed, and asking for nothing outside of itself."""

from __future__ import annotations

import base64
import hashlib
import re
from html.parser import HTMLParser
from pathlib import Path

from pilotage.report import write_report

FIGURES = (
    "map",
    "plan-picture",
    "close-ups",
    "timeline",
    "pose-error",
    "covariance",
    "consistency",
    "control",
    "ultrasonic",
    "clearance",
)


def page_of(run_dir: Path, figures: tuple[str, ...] = ()) -> str:
    """Write the report and return its text, checked for what every page must be."""
    page = write_report(run_dir).read_text(encoding="utf-8")
    assert len(page) < 3_000_000
    check_self_contained(page)
    for slug in figures:
        assert f'<section id="{slug}">' in page
    return page


def check_self_contained(page: str) -> None:
    """Nothing on the page may ask for anything outside of it."""
    for reference in re.findall(r"(?:href|src|srcset|data|action)\s*=\s*[\"']([^\"']*)", page):
        # The picture of a grid is in the page itself.
        assert reference.startswith(("#", "data:image/png;base64,")), reference
    for target in re.findall(r"url\(([^)]*)\)", page):
        assert target.startswith("#"), target
    assert "@import" not in page
    # Data that nothing runs (a replay's scene), and scripts that the policy's hashes let run, no others.
    kinds = set(re.findall(r"<script[^>]*>", page))
    data = {f'<script type="text/plain" id="{name}">' for name in ("replay-scene", "closure-book")}
    assert kinds <= data | {"<script>"}
    digests = [
        base64.b64encode(hashlib.sha256(body.encode()).digest()).decode()
        for body in re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    ]
    policy = re.search(r"script-src ([^\"]*)\">", page)
    assert policy
    if digests:
        assert policy[1].split() == [f"'sha256-{digest}'" for digest in digests]
    assert not re.search(r"<(?:link|img|iframe|object|embed|base|form)\b", page)
    assert set(re.findall(r"https?://[^\"' <]*", page)) <= {
        "http://www.w3.org/2000/svg",
        "http://www.w3.org/1999/xlink",
    }


class Outline(HTMLParser):
    """Collects identifiers and in-page targets, and sees to it that tags are closed."""

    VOID = frozenset({"meta", "br", "hr", "input", "link", "img"})

    def __init__(self, page: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.targets: list[str] = []
        self.open: list[str] = []
        self.words: list[str] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        names = [name for name, _ in attrs]
        assert len(names) == len(set(names)), f"an attribute twice in <{tag}>: {names}"
        for name, value in attrs:
            if name == "id":
                self.ids.append(str(value))
            elif name in {"href", "xlink:href"} and str(value).startswith("data:image/png;base64,"):
                continue
            elif name == "href":
                self.targets.append(str(value).removeprefix("#"))
            elif name in {"clip-path", "fill"} and str(value).startswith("url(#"):
                self.targets.append(str(value)[5:-1])
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)
