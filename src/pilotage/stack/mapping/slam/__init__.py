"""Mapping an unknown building with a laser: local matching, verified closures, one graph, one map."""
