"""Markup in every name and path that a page shows does nothing in a real browser."""

from __future__ import annotations

import shutil
from importlib import resources
from pathlib import Path

import pytest
import yaml

from pilotage.report import write_report
from support.browser import Browser
from support.fabricated_run import fabricate_metrics, fabricate_run
from support.fuzz_targets import BY_NAME, QUICK, Target
from support.outcome import run

IN_TEXT = "<script>alert(1)</script>"
IN_PATH = "\"'><svg onload=alert(2)><img src=x onerror=alert(3)>"
ONLY_ITS_OWN = """
[...document.querySelectorAll("script")].every((s) => s.id === "replay-scene" || s.text.length > 1000)
"""


def written(name: str, folder: Path) -> Target:
    target = BY_NAME[name]
    target.write(folder)
    return target


def of_a_run(folder: Path) -> tuple[str, ...]:
    written("run floor", folder)
    (folder / "walls.yaml").rename(folder / f"{IN_PATH}.yaml")
    mission = yaml.safe_load((folder / "mission.yaml").read_text())
    mission["mission"] = mission["description"] = IN_TEXT
    mission["world"]["map"] = f"{IN_PATH}.yaml"
    mission["robot"]["sensors"][IN_TEXT] = {"name": "ultrasonic"}
    (folder / "mission.yaml").write_text(yaml.safe_dump(mission))
    words = [word for word in QUICK if word != "--no-report"]
    return ("run", "mission.yaml", *words)


def of_a_study(folder: Path) -> tuple[str, ...]:
    study = {
        "study": "inert",
        "question": IN_TEXT,
        "description": IN_TEXT,
        "mission": "museum-plan",
        "trials": 2,
        "set": {"stack.planner.iterations": 100},
        "configurations": [
            {"name": IN_TEXT, "set": {}},
            {"name": IN_PATH, "set": {"stack.planner.turning_radius_m": 0.5}},
        ],
    }
    (folder / "study.yaml").write_text(yaml.safe_dump(study))
    return ("study", "study.yaml", "--workers", "1", "--quiet")


def of_a_calibration(folder: Path) -> tuple[str, ...]:
    written("calibrate odometry", folder)
    (folder / "odometry.csv").rename(folder / f"{IN_PATH}.csv")
    return ("calibrate", "odometry", f"{IN_PATH}.csv", "--out", "out")


def of_a_map(folder: Path) -> tuple[str, ...]:
    written("slam carmen", folder)
    (folder / "lab.log").rename(folder / f"{IN_PATH}.log")
    return ("slam", f"{IN_PATH}.log", "--out", "out", "--quiet")


def of_courses(folder: Path) -> tuple[str, ...]:
    words = written("bench controllers map", folder).words
    (folder / "walls.yaml").rename(folder / f"{IN_PATH}.yaml")
    words = tuple(word.replace("walls.yaml", f"{IN_PATH}.yaml") for word in words)
    return tuple("1" if k and words[k - 1] == "--replays" else word for k, word in enumerate(words))


def of_published_courses(folder: Path) -> tuple[str, ...]:
    words = written("bench barn", folder).words
    rows = "world,succeeded,collided,timed_out,time_s\n0,1,0,0,9.0\n"
    (folder / f"published_{IN_PATH}.csv").write_text(rows)
    return words


def of_a_patrol(folder: Path) -> tuple[str, ...]:
    written("run crowd", folder)
    (folder / "rounds.graph").rename(folder / f"{IN_PATH}.graph")
    mission = yaml.safe_load((folder / "mission.yaml").read_text())
    mission["mission"] = mission["description"] = IN_TEXT
    mission["task"]["graph"] = f"{IN_PATH}.graph"
    mission["robots"], mission["team"]["size"] = [{"name": IN_TEXT}, {"name": IN_PATH}], 2
    (folder / "mission.yaml").write_text(yaml.safe_dump(mission))
    return ("run", "mission.yaml", *(word for word in QUICK if word != "--no-report"))


def of_an_attribution(folder: Path) -> tuple[str, ...]:
    written("run floor", folder)
    mission = yaml.safe_load((folder / "mission.yaml").read_text())
    mission["mission"] = mission["description"] = IN_TEXT
    (folder / f"{IN_PATH}.yaml").write_text(yaml.safe_dump(mission))
    short = ("--set", "run.time_limit_s=0.5", "--set", "run.dt_s=0.1", "--set", "run.settle_s=0.1")
    return ("attribute", f"{IN_PATH}.yaml", "--trials", "2", "--workers", "1", "--quiet", *short)


def of_a_comparison(folder: Path) -> tuple[str, ...]:
    """Levels, groups and published values of a study, each with markup in its name."""
    radii = {IN_TEXT: 0.3, IN_PATH: 0.5}
    levels = {name: {"stack.planner.turning_radius_m": radius} for name, radius in radii.items()}
    study = {
        "study": "compared",
        "mission": "museum-plan",
        "trials": 2,
        "set": {"stack.planner.iterations": 300},
        "factors": [{"name": IN_TEXT, "levels": levels}],
        "metrics": ["planned_length_m", "smoothness"],
        "groups": [{"name": IN_PATH, "cells": [IN_TEXT, IN_PATH], "baseline": IN_TEXT}],
        "published": [{"cell": IN_PATH, "metrics": {"planned_length_m": 20.0}}],
        "reference": {"planned_length_m": {"value": 10.0, "name": IN_TEXT}},
    }
    (folder / "study.yaml").write_text(yaml.safe_dump(study))
    return ("study", "study.yaml", "--workers", "1", "--quiet")


def of_a_localization(folder: Path) -> tuple[str, ...]:
    words = written("localize bag", folder).words
    (folder / "a.bag").rename(folder / f"{IN_PATH}.bag")
    return tuple(f"{IN_PATH}.bag" if word == "a.bag" else word for word in words if word != "--no-report")


@pytest.fixture(scope="module")
def browser(browser: Browser) -> Browser:
    """In it, scripts that run are counted."""
    source = "window.struck = 0; window.alert = () => { window.struck += 1; };"
    browser.call("Page.addScriptToEvaluateOnNewDocument", source=source)
    return browser


@pytest.mark.parametrize(
    "make",
    [
        *(of_a_run, of_a_patrol, of_a_study, of_a_comparison, of_an_attribution, of_a_calibration),
        *(of_a_map, of_a_localization, of_courses, of_published_courses),
    ],
)
def test_markup_in_names_and_paths_is_text(make: object, browser: Browser, tmp_path: Path) -> None:
    assert callable(make)
    folder = tmp_path / IN_PATH
    folder.mkdir()
    outcome = run(make(folder), folder)
    assert outcome.code in (0, 1), outcome.err
    pages = list(folder.rglob("report.html"))
    # They show the names at all.
    assert any("alert(" in page.read_text(encoding="utf-8") for page in pages)
    for k, page in enumerate(pages):
        # Under a plain name: a browser's own address is no concern of the page.
        opened = shutil.copyfile(page, tmp_path / f"{k}.html")
        begin = len(browser.events)
        browser.open(opened, f"document.readyState === 'complete' && location.href.endsWith('{k}.html')")
        assert browser.js("new Promise((done) => setTimeout(() => done(window.struck), 100))") == 0
        assert browser.js("document.querySelectorAll('[onload], [onerror], img[src=x]').length") == 0
        assert browser.js(ONLY_ITS_OWN)
        asked = [
            event["params"]["request"]["url"]
            for event in browser.events[begin:]
            if event.get("method") == "Network.requestWillBeSent"
        ]
        assert [url for url in asked if not url.startswith(("data:", "blob:"))] == [opened.as_uri()]


def test_a_name_without_an_end_makes_no_page_wider_than_a_telephone(browser: Browser, tmp_path: Path) -> None:
    """Rows of the table of metrics are named by what a run's folder holds; the page was 37,000 px wide."""
    folder = fabricate_run(tmp_path / "run", metrics=fabricate_metrics(600) | {"w" * 3000: 1.0})
    page = write_report(folder)
    for width in (1200, 390):
        browser.size(width, 800)
        browser.open(page, "document.readyState === 'complete'")
        assert browser.js("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize(
    "within",
    [
        "<h2><a href=#x>{}</a></h2>",
        "<nav><ol><li><a href=#x>{}</a></li></ol></nav>",
        "<figure><ul class=legend><li><label><input type=checkbox>{}</label></li></ul></figure>",
        "<figure><figcaption>{}</figcaption></figure>",
        "<h3>{}</h3><p>{}</p>",
    ],
)
def test_words_without_an_end_are_broken_wherever_they_stand(
    within: str, browser: Browser, tmp_path: Path
) -> None:
    """A robot's name in a legend and a factor's in a study's contents made pages of 100,000 px."""
    css = resources.files("pilotage.report").joinpath("page.css").read_text(encoding="utf-8")
    body = within.replace("{}", "w" * 3000)
    page = tmp_path / "page.html"
    page.write_text(f"<!DOCTYPE html><style>{css}</style><body><main>{body}</main></body>")
    for width in (1200, 390):
        browser.size(width, 800)
        browser.open(page, "document.readyState === 'complete'")
        assert browser.js("document.documentElement.scrollWidth") <= width


def test_the_browser_would_be_struck(browser: Browser, tmp_path: Path) -> None:
    """The check above can fail."""
    page = tmp_path / "struck.html"
    page.write_text(f"<!DOCTYPE html><title>x</title><p>{IN_TEXT}{IN_PATH}</p>")
    browser.open(page, "document.readyState === 'complete' && location.href.endsWith('struck.html')")
    assert browser.js("new Promise((done) => setTimeout(() => done(window.struck), 300))") >= 2
