"""The whole robot: localizes, maps, plans, follows, reacts, and knows when it is done."""
