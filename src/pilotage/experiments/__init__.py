"""Mission to objects to run to record: the place where world, stack and evaluation are put together."""
