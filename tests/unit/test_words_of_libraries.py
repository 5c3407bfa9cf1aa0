"""What is said of a damaged file is about the file, not about Python."""

from __future__ import annotations

import json
import zlib
from pathlib import Path

import pytest

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.core.files.words import in_words
from pilotage.core.yaml_text import load_yaml
from pilotage.records.events import EVENTS_FILE, read_events


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (OSError(22, "Invalid argument"), "Invalid argument"),
        (OSError("image file is truncated"), "image file is truncated"),
        (zlib.error("Error -3 while decompressing data: invalid code"), "what is packed is damaged"),
        (ValueError("invalid literal for int() with base 10: b'x'"), "expected a whole number, found 'x'"),
        (ValueError("Token too long in file header: b'\\xcd'"), "Token too long in file header: '\\xcd'"),
        (EOFError(), "damaged data"),
    ],
)
def test_errors_are_told_without_pythons_words(error: Exception, told: str) -> None:
    assert in_words(error) == told


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"P5\nx 20\n255\n", "cannot be read (expected a whole number, found 'x'); it may be cut short"),
        (b"P5\n" + b"\xcd" * 40, "cannot be read (Token too long in file header: "),
    ],
)
def test_a_damaged_image(
    content: bytes, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "map.pgm"
    path.write_bytes(content)
    assert main(["draw", str(path), "--resolution", "0.1"]) == 2
    said = capsys.readouterr().err
    assert told in said
    assert "b'" not in said


@pytest.mark.parametrize("tag", ["!!python/object/apply:os.system", "!mine", "!!set"])
def test_a_tag_that_has_no_meaning_is_named(tag: str) -> None:
    with pytest.raises(InputError, match="line 1: expected YAML, found: the tag '!!") as caught:
        load_yaml(f"a: {tag} {{b, c}}", "m.yaml")
    assert str(caught.value).endswith(f"the tag '!!{tag.lstrip('!')}', which has no meaning here")


@pytest.mark.parametrize(
    ("entry", "told"),
    [
        ({"t_s": 1.0, "kind": 3, "text": "x"}, "kind: expected a text, found int 3"),
        ({"t_s": 1.0, "kind": "x", "text": None}, "text: expected a text, found none"),
        ({"t_s": 1.0, "kind": "x"}, "expected objects with t_s, kind and text, found one with t_s, kind"),
    ],
)
def test_an_event_says_what_is_wrong_with_it(entry: object, told: str, tmp_path: Path) -> None:
    (tmp_path / EVENTS_FILE).write_text(json.dumps(entry) + "\n")
    with pytest.raises(InputError) as caught:
        read_events(tmp_path)
    assert str(caught.value) == f"{tmp_path / EVENTS_FILE}: {told}"
