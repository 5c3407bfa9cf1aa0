"""One planning query: the report's sweep from (1, 1) to (20, 12), against the exact shortest path."""

from pilotage.experiments.planning import plan_on_map

for settings in (["stop=first", "smoother=none"], ["stop=optimize", "smoother=none"], []):
    answer = plan_on_map("museum", (1.0, 1.0, 0.0), (20.0, 12.0), "rrt-star-dubins", settings, seed=3)
    label = " ".join(settings) or "with smoothing"
    length, shortest = answer["planned_length_m"], answer["shortest_length_m"]
    print(f"{label:30s} {length:6.2f} m, {length / shortest:.3f} x the shortest")
