"""What may go wrong between a sensor and the robot's stack."""
