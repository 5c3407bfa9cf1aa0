"""Measures what README and docs claim, writes docs/claims.json, and puts its numbers into the pages.

    python docs/make_claims.py [NAME ...] [--workers N]     # measure all that is registered, or these
    python docs/make_claims.py --quote                      # only put the numbers into the pages
    python docs/make_claims.py --loose                      # numbers on the pages that nothing accounts for
    python docs/make_claims.py --given                      # into docs/given.json: only what nobody measured

docs/claims.yaml registers what is measured, a line each: a study, a mission over seeds (``sweep``), or a
command that writes values as JSON to the file in place of ``{json}``, or prints one JSON object of numbers,
or of rows with a ratio each. A page quotes a value by a comment right behind it, which no reader sees:

    94.5<!--= gale :: dead reckoning :: ellipse :: %1 -->

that is source, key (of a study: cell and metric), and how it is written: an optional field (``low``,
``high``, ``n``, ``largest``, ...; ``ci`` is value, low and high), a scale (``%`` hundreds, ``m`` thousands)
and the digits behind the point. ``--quote`` writes anew what stands before the comment. Every other number
of a page stands in docs/given.json: parameters, definitions, published values. What was measured is quoted or
not said.
"""

from __future__ import annotations

import argparse
import datetime
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).resolve().parents[1]
CLAIMS, REGISTRY, GIVEN = (ROOT / "docs" / name for name in ("claims.json", "claims.yaml", "given.json"))
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
"""Decision records are dated themselves and are not rewritten."""

QUOTE = re.compile(r"<!--= (?P<source>\S+) :: (?P<key>.+?) :: (?P<form>[\w %]+) -->")
FORM = re.compile(r"(?:(?P<field>\w+) )?(?P<scale>[%m]?)(?P<digits>\d)$")
SCALES = {"": 1.0, "%": 100.0, "m": 1000.0}
NUMBER = r"\d+(?:[ \u202f]\d{3})*(?:\.\d+)?"
SHOWN = re.compile(rf"[+\u2212-]?{NUMBER}(?: \([+\u2212-]?{NUMBER} to [+\u2212-]?{NUMBER}\))?$")
UNIT = r"(?: (?:%|mm|cm|km|m|s|ms|min|rad|deg|x|times|of \d+)(?![\w.]))?"
LOOSE = re.compile(rf"(?<![\w.#/])({NUMBER})({UNIT})(?![\w])")


class ClaimError(Exception):
    """What is wrong with a registration, a claim or a quote, in one line."""


def rendered(claims: Mapping[str, Any], source: str, key: str, form: str) -> str:
    """A value as a page shows it."""
    try:
        value = claims[source]["values"][key]
    except KeyError:
        raise ClaimError(
            f"'{source} :: {key}': no such claim; register its source in docs/claims.yaml"
        ) from None
    found = FORM.match(form)
    if found is None:
        raise ClaimError(f"'{source} :: {key} :: {form}': expected [FIELD] [%|m]DIGITS")
    scale, digits = SCALES[found["scale"]], int(found["digits"])

    def text(field: str) -> str:
        if value.get(field) is None:
            raise ClaimError(f"'{source} :: {key}': has no '{field}'")
        return f"{scale * value[field]:.{digits}f}".replace("-", "\u2212")

    if found["field"] == "ci":
        return f"{text('value')} ({text('low')} to {text('high')})"
    return text(found["field"] or "value")


def quotes(text: str) -> Iterator[tuple[re.Match[str], str]]:
    """Each quote of a page with the text that stands before it."""
    for found in QUOTE.finditer(text):
        shown = SHOWN.search(text[max(0, found.start() - 80) : found.start()])
        yield found, shown[0] if shown else ""


def quoted(text: str, claims: Mapping[str, Any]) -> str:
    """The page with what its quotes say now."""
    out, at = [], 0
    for found, shown in quotes(text):
        out += [
            text[at : found.start() - len(shown)],
            rendered(claims, *found.group("source", "key", "form")),
        ]
        at = found.start()
    return "".join([*out, text[at:]])


def loose(text: str) -> list[str]:
    """Numbers with their units that are no quotes, outside code, links' targets and words with digits."""
    for found, shown in reversed(list(quotes(text))):
        text = text[: found.start() - len(shown)] + text[found.end() :]
    for code in (r"```.*?```", r"(?m)^(?: {4}|\t).*$", r"`[^`]*`", r"<!--.*?-->", r"\]\([^)]*\)"):
        text = re.sub(code, " ", text, flags=re.DOTALL if "(?m)" not in code else 0)
    return [number + unit for number, unit in LOOSE.findall(text)]


def unaccounted(page: Path, given: Mapping[str, Any]) -> list[str]:
    """Numbers of a page that are neither quoted nor in docs/given.json."""
    return sorted(set(loose(page.read_text(encoding="utf-8"))) - set(given.get(page.name, ())))


def give() -> None:
    """Take unaccounted numbers into docs/given.json; what is gone from the pages goes."""
    found = {page.name: sorted(set(loose(page.read_text(encoding="utf-8")))) for page in PAGES}
    GIVEN.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def written(claims: Mapping[str, Any]) -> str:
    """docs/claims.json: a value a line, so that a diff shows what changed."""
    sources = []
    for name, claim in claims.items():
        said = [
            f" {json.dumps(key)}: {json.dumps(claim[key], ensure_ascii=False)}"
            for key in claim
            if key != "values"
        ]
        values = [
            f"  {json.dumps(key, ensure_ascii=False)}: {json.dumps(value)}"
            for key, value in claim["values"].items()
        ]
        lines = [*said, ' "values": {\n' + ",\n".join(values) + "\n }"]
        sources.append(json.dumps(name) + ": {\n" + ",\n".join(lines) + "\n}")
    return "{\n" + ",\n".join(sources) + "\n}\n"


def measure(name: str, entry: Mapping[str, Any], workers: int) -> dict[str, Any]:
    """Run what is registered and collect its values."""
    with tempfile.TemporaryDirectory() as folder:
        kind = next((word for word in ("study", "sweep") if word in entry), None)
        if kind is not None:
            trials = f" --trials {entry['trials']}" if "trials" in entry else ""
            command = f"pilotage {kind} {entry[kind]}{trials}"
            values, seeds, count = _studied(command.split()[1:], Path(folder), workers)
        else:
            command, found = entry["command"], Path(folder) / "values.json"
            words = command.replace("{json}", str(found)).split()
            if words[0] in ("python", "pilotage"):
                module = [] if words[0] == "python" else ["-m", "pilotage"]
                words = [sys.executable, *module, *words[1:]]
            done = subprocess.run(words, cwd=ROOT, check=False, stdout=subprocess.PIPE, text=True)
            if found.is_file():
                values = json.loads(found.read_text(encoding="utf-8"))
            elif done.stdout.strip().startswith("{"):
                values = _told(json.loads(done.stdout))
            else:
                raise ClaimError(f"{name}: '{command}' gave no values (exit code {done.returncode})")
            seeds = entry.get("seeds", "none")
            count = max((value.get("n", 1) for value in values.values()), default=0)
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    return {"date": today, "command": command, "seeds": seeds, "n": count, "values": values}


def _told(metrics: Mapping[str, Any], where: str = "") -> dict[str, Any]:
    """One run's numbers, with their intervals where ``KEY_low`` and ``KEY_high`` stand beside; or ratios."""
    if "rows" in metrics:
        rows = [row for row in metrics["rows"] if row["ratio"] is not None]
        return {
            ", ".join(row[key] for key in ("subject", "what", "peer") if key in row): _numbers(
                value=row["ratio"]
            )
            for row in rows
        }
    numbers = {k: v for k, v in metrics.items() if isinstance(v, int | float) and not isinstance(v, bool)}
    found = {}
    for key, value in numbers.items():
        stem = key.removesuffix("_mean")
        interval = {end: numbers[f"{stem}_{end}"] for end in ("low", "high") if f"{stem}_{end}" in numbers}
        found[f"{where}{key}"] = _numbers(value=value, **interval)
    for key, inner in metrics.items():
        if isinstance(inner, dict):
            found |= _told(inner, f"{where}{key} :: ")
    return found


def _studied(words: list[str], folder: Path, workers: int) -> tuple[dict[str, Any], str, int]:
    """Every cell and metric of a study, its success, why trials ended, and the changes from the baselines."""
    line = [sys.executable, "-m", "pilotage", *words, "--out", str(folder), "--no-report"]
    done = subprocess.run([*line, "--workers", str(workers)], cwd=folder, check=False)
    if done.returncode not in (0, 1):
        raise ClaimError(f"{' '.join(words)}: the study ended with exit code {done.returncode}")
    return collected(next(folder.rglob("trials.sqlite")).parent)


def collected(folder: Path) -> tuple[dict[str, Any], str, int]:
    """The values of a study's folder."""
    import numpy as np

    from pilotage.experiments.studies.table import read_study

    table = read_study(folder)
    judged, values = table.judged(), {}
    for cell in table.cells:
        rate = judged.rates[cell.index]
        own = np.flatnonzero(table.cell == cell.index)
        ended = [table.ended[i] for i in own]
        values[f"{cell.name} :: success"] = _numbers(
            value=rate.successes / max(rate.trials, 1),
            low=rate.low,
            high=rate.high,
            n=rate.trials,
            count=rate.successes,
        )
        for word in sorted(set(ended)):
            values[f"{cell.name} :: ended {word}"] = _numbers(value=ended.count(word), n=len(ended))
        for metric in (m for m in judged.summaries if m != "success"):
            s = judged.summaries[metric][cell.index]
            if s.n:
                values[f"{cell.name} :: {metric}"] = _numbers(
                    value=s.mean,
                    low=s.low,
                    high=s.high,
                    n=s.n,
                    median=s.median,
                    smallest=s.smallest,
                    largest=s.largest,
                )
            change = judged.differences[metric][cell.index]
            if change is not None:
                values[f"{cell.name} :: {metric} change"] = _numbers(
                    value=change.mean, low=change.low, high=change.high, n=change.n, p=change.p_corrected
                )
    for group in table.groups if len(table.groups) > 1 else ():
        for metric in table.metrics:
            column = table.column(metric)[np.isin(table.cell, group.cells)]
            column = column[np.isfinite(column)]
            if column.size:
                values[f"{group.name} :: {metric}"] = _numbers(
                    value=column.mean(), n=column.size, smallest=column.min(), largest=column.max()
                )
    for (first, other), found in judged.contrasts.items():
        for cell, change in zip(table.cells, found, strict=True):
            if change.n:
                values[f"{cell.name} :: {first} less {other}"] = _numbers(
                    value=change.mean, low=change.low, high=change.high, n=change.n, p=change.p_corrected
                )
    seeds = table.study.definition.seeds.first
    last = seeds + table.study.definition.trials - 1
    return values, f"{seeds} to {last}", table.study.definition.trials


def _numbers(**values: float) -> dict[str, float | None]:
    """Six significant digits; what is not finite is null."""
    return {k: float(f"{v:.6g}") if v == v and abs(v) != float("inf") else None for k, v in values.items()}


def main() -> int:
    """Measure, quote, list."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--quote", action="store_true")
    parser.add_argument("--loose", action="store_true")
    parser.add_argument("--given", action="store_true")
    options = parser.parse_args()
    registry = yaml.safe_load(REGISTRY.read_text(encoding="utf-8"))
    claims = json.loads(CLAIMS.read_text(encoding="utf-8")) if CLAIMS.is_file() else {}
    try:
        if options.given:
            give()
            return 0
        if options.loose:
            given = json.loads(GIVEN.read_text(encoding="utf-8"))
            for page in PAGES:
                sys.stdout.write(f"{page.name}: {unaccounted(page, given)}\n")
            return 0
        for name in options.names or ([] if options.quote else registry):
            if name not in registry:
                raise ClaimError(f"'{name}' is not registered in docs/claims.yaml: {', '.join(registry)}")
            claims[name] = measure(name, registry[name], options.workers)
            CLAIMS.write_text(written({key: claims[key] for key in registry if key in claims}), "utf-8")
        for page in PAGES:
            page.write_text(quoted(page.read_text(encoding="utf-8"), claims), encoding="utf-8")
    except ClaimError as error:
        sys.stderr.write(f"make claims: {error}\n")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
