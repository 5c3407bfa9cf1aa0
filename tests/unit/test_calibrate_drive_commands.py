"""``pilotage calibrate commands`` on simulated robots: what went in comes out, and another robot uses it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from pilotage.cli.main import main
from support.mrclam_drives import Events, Robot, write_mrclam

Capture = pytest.CaptureFixture[str]
UNLIKE = Robot(
    speed_gain=0.9,
    speed_loss=0.4,
    turn_gain=1.1,
    bend_rad_per_m=0.06,
    delay_s=0.3,
    range_scale=0.95,
    depth_power=0.0,
)
"""A robot that the shipped parameters do not know."""
TRUE = {
    "delay_s": 0.3,
    "speed_gain": 0.9,
    "speed_loss_per_rad_s": 0.4,
    "turn_gain": 1.1,
    "bend_rad_per_m": 0.06,
    "range_scale": 0.95,
    "depth_power": 0.0,
}


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four robots of one make, 400 s each."""
    events = Events(duration_s=400.0, wrong_barcodes=0.02, truth_gaps_s=((100.0, 103.0),))
    folder = tmp_path_factory.mktemp("recordings") / "unlike"
    return write_mrclam(folder, [(n, 20 + n, UNLIKE, events) for n in range(1, 5)])


def answered(capsys: Capture, *words: str) -> dict[str, Any]:
    code = main([*words, "--json"])
    captured = capsys.readouterr()
    assert code == 0, captured.err
    answer = json.loads(captured.out)
    assert isinstance(answer, dict)
    return answer


def test_another_robot_runs_with_what_was_learned(recordings: Path, tmp_path: Path, capsys: Capture) -> None:
    """Seven intervals of 95 %, widened twofold: with this seed, fixed; by chance they fail once in 500."""
    words = ["calibrate", "commands", str(recordings), "--format", "mrclam", "--out", str(tmp_path)]
    answer = answered(capsys, *words, "--robot", "1", "--robot", "2", "--robot", "3")
    for name, value in TRUE.items():
        low, high = answer[name]["low"], answer[name]["high"]
        assert abs(value - 0.5 * (low + high)) < high - low, name
        assert high - low < 0.3, name
    assert [log["robot"] for log in answer["logs"]] == [1, 2, 3]
    assert answer["logs"][0]["alone"]["turn_gain"]["value"] == pytest.approx(1.1, abs=0.1)
    page = Path(answer["report"]).read_text()
    assert page.count("<figure>") == 4
    ids = re.findall(r' id="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    assert "nan" not in re.sub(r"[a-z]*nan[a-z]+|[a-z]+nan", "", page.lower())
    assert main(["report", answer["calibration_dir"]]) == 0
    capsys.readouterr()

    run = ["localize", str(recordings), "--format", "mrclam", "--robot", "4", "--no-report"]
    run += ["--out", str(tmp_path)]
    learned = answered(capsys, *run, "--set", f"@{answer['parameter_file']}")
    shipped = answered(capsys, *run)
    assert learned["position_rmse_m"] < 0.1 < shipped["position_rmse_m"]
    assert learned["nees_mean"] < 5.0


def test_sets_leave_each_recording_out(recordings: Path, tmp_path: Path, capsys: Capture) -> None:
    words = ["calibrate", "commands", str(recordings), "--format", "mrclam", "--out", str(tmp_path)]
    answer = answered(capsys, *words, "--leave-one-out", "--no-report")
    sets = yaml.safe_load(Path(answer["sets_file"]).read_text())["sets"]
    learned = [[source["robot"] for source in one["learned_from"]] for one in sets]
    assert learned == [[1, 2, 3, 4], [2, 3, 4], [1, 3, 4], [1, 2, 4], [1, 2, 3]]
    parameters = yaml.safe_load(Path(answer["parameter_file"]).read_text())["stack"]["localizer"]
    assert {"name": parameters.pop("name"), **sets[0]["parameters"]} == {
        "name": "ekf-gauss-markov",
        **parameters,
    }


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--format", "mrclam"], "expected folders of recordings with truth"),
        (["HERE"], "expected bags, or --format mrclam, found neither"),
        (["HERE", "--format", "mrclm"], "did you mean 'mrclam'?"),
        (["HERE", "--format", "mrclam", "--seed", "3"], "leave them out"),
        (["HERE", "--format", "mrclam", "--robot", "9"], "expected a robot from 1 to 5, found 9"),
        (["HERE", "--format", "mrclam", "--robot", "5"], "Robot5_Odometry.dat: expected a readable file"),
        (["HERE", "--format", "mrclam", "--robot", "1", "--robot", "1"], "expected every robot once"),
        (["HERE", "HERE", "--format", "mrclam", "--robot", "1"], "found HERE robot 1 twice"),
        (
            ["HERE", "--format", "mrclam", "--robot", "1", "--leave-one-out"],
            "expected two or more recordings",
        ),
        (["EMPTY", "--format", "mrclam"], "expected files such as Robot1_Odometry.dat"),
        (["HERE/Barcodes.dat", "--format", "mrclam"], "expected the folder of a MRCLAM data set"),
    ],
)
def test_what_cannot_be_learned_from_is_refused_in_one_line(
    recordings: Path, tmp_path: Path, capsys: Capture, words: list[str], said: str
) -> None:
    places = {"HERE": str(recordings), "EMPTY": str(tmp_path)}

    def real(word: str) -> str:
        for name, place in places.items():
            word = word.replace(name, place)
        return word

    assert main(["calibrate", "commands", *map(real, words), "--out", str(tmp_path)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert real(said) in captured.err


def test_its_options_are_not_for_the_others(tmp_path: Path, capsys: Capture) -> None:
    assert main(["calibrate", "odometry", "--robot", "1", "--out", str(tmp_path)]) == 2
    assert "are for 'calibrate commands'" in capsys.readouterr().err


def test_a_robot_that_stands_still_teaches_nothing(tmp_path: Path, capsys: Capture) -> None:
    standing = Events(duration_s=300.0, standing_s=((0.0, 300.0),))
    folder = write_mrclam(tmp_path / "still", [(1, 1, Robot(), standing)])
    assert main(["calibrate", "commands", str(folder), "--format", "mrclam", "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "calibrate commands: expected" in said
