"""Errors and computing time of creep laws and creep tables, relative to the exact solver and CONTACT."""
