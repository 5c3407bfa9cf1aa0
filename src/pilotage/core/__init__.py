"""Value types, angles, random streams, the registry of components, and errors."""
