"""Wear of wheel profiles over a distance, and the influence of settings and models on it."""
