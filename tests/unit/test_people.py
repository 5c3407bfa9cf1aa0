"""People in the world: seen, met, judged; missions that have them, and their replay."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import Pose2, Twist
from pilotage.experiments.mission import mission_of, read_mission
from pilotage.experiments.run import run_mission
from pilotage.kernels.bodies.drive import STATE_SIZE
from pilotage.kernels.people.encounters import APART, WALKED_INTO, solid_people
from pilotage.maps.world_map import WorldMap
from pilotage.records.people import PEOPLE_FILE, read_people_tracks
from pilotage.records.run_data import read_run
from pilotage.report.replay.floor import floor_scene
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan
from pilotage.sim.people.crowd import Encounters
from pilotage.sim.people.people import Around, PeopleSetting
from pilotage.sim.people.track import TrackConfig, TrackPeople, needs_m
from pilotage.sim.source import Simulator
from pilotage.sim.worlds.world import World
from support.people import Walker
from support.worlds import CAR, ROOM_MAP, robot

WALKERS = Path(__file__).parent.parent / "support" / "walkers.txt"
EMPTY = World.of(WorldMap("empty", (-20.0, -20.0, 20.0, 20.0)), np.array([[-19.0, -19.0, -19.0, 19.0]]))
STAY, ON = Twist(0.0, 0.0), Twist(1.0, 0.0)


def among(people: list[Walker], **more: object) -> Simulator:
    scanner = LidarConfig(beams=5, field_of_view_rad=math.pi, range_var_m2=0.0, max_range_m=8.0)
    spec = robot({"scan": scanner}, start=Pose2(0.0, 0.0, 0.0), **more)  # type: ignore[arg-type]
    return Simulator(EMPTY, [spec], 0.1, people)


def met(sim: Simulator) -> Encounters:
    assert sim.crowd is not None
    return sim.crowd.encounters(0)


def test_people_are_seen_and_touch_a_robot_that_stands_without_its_fault() -> None:
    sim = among([Walker(lambda t: (max(4.0 - t, 0.3), 0.0))])
    scan = sim.step([STAY])[0].by_sensor["scan"]
    assert isinstance(scan, LidarScan)
    assert scan.ranges_m[2] == pytest.approx(3.65)
    for _ in range(33):
        sim.step([STAY])
    assert met(sim).closest_m == pytest.approx(0.05)
    assert met(sim).near_share == pytest.approx(5 / 34)
    for _ in range(5):
        sim.step([STAY])
    found = met(sim)
    assert (found.collisions, found.touches, sim.bodies[0].collisions) == (0, 1, 0)
    assert sim.bodies[0].pose.x_m == 0.0
    for _ in range(30):
        sim.step([Twist(-1.0, 0.0)])
    assert (met(sim).collisions, met(sim).touches) == (0, 1)


def test_a_robot_that_drives_into_somebody_is_stopped_and_to_blame() -> None:
    sim = among([Walker(lambda _t: (2.0, 0.0))])
    for _ in range(40):
        sim.step([ON])
    assert sim.bodies[0].pose.x_m == pytest.approx(2.0 - 0.25 - 0.3, abs=1e-6)
    assert (met(sim).collisions, met(sim).touches, sim.bodies[0].collisions) == (1, 0, 1)
    assert met(sim).closest_m == pytest.approx(0.0, abs=1e-6)


def test_touches_between_two_steps_count() -> None:
    """He runs into its side within one step: apart before and after, a touch between."""
    sim = among([Walker(lambda t: (1.0, 12.0 * t - 7.8))], footprint=CAR)
    for _ in range(14):
        sim.step([ON])
        assert sim.crowd is not None
        here = sim.crowd.places_m[0]
        assert abs(here[1]) > 0.5  # never beside the robot at the end of a step
    assert sim.bodies[0].pose.x_m > 1.0
    assert (met(sim).collisions, met(sim).touches) == (0, 1)
    assert met(sim).closest_m < 1e-3


def test_who_overtakes_a_robot_through_it_is_not_hit_by_it() -> None:
    """Its own motion widens the gap from behind; then he is inside it, and in front he is gone."""
    sim = among([Walker(lambda t: (-3.0 + 2.0 * t, 0.0))])
    for _ in range(60):
        sim.step([Twist(0.2, 0.0)])
    assert (met(sim).collisions, met(sim).touches, sim.bodies[0].collisions) == (0, 1, 0)
    assert sim.bodies[0].driven_m > 1.0


def test_who_leaves_a_robot_is_not_in_its_way() -> None:
    """Also in the step that takes a runner out of it: he is just ahead then, and would stop it."""
    state = np.zeros((1, STATE_SIZE))
    corners, first = np.array(CAR.points_m), np.array([0, len(CAR.points_m)])
    ahead = np.array([[float(corners[:, 0].max()) + 0.3, 0.0]])
    for between, passes in ((WALKED_INTO, True), (APART, False)):
        radii, radius = np.array([CAR.radius_m]), np.array([0.25])
        found = solid_people(state, corners, first, radii, ahead, radius, np.array([[between]]))
        assert np.isnan(found).all() == passes


def test_a_robot_that_backs_into_somebody_who_comes_is_to_blame() -> None:
    sim = among([Walker(lambda t: (-3.0 + 1.0 * t, 0.0))])
    for _ in range(40):
        sim.step([Twist(-0.3, 0.0)])
    assert met(sim).collisions == sim.bodies[0].collisions == 1


def test_who_walks_through_a_robot_comes_as_near_as_nothing_and_no_nearer() -> None:
    """They were told as 0.25 m inside each other with nothing having collided."""
    sim = among([Walker(lambda t: (-2.0 + 1.0 * t, 0.0))])
    cleared_m = []
    for _ in range(40):
        sim.step([STAY])
        cleared_m.append(sim.bodies[0].clearance_m)
    assert (met(sim).touches, met(sim).collisions, sim.bodies[0].collisions) == (1, 0, 0)
    assert min(cleared_m) == met(sim).closest_m == 0.0
    assert cleared_m[-1] > 1.0


def test_those_who_are_not_there_are_neither_seen_nor_met() -> None:
    sim = among([Walker(lambda t: (1.0, 0.0) if t > 0.45 else (math.nan, math.nan))])
    for _ in range(4):
        scan = sim.step([STAY])[0].by_sensor["scan"]
        assert isinstance(scan, LidarScan)
        assert scan.ranges_m[2] == 8.0
    assert met(sim) == Encounters(0, 0, math.inf, 0.0)
    sim.step([STAY])
    assert met(sim).closest_m == pytest.approx(0.45)


def visited(people: object, **settings: object) -> object:
    base = read_mission("barn-course")
    given = {
        "world.people": people,
        "run.time_limit_s": 6.0,
        "stack.local_controller": {"name": "pure-pursuit"},
    }
    return mission_of(base, (), 3, {**given, **settings})


def test_a_mission_has_people_who_are_judged_recorded_and_replayed(tmp_path: Path) -> None:
    people = [
        {"name": "track", "file": str(WALKERS), "moved_by_m": [-8.0, -4.0], "frame_rate_hz": 10.0},
        {"name": "social-force", "count": 3},
    ]
    runs = [run_mission(visited(people), out=tmp_path / str(k)) for k in range(2)]  # type: ignore[arg-type]
    metrics = runs[0].metrics
    assert {"people_collisions", "people_touches", "people_closest_m", "people_near_share"} <= set(metrics)
    assert metrics["people_closest_m"] == runs[1].metrics["people_closest_m"]
    assert runs[0].run_dir is not None
    tracks = read_people_tracks(runs[0].run_dir)
    assert tracks.places_m.shape == (metrics["steps"], 2 + 3, 2)
    again = mission_of(read_mission(str(runs[0].run_dir / "mission.yaml")))
    assert run_mission(again, save=False).metrics["people_closest_m"] == metrics["people_closest_m"]
    scene = floor_scene(read_run(runs[0].run_dir))
    assert scene is not None
    assert scene.discs[0].places_m.shape == tracks.places_m.shape
    (runs[0].run_dir / PEOPLE_FILE).write_bytes(b"nothing")
    with pytest.raises(InputError, match=PEOPLE_FILE):
        read_people_tracks(runs[0].run_dir)
    assert json.loads((runs[1].run_dir / "metrics.json").read_text())["people_collisions"] >= 0  # type: ignore[operator]


@pytest.mark.parametrize(
    ("people", "words"),
    [
        ([{"name": "tracks", "file": "a"}], "did you mean 'track'"),
        ([{"name": "track"}], r"world\.people\.0\.file"),
        ([{"name": "track", "file": "nowhere.txt"}], "nowhere.txt"),
        (
            [{"name": "track", "file": str(WALKERS), "begins_s": 99.0}],
            r"people\.0\.begins_s: expected at most",
        ),
        ([{"name": "social-force", "doors_m": [[0.0, 0.0]]}], "expected two places or more"),
        ([{"name": "social-force", "doors_m": [[0.0, 0.0], [-2.25, 0.0]]}], r"doors_m\.1: expected room"),
        ([{"name": "social-force", "count": 900}], "expected room for 900 people"),
    ],
)
def test_people_who_cannot_be_are_refused(people: object, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        run_mission(visited(people), save=False)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


def test_recorded_people_appear_no_nearer_than_a_robot_can_stop_for(tmp_path: Path) -> None:
    file = tmp_path / "tracks.txt"
    # He walks 1.25 m/s towards the robot; the recording begins with him 3 m ahead.
    file.write_text("".join(f"{10 * k} 1 {3.0 - 0.5 * k:.2f} 0.0\n" for k in range(9)))
    robot_m, stopping = np.array([[0.0, 0.0, 0.0, 0.3]]), np.array([[0.1, 2.0]])
    for speed_m_s, there in ((0.0, True), (2.0, False)):
        setting = PeopleSetting(
            World.of(ROOM_MAP), robot_m, stopping, 0.1, np.random.default_rng(0), "world.people.0"
        )
        people = TrackPeople(TrackConfig(file=str(file)), setting)
        moved = robot_m + np.array([0.1 * speed_m_s, 0.0, 0.0, 0.0])
        nobody = np.full((1, 3), np.nan)
        places = people.step(0.0, Around(moved, nobody, 0))
        assert np.isfinite(places[0, 0]) == there
    # By hand: 0.7 s until it brakes and 1 s until it stands, in which he comes nearer by 1.7 s of walking.
    needed = needs_m(2.0, np.array([0.0, 1.25]), 0.7, 2.0)
    assert needed == pytest.approx([2.0 * 0.7 + 1.0, 2.0 * 0.7 + 1.0 + 1.25 * 1.7])
