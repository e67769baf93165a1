"""Pressure and friction in a patch on a uniform grid: reference, and fallback that cannot fail."""
