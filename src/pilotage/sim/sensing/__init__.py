"""What each sensor would read in the true world: one file a sensor or family of sensors."""
