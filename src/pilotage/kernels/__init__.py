"""The hot loops: plain arrays in, plain arrays out, capped loops, a status out.

Imports numpy and numba only. The one mention of numba is ``pilotage.kernels.jit``.
"""
