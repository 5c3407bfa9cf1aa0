"""What ``import pilotage`` offers, function by function; ``pilotage.__all__`` lists it."""
