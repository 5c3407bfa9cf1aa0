"""Damaged cases from healthy ones."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable
from pathlib import Path

from support import damage
from support.fuzz_targets import Target

NO_FILE_SHARE = 0.05


class Healthy:
    """Healthy inputs, made once for all uses that write the same, and copied."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._made: dict[Callable[[Path], None], Path] = {}

    def copy(self, target: Target, to: Path) -> Path:
        """A fresh copy; what was there before is gone."""
        if target.write not in self._made:
            made = self._folder / str(len(self._made))
            made.mkdir(parents=True)
            target.write(made)
            self._made[target.write] = made
        shutil.rmtree(to, ignore_errors=True)
        shutil.copytree(self._made[target.write], to)
        return to


def renamed(target: Target, folder: Path, mark: str) -> list[str]:
    """Give the files that a use names, and what it writes, names with ``mark``; returns the words."""
    words = list(target.words)
    for i, word in enumerate(words):
        if word == "out":
            words[i] = f"{mark}out"
        elif i and "/" not in word and word not in (".", "..") and (folder / word).exists():
            (folder / word).rename(folder / f"{mark}{word}")
            words[i] = f"{mark}{word}"
    return words


def damaged_case(target: Target, healthy: Healthy, to: Path, rng: random.Random) -> str:
    """Write a use's inputs, one of them damaged; says what was done to which."""
    folder = healthy.copy(target, to)
    path = folder / rng.choice(target.files)
    if rng.random() < NO_FILE_SHARE:
        return f"{path.name}: {damage.no_file(path, rng)}"
    damaged = damage.damaged(path.read_bytes(), rng, target.trees)
    damage.put(path, damaged)
    return f"{path.name}: damaged"
