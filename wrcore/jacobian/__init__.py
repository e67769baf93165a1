"""Derivatives of the equations of motion, and the elimination of their blocks."""
