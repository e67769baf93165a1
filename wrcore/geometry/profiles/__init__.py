"""Profiles of wheels and rails: named profiles, point files, checks, smoothing."""
