"""From raw readings to what matters: which returns the map does not explain."""
