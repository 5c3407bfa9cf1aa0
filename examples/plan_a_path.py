"""One planning query: the report's sweep from (1, 1) to (20, 12), against the exact shortest path."""

import pilotage as pl

for settings in ({"stop": "first", "smoother": "none"}, {"stop": "optimize", "smoother": "none"}, {}):
    plan = pl.plan("museum", (1.0, 1.0, 0.0), (20.0, 12.0), seed=3, set=settings)
    label = " ".join(f"{key}={value}" for key, value in settings.items()) or "with smoothing"
    ratio = plan.length_m / plan.shortest_length_m
    print(f"{label:30s} {plan.length_m:6.2f} m, {ratio:.3f} x the shortest")
