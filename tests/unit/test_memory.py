"""Free pages go back to the system."""

from __future__ import annotations

import ctypes
from pathlib import Path

import pytest

from pilotage.core.memory import give_back

STATM = Path("/proc/self/statm")


def resident_bytes() -> int:
    return int(STATM.read_text().split()[1]) * 4096


@pytest.mark.skipif(not STATM.exists(), reason="the system does not tell what a process holds")
def test_holes_between_what_stays_are_given_back() -> None:
    if not hasattr(ctypes.CDLL(None), "malloc_trim"):
        pytest.skip("this C library gives back by itself, or never")
    pieces = [bytes([k % 256]) * 16_000 for k in range(6_000)]
    kept = pieces[::40]
    pieces.clear()
    before = resident_bytes()
    give_back()
    assert before - resident_bytes() > 40_000_000
    assert len(kept) == 150


def test_a_system_without_the_call_keeps_its_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda _: object())
    give_back()
