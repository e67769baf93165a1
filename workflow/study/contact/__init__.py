"""Geometry of wheel-rail pairs, error of planar detection, errors of reductions, test of the contact search."""
