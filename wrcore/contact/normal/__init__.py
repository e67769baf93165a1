"""Pressure in a patch by strips."""
