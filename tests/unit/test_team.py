"""Teams: robots of one description, their starting places, and the radio between them."""

import math

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import STOP, Pose2, Twist
from pilotage.experiments.build.build import build_source
from pilotage.experiments.mission import load_mission, mission_of
from pilotage.experiments.resolve import resolved_values
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.radio import RadioConfig
from pilotage.sensors.readings import RadioMessages
from pilotage.sim.source import Simulator
from pilotage.sim.worlds.world import World
from support import worlds

EMPTY = WorldMap("empty", (-50.0, -50.0, 50.0, 50.0))
MUSEUM = ["world.obstacles=[]", "world.start=null"]


def radios(count: int, *, apart_m: float, seed: int = 0, **config: object) -> Simulator:
    """Robots in a row with radios alone."""
    specs = [
        worlds.robot(
            {"radio": RadioConfig.model_validate(config)},
            start=Pose2(apart_m * k, 0.0, 0.0),
            name=f"r{k}",
            seed=seed,
        )
        for k in range(count)
    ]
    return Simulator(World.of(EMPTY), specs, 0.1)


def heard(sim: Simulator, row: int = 1) -> list[tuple[str, object]]:
    """What arrives at a robot in one step."""
    said = sim.step([STOP] * len(sim.bodies))[row].by_sensor["radio"]
    assert isinstance(said, RadioMessages)
    return [(message.sender, message.content) for message in said.messages]


class TestRadio:
    def test_a_message_takes_a_step_and_its_delay(self) -> None:
        sim = radios(2, apart_m=2.0, delay_s=0.3)
        assert heard(sim) == []
        sim.transmit(0, ["hello"])
        assert [heard(sim) for _ in range(4)] == [[], [], [("r0", "hello")], []]

    def test_it_reaches_no_farther_than_its_range(self) -> None:
        sim = radios(3, apart_m=4.0, range_m=5.0)
        sim.transmit(0, ["near"])
        arrived = sim.step([STOP] * 3)
        counts = [len(said.by_sensor["radio"].messages) for said in arrived]  # type: ignore[union-attr]
        assert counts == [0, 1, 0]

    def test_the_share_that_is_lost_is_the_one_asked_for(self) -> None:
        sim = radios(2, apart_m=1.0, loss=0.3, seed=3)
        came = 0
        for _ in range(2000):
            sim.transmit(0, [None])
            came += len(heard(sim))
        # Binomial(2000, 0.7): 5 sigma is wrong once in 1.7 million.
        assert abs(came / 2000 - 0.7) < 5.0 * math.sqrt(0.21 / 2000)

    def test_a_broken_one_neither_sends_nor_receives(self) -> None:
        sim = radios(2, apart_m=1.0)
        sim.radios[1].works = False
        sim.transmit(0, ["lost"])
        sim.transmit(1, ["lost"])
        assert heard(sim) == []
        sim.radios[1].works = True
        sim.transmit(0, ["back"])
        assert heard(sim) == [("r0", "back")]


class TestTeam:
    def test_robots_of_one_description_begin_apart_and_draw_apart(self) -> None:
        mission = load_mission("museum-1", [*MUSEUM, "team.size=6.0", "team.radio.range_m=10"])
        assert [robot.name for robot in mission.members] == [f"robot-{k}" for k in range(6)]
        assert mission.members[0].sensors["radio"].parameters == {"range_m": 10}
        source = build_source(mission)
        places = np.array([[body.pose.x_m, body.pose.y_m] for body in source.simulator.bodies])
        gaps = np.hypot(*(places[:, None] - places[None, :]).T) + 1e9 * np.eye(6)
        assert gaps.min() >= mission.team.spacing_m
        again = build_source(mission)
        assert [b.pose for b in again.simulator.bodies] == [b.pose for b in source.simulator.bodies]
        said = source.simulator.step([Twist(0.5, 0.0)] * 6)
        assert len({repr(readings.by_sensor["odometry"]) for readings in said}) == 6

    def test_a_resolved_mission_runs_again_as_it_is(self) -> None:
        mission = build_source(load_mission("museum-1", [*MUSEUM, "team.size=3", "team.radio={}"])).mission
        again = mission_of(resolved_values(mission))
        assert resolved_values(again) == resolved_values(mission)

    @pytest.mark.parametrize(
        ("overrides", "told"),
        [
            (
                ["team.size=3", "team.starts=[{x_m: 1, y_m: 1}, {x_m: 3, y_m: 1}]"],
                r"team.*size: expected at most 2 robots, one for each of team\.starts, found 3",
            ),
            (["team.size=0"], r"team\.size"),
            (["team.size=3", "robots=[{}]"], r"team\.size: expected 1, as many as robots lists"),
            (["team.size=2", "team.radio.range_m=0"], r"found 0; to have no radio set team\.radio to null"),
            (["team.size=2", "team.radio=telegraph"], "unknown sensor 'telegraph'"),
            (["team.size=2", "team.radio=5"], r"^team\.radio: expected a mapping with keys of name, found 5"),
            (["team.size=2", "team.radio={name: 5}"], r"^team\.radio\.name: input should be a valid string"),
        ],
    )
    def test_what_cannot_be_is_refused(self, overrides: list[str], told: str) -> None:
        with pytest.raises(InputError, match=told):
            load_mission("museum-1", [*MUSEUM, *overrides])

    def test_more_robots_than_the_floor_has_places_are_refused(self) -> None:
        mission = load_mission("museum-1", [*MUSEUM, "team.size=9", "team.spacing_m=25"])
        with pytest.raises(InputError, match=r"team\.size: expected at most \d, for"):
            build_source(mission)

    def test_robots_that_fit_nowhere_are_told_to_be_too_large(self) -> None:
        """It said that 0 robots are the most, and to ask for less spacing."""
        mission = load_mission("museum-1", [*MUSEUM, "team.size=2", "robot.footprint.radius_m=15"])
        with pytest.raises(InputError, match=r"robot\.footprint: expected a starting place .* smaller robot"):
            build_source(mission)
