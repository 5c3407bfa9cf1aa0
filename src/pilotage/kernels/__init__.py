"""The hot loops: plain arrays in, plain arrays out, capped loops, a status out.

Imports numpy and numba only. ``kernels.dispatchers`` and ``kernels.compiling`` alone mention numba, which is
loaded when the first kernel is called.
"""
