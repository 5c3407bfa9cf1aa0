"""The shipped parameters of MRCLAM robots come out of the command that is said to make them."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import yaml

from pilotage.experiments.calibrate_commands import commands_from
from support.recordings import recording


def test_the_shipped_sets_are_learned_again_to_their_digits(tmp_path: Path) -> None:
    folder = recording("mrclam/MRCLAM_Dataset6")
    answer = commands_from([folder], tmp_path, leave_one_out=True).answer
    sets = yaml.safe_load(Path(str(answer["sets_file"])).read_text(encoding="utf-8"))["sets"]
    shipped = resources.files("pilotage.experiments.recordings") / "mrclam.yaml"
    assert sets == yaml.safe_load(shipped.read_text(encoding="utf-8"))["sets"]
    # The cameras differ by more than their intervals: robot 2 reads 1.052 of the range, robot 3 1.025.
    said = str(answer["warnings"])
    assert "range_scale" in said
    assert "speed_gain" not in said
