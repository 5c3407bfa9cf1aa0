"""The page of a calibration folder: its numbers with their intervals, and the errors they rest on."""
