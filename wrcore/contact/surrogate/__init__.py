"""Surrogate of exact contact: a trained network that maps the shape of an overlap to its contact forces."""
