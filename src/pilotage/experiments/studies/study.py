"""A study made ready: its mission read, every cell validated, and a digest of all that decides its rows."""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import yaml

from pilotage.core.config import validate
from pilotage.core.errors import InputError, unknown_name
from pilotage.core.file_kinds import check_kind
from pilotage.core.files import decoded, read_bytes
from pilotage.core.plugins import PluginError, is_package
from pilotage.experiments.mission import mission_of, read_mission, shipped_missions
from pilotage.experiments.named_files import anchored
from pilotage.experiments.oracles.applicable import check_oracles
from pilotage.experiments.resolve import resolved_values
from pilotage.experiments.studies.cells import Cell, make_cells
from pilotage.experiments.studies.definition import StudyDefinition
from pilotage.experiments.studies.files import digests
from pilotage.experiments.studies.groups import cell_groups
from pilotage.experiments.studies.labels import labelled
from pilotage.experiments.values import parse_yaml
from pilotage.missions.mission import Mission
from pilotage.records.folder import STUDY_FILE, is_study_folder

SHIPPED = resources.files("pilotage.missions") / "studies"
MISSION_FILE = "mission.yaml"
PRESENTATION = (
    "question",
    "description",
    "metrics",
    "primary",
    "lower_is_better",
    "baseline",
    "groups",
    "contrasts",
    "published",
    "reference",
)
"""What a definition says about its page only: it may change without touching a row."""
MAX_ROWS = 1_000_000
MAX_BYTES = 2_000_000
"""A longer definition takes longer to read than its study could run."""


@dataclass(frozen=True, slots=True)
class Study:
    """A definition with its mission and its cells.

    Attributes
    ----------
    base
        The mission's values before any cell's overrides.
    files
        By path, digests of the files that mission and cells name, such as a map.
    """

    definition: StudyDefinition
    base: Mapping[str, Any]
    cells: tuple[Cell, ...]
    files: Mapping[str, str]

    @property
    def name(self) -> str:
        """The study's name, and its folder's."""
        return self.definition.study

    @property
    def rows(self) -> int:
        """How many trials there are in all cells together."""
        return len(self.cells) * self.definition.trials

    def place(self, row: int) -> tuple[int, int]:
        """Cell and trial of a row: the first trial of every cell, then the second, and so on."""
        trial, cell = divmod(row, len(self.cells))
        return cell, trial

    def seed(self, row: int) -> int:
        """The seed of a row's run."""
        seeds = self.definition.seeds
        return seeds.first + (self.place(row)[1] if seeds.pairing == "shared" else row)

    def essence(self) -> dict[str, Any]:
        """All that decides the rows, as plain values."""
        definition = self.definition.model_dump(mode="json", exclude={*PRESENTATION, "study", "mission"})
        for configuration in definition["configurations"]:
            del configuration["values"]
        return {**definition, "mission": dict(self.base), "files": dict(self.files)}

    @property
    def digest(self) -> str:
        """A digest of ``essence``."""
        text = json.dumps(self.essence(), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def shipped_studies() -> list[str]:
    """Names of the studies that come with pilotage."""
    if not SHIPPED.is_dir():
        return []
    return sorted(
        entry.name.removesuffix(".yaml") for entry in SHIPPED.iterdir() if entry.name.endswith(".yaml")
    )


def load_study(
    name_or_path: str, changes: Mapping[str, Any] | None = None, *, recorded: bool = False
) -> Study:
    """Read a study by its shipped name, its file or its folder, and make it ready.

    Parameters
    ----------
    changes
        Laid over the file's top keys, such as ``trials``.
    recorded
        As ``make_study`` takes it.

    Raises
    ------
    PluginError
        For a plugin that is not there or does not load.
    InputError
        One line: what was expected, what was found, the nearest right name.
    """
    path = Path(name_or_path)
    if is_study_folder(name_or_path):
        path = path / STUDY_FILE
        name_or_path = str(path)
    elif path.is_dir() and name_or_path not in shipped_studies():
        raise InputError(f"'{name_or_path}': expected a study's folder, found no {STUDY_FILE} in it")
    folder = Path()
    if path.suffix in {".yaml", ".yml"} or "/" in name_or_path:
        text = decoded(read_bytes(path, "a study's YAML file or folder", MAX_BYTES), str(path))
        values, folder = parse_yaml(text, str(path)), path.parent
    elif name_or_path in shipped_studies():
        values = parse_yaml((SHIPPED / f"{name_or_path}.yaml").read_text(encoding="utf-8"), name_or_path)
    else:
        raise unknown_name("study", name_or_path, shipped_studies())
    check_kind(values, "study", name_or_path)
    try:
        of_a_mission = Mission.model_fields.keys() - StudyDefinition.model_fields.keys()
        for key in sorted(of_a_mission & values.keys()):
            raise InputError(f"{key}: unknown key; a mission has it: put it there, or under 'set'")
        definition = validate(StudyDefinition, {**values, **(changes or {})}, "")
        return make_study(definition, folder, recorded=recorded)
    except InputError as error:
        kind = PluginError if isinstance(error, PluginError) else InputError
        raise kind(f"study '{name_or_path}': {error}") from None


def make_study(
    definition: StudyDefinition,
    folder: Path = Path(),
    values: Mapping[str, Any] | None = None,
    *,
    recorded: bool = False,
) -> Study:
    """Read the mission and validate every cell of a study.

    Parameters
    ----------
    folder
        Where a mission's file is looked for.
    values
        The mission itself, where it is in no file.
    recorded
        Whether its rows are only read: cells were looked at when they ran, and plugins are not loaded.

    Raises
    ------
    InputError
        One line, with the cell's name where only that cell is wrong.
    """
    named = definition.mission
    if named not in shipped_missions() and not Path(named).is_absolute() and (folder / named).is_file():
        named = str(folder / named)
    places = (folder, Path())
    base = anchored(read_mission(named) if values is None else dict(values), places)
    definition = _at_their_places(definition, places)

    def resolve(overrides: Sequence[str]) -> Mapping[str, Any] | None:
        if recorded:
            return None
        mission = mission_of(base, overrides)
        check_oracles(mission)
        return resolved_values(mission)

    cells = make_cells(definition, resolve)
    if len(cells) * definition.trials > MAX_ROWS:
        raise InputError(f"expected at most {MAX_ROWS} rows, found {len(cells)} cells of {definition.trials}")
    plugins: dict[str, None] = {}
    for cell in cells:
        try:
            plugins |= dict.fromkeys((resolve(cell.overrides) or {}).get("plugins", ()))
        except InputError as error:
            raise InputError(f"cell '{cell.name}': {error}") from None
    # Those of the command line too, and where they lie now: the study's folder runs again without it.
    if plugins:
        base = {**base, "plugins": list(plugins)}
    names = [cell.name for cell in cells]
    if definition.baseline is not None and definition.baseline not in names:
        raise unknown_name("baseline", definition.baseline, names)
    cells = labelled(definition, cells, cell_groups(definition, cells))
    named_in_cells = [json.loads(text.partition("=")[2]) for cell in cells for text in cell.overrides]
    return Study(definition, base, cells, digests([base, named_in_cells]))


def _at_their_places(definition: StudyDefinition, places: Sequence[Path]) -> StudyDefinition:
    """The definition with the files that it sets as absolute paths, so that its folder runs anywhere."""
    values = definition.model_dump(mode="json")
    varied = {key: anchored(values[key], places) for key in ("set", "configurations", "factors")}
    moved = dict(_moved(values["factors"], varied["factors"]))
    made = validate(StudyDefinition, {**values, **varied}, "")
    # Cells are named by their values, of files by the ends of their paths: what names cells is told alike.
    names = {path: name for factor in made.factors for path, name in factor.names.items()}
    names |= {before: names[after] for before, after in moved.items()}
    told = {key: _told(values[key], moved, names) for key in ("baseline", "groups", "published")}
    return validate(StudyDefinition, {**values, **varied, **told}, "")


def _moved(before: Any, after: Any) -> Iterator[tuple[str, str]]:
    """The texts that differ between two trees of the same shape."""
    if isinstance(before, Mapping):
        for key in before:
            yield from _moved(before[key], after[key])
    elif isinstance(before, list):
        for one, other in zip(before, after, strict=True):
            yield from _moved(one, other)
    elif isinstance(before, str) and before != after:
        yield before, after


def _told(value: Any, moved: Mapping[str, str], names: Mapping[str, str]) -> Any:
    """Values of cells as they are now; what names cells, ``map=a.yaml, gate=0.9``, with the files' names."""
    if isinstance(value, Mapping):
        return {_told(key, moved, names): _told(inner, moved, names) for key, inner in value.items()}
    if isinstance(value, list):
        return [_told(inner, moved, names) for inner in value]
    if not isinstance(value, str):
        return value
    if value in moved:
        return moved[value]
    for file, name in names.items():
        value = re.sub(f"(?<==){re.escape(file)}(?=, |$)", name.replace("\\", r"\\"), value)
    return value


def study_yaml(study: Study) -> str:
    """The definition in full; with ``mission.yaml`` beside it, it runs again from its folder alone."""
    # None is a value among the overrides: a module that is left out.
    values = study.definition.model_dump(mode="json")
    text = yaml.safe_dump({**values, "mission": MISSION_FILE}, sort_keys=False, allow_unicode=True)
    return f"# mission: {study.definition.mission}; digest: {study.digest}\n{text}"


def mission_yaml(study: Study) -> str:
    """The mission before any cell's overrides."""
    return yaml.safe_dump(dict(study.base), sort_keys=False, allow_unicode=True)


def is_made_from(study: Study, essence: Mapping[str, Any]) -> bool:
    """Whether an essence that was recorded is the study's."""
    return not differences(essence, json.loads(json.dumps(study.essence())))


def changes_told(old: Mapping[str, Any], study: Study) -> str:
    """What changed from an essence to a study's, ``key: old -> new``; the first three and how many more."""
    changed = differences(old, json.loads(json.dumps(study.essence())))
    more = f" and {len(changed) - 3} more" if len(changed) > 3 else ""
    return "; ".join(changed[:3]) + more or "of another version"


def differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """What changed between two essences, ``key: old -> new`` each; a plugin may have been moved."""
    before, after = _flat(_by_names(old)), _flat(_by_names(new))
    return [
        f"{key}: {_short(before.get(key, 'nothing'))} -> {_short(after.get(key, 'nothing'))}"
        for key in [*before, *(key for key in after if key not in before)]
        if before.get(key, _Missing) != after.get(key, _Missing)
    ]


def _by_names(essence: Mapping[str, Any]) -> Mapping[str, Any]:
    """An essence with its plugin files by their names: the same file elsewhere gives the same rows."""
    mission, files = essence.get("mission"), essence.get("files")
    plugins = mission.get("plugins") if isinstance(mission, Mapping) else None
    if not isinstance(mission, Mapping) or not isinstance(files, Mapping) or not isinstance(plugins, list):
        return essence
    if not all(isinstance(name, str) for name in plugins):
        return essence
    paths = dict.fromkeys(str(Path(name).resolve()) for name in plugins if not is_package(name))
    count = Counter(Path(path).name for path in paths)
    named = {path: Path(path).name for path in paths if count[Path(path).name] == 1}
    return {
        **essence,
        "mission": {
            **mission,
            "plugins": sorted({named.get(str(Path(name).resolve()), name) for name in plugins}),
        },
        "files": {named.get(path, path): digest for path, digest in files.items()},
    }


class _Missing:
    """Stands for a key that is not there."""


def _flat(values: Any, prefix: str = "") -> dict[str, Any]:
    if isinstance(values, Mapping) and values:
        items = [(str(key), value) for key, value in values.items()]
    elif isinstance(values, list | tuple) and values:
        items = [(str(i), value) for i, value in enumerate(values)]
    else:
        return {prefix: values}
    found: dict[str, Any] = {}
    for key, value in items:
        found |= _flat(value, f"{prefix}.{key}" if prefix else key)
    return found


def _short(value: Any) -> str:
    text = str(value)
    return text if len(text) <= 60 else text[:57] + "..."
