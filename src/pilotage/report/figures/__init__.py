"""One file a figure; each takes a run's data and returns an illustration, also for a run without them."""
