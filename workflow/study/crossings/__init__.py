"""Comparison of contact models on a crossing: height of the wheel, load on the nose, pressure, computing time."""
