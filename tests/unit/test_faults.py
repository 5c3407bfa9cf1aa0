"""Faults of sensors: what they do to the stream, in a mission, and to nobody else."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.core.chi_square import chi_square_quantile, gated_mean
from pilotage.core.errors import InputError
from pilotage.core.types import STOP, Pose2
from pilotage.experiments.build.build import build
from pilotage.experiments.loop import run_loop, simulate
from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import judge
from pilotage.sensors.readings import BeaconReadings, LidarScan, OdometryIncrement, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.sim.faults.fault import Faults, FaultSetting, arrived
from pilotage.sim.faults.late import Delay, DelayConfig, Repeat, RepeatConfig, Shuffle, ShuffleConfig
from pilotage.sim.faults.lost import Drop, DropConfig, Gap, GapConfig
from pilotage.sim.faults.wrong import BiasStep, BiasStepConfig, SwapIdentities, SwapIdentitiesConfig
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.localization.ekf_landmarks import EkfLandmarkLocalizer
from pilotage.stack.localization.landmark_filter import LandmarkFilterConfig
from pilotage.stack.localization.odometry_doubt import OdometryDoubt
from pilotage.stack.localization.odometry_watch import OdometryWatch
from pilotage.stack.localization.self_check import HOLD_S, NOISE_SHARE, SOON_S, ExplainedShare, SelfCheck
from support.bare_robots import ON_BEACONS, ON_WALLS
from support.robots import BEACONS, told_of

STEPS = 2000


def setting() -> FaultSetting:
    return FaultSetting(np.random.default_rng(1), BEACONS.ids, "robot.faults.0")


def odometry(step: int) -> OdometryIncrement:
    return OdometryIncrement(float(step), 0.0)


class TestStreams:
    def test_a_share_is_dropped(self) -> None:
        drop = Drop(DropConfig(sensor="odometry", share=0.3), setting())
        kept = sum(len(drop.pass_on(0.1 * k, (odometry(k),))) for k in range(STEPS))
        # 4 sigma of a binomial: a false alarm in some 16,000 seeds.
        assert abs(kept - 0.7 * STEPS) < 4.0 * np.sqrt(0.21 * STEPS)

    def test_a_gap_has_its_length(self) -> None:
        faults = Faults(
            [(config := GapConfig(sensor="odometry", from_s=1.0, length_s=2.0), Gap(config, setting()))]
        )
        came = [round(0.1 * k, 1) for k in range(50) if faults.pass_on(0.1 * k, {"odometry": odometry(k)})]
        assert max(t for t in came if t < 2.0) == 0.9
        assert min(t for t in came if t > 2.0) == 3.0

    def test_what_is_late_comes_whole_and_not_too_late(self) -> None:
        delay = Delay(DelayConfig(sensor="odometry", most_s=0.25), setting())
        came = [(k, one) for k in range(100) for one in delay.pass_on(0.1 * k, (odometry(k),))]
        late = [k - int(one.distance_m) for k, one in came if isinstance(one, OdometryIncrement)]
        assert min(late) >= 0
        assert max(late) == 3  # steps of 0.1 s
        assert len(came) >= 97
        order = [one.distance_m for _, one in came if isinstance(one, OdometryIncrement)]
        assert order != sorted(order)

    def test_what_is_shuffled_keeps_every_reading(self) -> None:
        shuffle = Shuffle(ShuffleConfig(sensor="odometry", window=4), setting())
        came = [one for k in range(100) for one in shuffle.pass_on(0.1 * k, (odometry(k),))]
        order = [int(one.distance_m) for one in came if isinstance(one, OdometryIncrement)]
        assert order != sorted(order)
        assert sorted(order[:96]) == list(range(96))

    def test_readings_of_one_step_arrive_as_one(self) -> None:
        repeat = Repeat(RepeatConfig(sensor="odometry", share=1.0), setting())
        twice = repeat.pass_on(0.1, (OdometryIncrement(0.1, 0.2, 0.3),))
        assert arrived(twice) == OdometryIncrement(0.2, 0.4, 0.6)
        seen = BeaconReadings(np.array([1]), np.array([2.0]), np.array([0.5]))
        merged = arrived([seen, seen])
        assert isinstance(merged, BeaconReadings)
        assert merged.ids.tolist() == [1, 1]
        first, last = LidarScan(np.ones(3)), LidarScan(np.zeros(3))
        assert arrived([first, last]) is last

    def test_identities_are_swapped_for_others_of_the_map(self) -> None:
        swap = SwapIdentities(SwapIdentitiesConfig(sensor="beacons", share=1.0), setting())
        ids = BEACONS.ids[:2].copy()
        seen = BeaconReadings(ids, np.array([2.0, 3.0]), np.array([0.5, 0.6]))
        (told,) = swap.pass_on(0.1, (seen,))
        assert isinstance(told, BeaconReadings)
        assert (told.ids != ids).all()
        assert np.isin(told.ids, BEACONS.ids).all()
        assert seen.ids.tolist() == BEACONS.ids[:2].tolist()

    def test_a_bias_begins_when_it_is_told_to(self) -> None:
        config = BiasStepConfig(sensor="odometry", from_s=1.0, by_m=0.5)
        faults = Faults([(config, BiasStep(config, setting()))])
        assert faults.pass_on(0.9, {"odometry": odometry(1)})["odometry"] == odometry(1)
        assert faults.pass_on(1.0, {"odometry": odometry(1)})["odometry"] == OdometryIncrement(1.5, 0.0)


class TestMissions:
    SHORT = ("run.time_limit_s=8", "run.oracles=[driver]")

    def test_a_fault_of_one_sensor_leaves_what_others_draw(self) -> None:
        def last_readings(*settings: str) -> Readings:
            built = build(load_mission("museum-route", [*self.SHORT, *settings], 3))
            return [built.simulator.step([STOP]) for _ in range(20)][-1][0]

        plain = last_readings()
        off = last_readings("robot.faults=[{name: bias-step, sensor: beacons, by_m: 1.0}]")
        assert repr(plain.by_sensor["odometry"]) == repr(off.by_sensor["odometry"])
        before, after = plain.by_sensor["beacons"], off.by_sensor["beacons"]
        assert isinstance(before, BeaconReadings)
        assert isinstance(after, BeaconReadings)
        assert after.ranges_m == pytest.approx(before.ranges_m + 1.0)

    def test_the_same_seed_gives_the_same_faults(self) -> None:
        fault = "robot.faults=[{name: drop, sensor: odometry}, {name: outliers, sensor: beacons}]"
        mission = load_mission("museum-route", [*self.SHORT, fault], 4)
        one, other = (simulate(mission).finished.robots[0].trace for _ in range(2))
        assert all(one[name].tobytes() == other[name].tobytes() for name in one)

    @pytest.mark.parametrize(
        ("faults", "words"),
        [
            (
                "[{name: drop, sensor: odometer}]",
                "robot.faults.0.sensor: unknown sensor 'odometer'; did you mean 'odometry'?",
            ),
            ("[{name: dropp, sensor: odometry}]", "unknown fault 'dropp'; did you mean 'drop'?"),
            ("[{name: drop}]", "robot.faults.0"),
            ("[{name: drop, sensor: odometry, share: 2}]", "robot.faults.0.share"),
        ],
    )
    def test_wrong_faults_are_refused(self, faults: str, words: str) -> None:
        with pytest.raises(InputError) as caught:
            build(load_mission("museum-route", [f"robot.faults={faults}"], 0))
        assert words in str(caught.value)
        assert "\n" not in str(caught.value)


class TestWatching:
    def test_silence_widens_by_what_could_be_driven(self) -> None:
        robot = told_of().robot
        watch = OdometryWatch(robot, WheelOdometryConfig(rate_hz=10.0))
        top = robot.motion.top_speed_m_s
        place, unsure = 0.0, Belief(Pose2(0.0, 0.0, 0.0), np.eye(3))
        for k in range(1, 31):
            said = OdometryIncrement(0.05, 0.0) if k <= 10 else None
            more, _ = watch.variances(0.1 * k, said, unsure)
            assert (more == 0.0) == (k <= 10)
            place += more
        assert place == pytest.approx((top * 2.0) ** 2)

    @pytest.mark.parametrize(
        ("sure_m", "status", "grows"),
        [
            (0.01, BeliefStatus.LOCALIZED, False),
            (0.01, BeliefStatus.LOST, True),
            (0.5, BeliefStatus.LOCALIZED, True),
        ],
    )
    def test_silence_begins_anew_where_other_sensors_found_the_robot(
        self, sure_m: float, status: BeliefStatus, grows: bool
    ) -> None:
        """Each silent step took the robot to be farther off than the last one, though it was found in all."""
        robot = told_of().robot
        watch = OdometryWatch(robot, WheelOdometryConfig(rate_hz=10.0))
        belief = Belief(Pose2(0.0, 0.0, 0.0), np.diag([sure_m**2, sure_m**2, 1e-4]), status)
        assert watch.variances(0.1, OdometryIncrement(0.05, 0.0), belief) == (0.0, 0.0)
        more = [watch.variances(0.1 * k, None, belief) for k in range(2, 31)]
        step = (0.1 * robot.motion.top_speed_m_s) ** 2
        assert more[0][0] == pytest.approx(step)
        assert more[-1][0] == pytest.approx(step * (29.0**2 - 28.0**2) if grows else step)
        assert (more[-1][1] > 2.0 * more[0][1]) == grows

    def test_a_wall_filter_goes_by_its_laser_alone(self) -> None:
        """After a second without odometry it was lost, among walls that its scans fitted all the time."""
        more = (
            "robot.faults=[{name: gap, sensor: odometry, from_s: 10, length_s: 8}]",
            "run.time_limit_s=20",
        )
        trace = run_loop(build(load_mission("museum-walls", more, 0))).finished.robots[0].trace
        after = trace["t_s"] > 5.0
        off = np.hypot(trace["est_x_m"] - trace["true_x_m"], trace["est_y_m"] - trace["true_y_m"])
        assert trace["localized"][after].all()
        assert off[after].max() < 0.1

    def test_a_small_disc_is_found_by_the_next_scan(self) -> None:
        """It may turn by 1.3 rad in a silent step: silent between two scans it was blind, and lost from then
        on for 57 of 60 s, two millimetres from where it was."""
        more = (
            "world.obstacles=[]",
            "stack.localizer={name: particle-filter}",
            "robot.footprint={radius_m: 0.05}",
            "robot.motion={name: wheel-drive, wheel_radius_m: 0.02, wheel_separation_m: 0.075, "
            "max_wheel_speed_rad_s: 25}",
            "robot.sensors.lidar.rate_hz=5",
            "robot.faults=[{name: drop, share: 0.05, sensor: odometry}]",
            "run.time_limit_s=60",
        )
        trace = run_loop(build(load_mission("museum-1", more, 0))).finished.robots[0].trace
        off = np.hypot(trace["est_x_m"] - trace["true_x_m"], trace["est_y_m"] - trace["true_y_m"])
        assert trace["localized"].mean() > 0.9
        assert off[trace["t_s"] > 5.0].max() < 0.1

    def test_what_commands_do_not_log_begins_anew_where_landmarks_found_the_robot(self) -> None:
        """It was lost for half of twenty seconds without odometry, and three metres off at their end."""
        more = (
            "stack.localizer={name: ekf-gauss-markov}",
            "robot.faults=[{name: gap, sensor: odometry, from_s: 15, length_s: 20}]",
            "run.time_limit_s=37",
        )
        trace = run_loop(build(load_mission("museum-1", more, 0))).finished.robots[0].trace
        silent = (trace["t_s"] > 15.0) & (trace["t_s"] < 36.0)
        off = np.hypot(trace["est_x_m"] - trace["true_x_m"], trace["est_y_m"] - trace["true_y_m"])
        assert trace["localized"][silent].mean() > 0.9
        assert off[silent].max() < 1.5

    def test_an_increment_beyond_the_top_speed_is_as_uncertain_as_it_is_long(self) -> None:
        robot = told_of().robot
        watch = OdometryWatch(robot, WheelOdometryConfig(rate_hz=10.0))
        far = 3.0 * robot.motion.top_speed_m_s * 0.1
        unsure = Belief(Pose2(0.0, 0.0, 0.0), np.eye(3))
        assert watch.variances(0.1, OdometryIncrement(0.05, 0.0), unsure) == (0.0, 0.0)
        assert watch.variances(0.2, OdometryIncrement(far, 0.0), unsure)[0] == pytest.approx(far**2)

    def test_a_filter_is_believed_later_each_time_that_it_was_wrong(self) -> None:
        check, t_s, waits = SelfCheck(), 0.0, []
        for _ in range(3):
            check.alarm(t_s)
            begin = t_s
            while check.lost(t_s):
                t_s += 0.1
            waits.append(t_s - begin)
        assert waits == pytest.approx([HOLD_S, 2 * HOLD_S, 4 * HOLD_S], abs=0.11)

    @pytest.mark.parametrize(
        ("elsewhere", "nis", "counts"), [(True, 3.0, True), (True, 12.0, False), (False, 3.0, False)]
    )
    def test_a_place_counts_where_its_own_updates_agree(
        self, elsewhere: bool, nis: float, counts: bool
    ) -> None:
        """What the last place was told does not count against one elsewhere, but does against the same."""
        check = SelfCheck()
        for k in range(30):
            check.tell(0.1 * k, 50, 40, 12.0, 3.0)
        check.try_anew(elsewhere)
        for k in range(30, 45):
            check.tell(0.1 * k, 50, 50, nis, 3.0)
        assert check.begin_anew(4.5) is counts
        assert check.lost(4.5) is not counts
        assert check.lost(4.4 + 1.5 * HOLD_S) is not counts  # told another motion than the robot's: longer

    def test_who_was_in_doubt_a_while_ago_may_refuse_half_as_much(self) -> None:
        """A third refused says nothing of a filter never in doubt, nor of one in doubt long ago."""

        def told(check: SelfCheck, begin_s: float) -> bool:
            for k in range(30):
                check.tell(begin_s + 0.1 * k, 6, 4, 8.0, 8.0)
            return check.lost(begin_s + 3.0)

        assert not told(SelfCheck(), 0.0)
        for ago_s, lost in ((1.0, True), (SOON_S - 4.0, True), (SOON_S + 1.0, False)):
            check = SelfCheck()
            check.alarm(0.0)
            assert not check.lost(HOLD_S)
            assert told(check, HOLD_S + ago_s) is lost

    def test_readings_in_their_band_say_nothing(self) -> None:
        """Of chi-square NIS: 6 sigma of the sum over the window, a false alarm in some 1e9 updates."""
        rng, check = np.random.default_rng(2), SelfCheck()
        for k in range(5000):
            check.tell(0.1 * k, 4, 4, float(rng.chisquare(8)), 8.0)
            assert not check.lost(0.1 * k)
        for k in range(5000, 5030):
            check.tell(0.1 * k, 4, 4, 2.0 * float(rng.chisquare(8)), 8.0)
        assert check.lost(503.0)

    @pytest.mark.parametrize("noise", [2.5, 10.0])
    def test_who_is_only_wrong_about_its_noise_is_believed_after_some_windows(self, noise: float) -> None:
        """White readings of more noise than believed, gated at 0.999; worse ones are noticed as ever."""
        rng, gate = np.random.default_rng(4), chi_square_quantile(0.999, 2)
        check = SelfCheck(0.999, noise_share=NOISE_SHARE)

        def tell(t_s: float, factor: float) -> None:
            nis = factor * rng.chisquare(2, 4)
            used = nis <= gate
            check.tell(t_s, 4, int(used.sum()), float(nis[used].sum()), used.sum() * gated_mean(gate, 2))

        for k in range(1000):
            tell(0.1 * k, noise)
            assert check.lost(0.1 * k) or not 5.0 <= 0.1 * k <= 10.0
            assert not check.lost(0.1 * k) or 0.1 * k < 30.0
        for k in range(1000, 1030):
            tell(0.1 * k, 5.0 * noise)
        assert check.lost(103.0)

    @pytest.mark.parametrize("shares", [(0.6, 0.6), (0.9, 0.2)], ids=["refuses too much", "is not the same"])
    def test_what_no_noise_explains_is_never_its_own(self, shares: tuple[float, float]) -> None:
        """A NIS of twice the expected belongs to a gate that lets 93 % through, at any time."""
        check = SelfCheck(0.999, noise_share=NOISE_SHARE)
        for k in range(1500):
            used = round(20 * shares[k // 30 % 2])
            check.tell(0.1 * k, 20, used, 2.0 * used * 1.98, used * 1.98)
            assert check.lost(0.1 * k) or k < 30

    def test_a_place_that_only_looks_alike_explains_less_than_usual(self) -> None:
        rng, explained = np.random.default_rng(3), ExplainedShare()

        def tell(share: float, trusted: bool, scans: int) -> list[bool]:
            return [explained.tell(float(rng.binomial(60, share)) / 60.0, trusted) for _ in range(scans)]

        assert all(tell(0.9, True, 300))
        assert not any(tell(0.05, False, 30)[5:])
        assert not any(tell(0.68, False, 200)[5:])
        assert all(tell(0.9, False, 60)[40:])
        assert all(tell(0.6, False, 3000)[2500:])  # the surroundings have changed for good


@pytest.mark.parametrize(
    ("localizer", "faults"),
    [
        ("ekf-landmarks", "{name: bias-step, sensor: beacons, from_s: 30, by_m: 0.3}"),
        ("invariant-ekf-landmarks", "{name: shuffle, sensor: odometry}, {name: shuffle, sensor: beacons}"),
        ("ekf-walls", "{name: shuffle, sensor: odometry}, {name: shuffle, sensor: lidar}"),
        ("particle-filter", "{name: shuffle, sensor: odometry}, {name: shuffle, sensor: lidar}"),
        (
            "particle-filter",
            "{name: outliers, sensor: lidar, share: 0.1}, "
            "{name: outliers, sensor: odometry, share: 0.02, most_m: 0.5, most_rad: 0.5}",
        ),
    ],
)
def test_bad_readings_make_no_filter_silently_wrong(
    localizer: str, faults: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And without its check of itself, and its doubt of its wheels, it is: this test can fail."""
    bare = ON_BEACONS if "landmarks" in localizer else ON_WALLS
    settings = ["run.oracles=[driver]", *bare, f"stack.localizer={{name: {localizer}}}"]

    def silently_wrong_s(*limit: str) -> float:
        experiment = build(load_mission("museum-route", [*settings, f"robot.faults=[{faults}]", *limit], 0))
        return float(str(judge(experiment, run_loop(experiment)).metrics["silently_wrong_s"]))

    assert silently_wrong_s() <= 5.0
    monkeypatch.setattr(SelfCheck, "lost", lambda *_: False)
    monkeypatch.setattr(OdometryDoubt, "stds", None)
    assert silently_wrong_s("run.time_limit_s=45") > 5.0  # found out long before the end: 11 s at least


@pytest.mark.parametrize("localizer", ["ekf-landmarks", "ekf-walls"])
def test_a_robot_whose_sensor_is_three_times_noisier_than_its_sheet_says_arrives(localizer: str) -> None:
    """In variance; it doubts itself at first, and does not look around for ever."""
    settings = [f"stack.localizer={{name: {localizer}, measurement_var_scale: 0.3}}", "run.time_limit_s=120"]
    experiment = build(load_mission("museum-route", settings, seed=5))
    metrics = judge(experiment, run_loop(experiment)).metrics
    assert metrics["success"], metrics["reason"]
    assert float(str(metrics["position_rmse_m"])) < 0.02


def test_a_filter_that_knows_no_heading_says_so_until_beacons_agree() -> None:
    told = told_of()
    vague = Belief(told.initial.pose, np.diag([4.0, 4.0, 1.0]))
    localizer = EkfLandmarkLocalizer(LandmarkFilterConfig(), told.robot, told.chart, vague, told.journal)
    assert localizer.step(Readings(0.1, {})).status is BeliefStatus.LOST
