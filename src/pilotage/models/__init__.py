"""Motion and measurement equations with their Jacobians, as values; the arithmetic is in ``kernels``."""
