"""Exact contact looked up: nodes solved for one pair of profiles, kept, and interpolated."""
