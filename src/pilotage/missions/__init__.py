"""The mission files that we ship, and the schema that every mission file follows."""
