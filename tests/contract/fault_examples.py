"""What faults must do: leave their input alone, draw by their own generator alone, make nothing up."""

from __future__ import annotations

from typing import Any

import numpy as np

from pilotage.sensors.readings import BeaconReadings, OdometryIncrement, Reading
from pilotage.sim.faults.fault import FaultSetting

IDS = np.array([3, 5, 8])


def _told(step: int) -> list[Reading]:
    beacons = BeaconReadings(IDS.copy(), np.array([2.0, 3.0, 4.0]) + step, np.array([0.1, -0.2, 3.0]))
    return [OdometryIncrement(0.1, 0.01 * step), beacons]


def fault_befalls(factory: Any, config: Any) -> None:
    """Readings keep their kind; none comes before it was made or more than twice; the seed says all."""
    runs = []
    for _ in range(2):
        faults = [
            factory(config, FaultSetting(np.random.default_rng(3), IDS, "robot.faults.0")) for _ in "ab"
        ]
        passed: list[list[Reading]] = [[], []]
        for step in range(1, 61):
            for kind, (fault, reading) in enumerate(zip(faults, _told(step), strict=True)):
                before = repr(reading)
                passed[kind] += fault.pass_on(0.1 * step, (reading,))
                assert repr(reading) == before
                assert len(passed[kind]) <= 2 * step
        assert all(isinstance(one, OdometryIncrement) for one in passed[0])
        for one in passed[1]:
            assert isinstance(one, BeaconReadings)
            assert set(one.ids) <= set(IDS)
            assert (one.ranges_m >= 0.0).all()
            assert (np.abs(one.bearings_rad) <= np.pi).all()
        runs.append(repr(passed))
    assert runs[0] == runs[1]
    assert runs[0] != repr([list(kind) for kind in zip(*map(_told, range(1, 61)), strict=True)])
