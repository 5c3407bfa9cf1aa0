"""Each sensor's geometry, rate and noise, and the readings that it hands over."""
