"""Figures and animations of runs, scenes and results."""
