"""The benchmark's trajectories: our errors are those of evo 1.38.1 (its defaults) to 1e-9 m."""

from __future__ import annotations

import pytest

from pilotage.evaluation.trajectory import trajectory_errors
from pilotage.logs.trajectories import guess_format, read_trajectory
from support.recordings import recording

KEYS = ("ate_rmse_m", "ate_mean_m", "ate_median_m", "ate_max_m", "rpe_rmse_m", "rpe_max_m")
TUM = ("trajectories/freiburg1_xyz-rgbdslam.txt", "trajectories/freiburg1_xyz-groundtruth.txt", 785)
KITTI = ("trajectories/KITTI_00_ORB.txt", "trajectories/KITTI_00_gt.txt", 4541)
EXPECTED = {
    (TUM, False, False): (
        0.020079418378506592,
        0.01806251843069654,
        0.016517756173282164,
        0.04328943388403233,
        0.005764370848928318,
        0.020865814532329843,
    ),
    (TUM, False, True): (
        0.017197598502046954,
        0.015867217086438824,
        0.015314382815757121,
        0.03634106512276915,
        0.005805694563121652,
        0.021027081882492558,
    ),
    (TUM, True, False): (
        0.013470088849733684,
        0.012024498709110237,
        0.011183186775061079,
        0.03475954589500906,
        0.005764370848928316,
        0.02086581453232966,
    ),
    (TUM, True, True): (
        0.013389384904168201,
        0.011986889624888909,
        0.011133899090810936,
        0.034846144852261104,
        0.00580569456312165,
        0.02102708188249234,
    ),
    (KITTI, False, False): (
        7.790288882656827,
        7.01175040166684,
        6.801631674560281,
        13.45850880738189,
        0.02812037701739386,
        0.30271249059536337,
    ),
    (KITTI, False, True): (
        7.380185517359466,
        6.633520756181961,
        6.349553443137063,
        13.109253492904802,
        0.027822453343562332,
        0.30439984661186875,
    ),
    (KITTI, True, False): (
        1.3034497145650337,
        1.1569971285389835,
        1.0656247695557912,
        3.587949120678975,
        0.0281203770173941,
        0.302712490595413,
    ),
    (KITTI, True, True): (
        0.9377090736114023,
        0.8726926319693107,
        0.8446910134864141,
        2.693499863613383,
        0.0278224533435625,
        0.30439984661188246,
    ),
}


@pytest.mark.parametrize(("case", "expected"), EXPECTED.items())
def test_errors_are_those_of_the_peer(
    case: tuple[tuple[str, str, int], bool, bool], expected: tuple[float, ...]
) -> None:
    (estimate, reference, poses), align, scale = case
    paths = recording(estimate), recording(reference)
    form = guess_format(paths[0])
    errors = trajectory_errors(*(read_trajectory(path, form) for path in paths), align=align, scale=scale)
    summary = errors.summary()
    assert summary["poses"] == poses
    assert [summary[key] for key in KEYS] == pytest.approx(expected, rel=0.0, abs=1e-9)
