"""Creep laws and tables against the exact solver and CONTACT."""
