"""Geometry of pairs, error of planar detection, reductions, the search against a dense one."""
