"""The states of a robot on patrol, one class each, and the transitions between them, one function each."""
