"""Steps of many environments at once beside robot steps of IR-SIM, turn by turn in one run.

    python -m benchmarks.vector_env [--json] [--envs 1024] [--turns 5]

Both sides scan 64 beams with noise among the museum's walls and drive the same disc; IR-SIM steps one robot
along the route (see ``peer_irsim``). Rates are of wall time; beside ours stands the rate of processor time,
which a busy machine does not change. Exit code 1 where IR-SIM is missing or the bar is not cleared.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time

import gymnasium
import numpy as np

from benchmarks.museum import Museum
from benchmarks.peer_irsim import IrsimPeer
from pilotage.bridges import gym
from pilotage.sensors.lidar import LidarConfig

BEAMS, BAR, STEPS = 64, 30.0, 40


def main() -> int:
    """Measure, print, judge."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--envs", type=int, default=1024)
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--json", action="store_true", help="one JSON object instead of the lines")
    asked = parser.parse_args()
    gym.register()
    env = gymnasium.make_vec(
        "pilotage/museum-1-v0",
        num_envs=asked.envs,
        vectorization_mode="vector_entry_point",
        set={"robot.sensors.lidar.beams": BEAMS},
    )
    env.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (asked.envs, 2)).astype(np.float32)
    env.step(actions)
    try:
        peer = IrsimPeer(Museum(), LidarConfig(beams=BEAMS))
    except ImportError:
        print("IR-SIM is not installed: make bench installs the peers", file=sys.stderr)
        return 1
    ours, by_processor, theirs = [], [], []
    for turn in range(asked.turns):
        wall, processor = time.perf_counter(), time.process_time()
        for _ in range(STEPS):
            env.step(actions)
        steps = STEPS * asked.envs
        ours.append(steps / (time.perf_counter() - wall))
        by_processor.append(steps / (time.process_time() - processor))
        taken, took = peer.loop_steps(turn, 4000)
        theirs.append(taken / took)
    ratio = statistics.median(a / b for a, b in zip(ours, theirs, strict=True))
    own, alone = statistics.median(ours), statistics.median(by_processor)
    peer_rate = statistics.median(theirs)
    if asked.json:
        values = {"steps_per_s": own, "steps_per_processor_s": alone, "irsim_steps_per_s": peer_rate}
        print(json.dumps(values | {"ratio": ratio}))
    else:
        print(f"environment steps {own:,.0f} / s ({alone:,.0f} a processor second)")
        print(f"IR-SIM robot steps {peer_rate:,.0f} / s; ratio {ratio:.0f}, bar {BAR:g}")
    return 0 if ratio >= BAR else 1


if __name__ == "__main__":
    sys.exit(main())
