"""Runs and measured signals: comparison, validation numbers and identification of parameters."""
