"""The command line: parse arguments, call one function, print.

Each command is a small module; what is heavy (numpy, numba, matplotlib) is imported inside the
command that needs it, so that ``pilotage --help`` answers at once.
"""
