"""Settings that every test shares."""

from __future__ import annotations

import os

from hypothesis import settings

# No test opens a window, and figures look the same on every machine.
os.environ["MPLBACKEND"] = "Agg"

# Drawn examples are the same at every run and for every worker; compiling a kernel may take its time.
settings.register_profile("pilotage", derandomize=True, deadline=None)
settings.load_profile("pilotage")
