"""What a module would do if it knew the truth, to find out what the real one costs.

Oracles live outside the stack, because truth must not cross the robot's plug; they fill its roles because the
modules meet at those seams. A mission asks for them by ``run.oracles``.
"""
