"""Sweeps: many short runs with results in one table."""
