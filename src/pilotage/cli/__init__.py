"""The command line: parse arguments, call one function, print.

Commands that belong together are a small module; what is heavy (numpy, numba, matplotlib) is
imported inside the command that needs it, so that ``pilotage --help`` answers at once.
"""
