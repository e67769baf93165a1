"""Checks whether a run stayed in the range in which its models and inputs are valid."""
