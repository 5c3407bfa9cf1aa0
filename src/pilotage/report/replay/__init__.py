"""The replay on a run's page: a scene of fixed layers and moving tracks, and the player that shows it."""
