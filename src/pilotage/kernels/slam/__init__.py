"""Kernels of SLAM's back end: sparse least squares over planar poses."""
