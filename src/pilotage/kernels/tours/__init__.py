"""Tours: in which order to visit places, exactly or by local search, and how far off that can be."""
